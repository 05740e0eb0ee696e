"""The behaviors of ROS vehicles and payloads: shared ones, and defaults.

`own_behaviors` of a connection declares the behaviors of an m2pem node beyond the shared ones
(`m2pem.api.read_declared_behaviors`).
"""

from m2pem.api import SHARED, BehaviorType

LEVEL = tuple(
    SHARED[name, BehaviorType.VEHICLE]
    for name in (
        "single_vehicle_routing",
        "goto",
        "hold",
        "drive_stop",
        "reverse",
        "follow",
        "teleop",
    )
)
"""The behaviors of vehicles on land and on water."""

PAYLOAD = tuple(spec for (_, type_), spec in SHARED.items() if type_ is BehaviorType.PAYLOAD)
"""The behaviors of payloads with a node of their own."""
