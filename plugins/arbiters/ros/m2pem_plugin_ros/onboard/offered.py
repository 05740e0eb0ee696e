"""What a vehicle with an m2pem node can be asked for, if nothing else is said. Needs no ROS."""

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
"""On land or on water."""
