"""What a ROS vehicle can be asked for, by how it is reached and its domain; needs no ROS."""

from collections.abc import Mapping
from functools import cache

from m2pem.api import SHARED, BehaviorSpec, BehaviorType
from m2pem_plugin_ros.settings import DOMAINS, DriverName

_LEVEL = (
    "single_vehicle_routing",
    "goto",
    "hold",
    "drive_stop",
    "reverse",
    "follow",
    "teleop",
)
"""What moves in the plane can be asked for."""

_OFFERED: Mapping[DriverName, Mapping[str, tuple[str, ...]]] = {
    driver: dict.fromkeys(DOMAINS, _LEVEL) for driver in DriverName
}


@cache
def offered(driver: DriverName, domain: str) -> tuple[BehaviorSpec, ...]:
    """The behaviors of a vehicle, as the fleet's catalogue has them."""
    return tuple(SHARED[name, BehaviorType.VEHICLE] for name in _OFFERED[driver][domain])
