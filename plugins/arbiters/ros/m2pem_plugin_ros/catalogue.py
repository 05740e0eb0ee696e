"""What ROS vehicles and payloads can be asked for, however they are reached; needs no ROS."""

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
"""What moves in the plane, on land or on water, can be asked for."""

PAYLOAD = tuple(spec for (_, type_), spec in SHARED.items() if type_ is BehaviorType.PAYLOAD)
"""What a payload with a node of its own can be asked for."""
