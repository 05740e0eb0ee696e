"""What a ROS vehicle can be asked for, however it is reached; needs no ROS."""

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
