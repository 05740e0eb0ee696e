"""What an m2pem node for a vehicle is about."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from m2pem.api import SHARED, BehaviorSpec, BehaviorType, Clock, ResourceId
from m2pem_plugin_ros.localization import Localization
from m2pem_plugin_ros.settings import Settings

GROUND = tuple(
    SHARED[name, BehaviorType.VEHICLE]
    for name in (
        "single_vehicle_routing",
        "goto",
        "hold",
        "drive_stop",
        "reverse",
        "teleop",
        "follow",
    )
)
"""What a vehicle on land or water can do, if nothing else is said."""


@dataclass(frozen=True, slots=True)
class Aboard:
    """What the node is about. `origin`: of the frame `map` of the vehicle's odometry (latitude and
    longitude in degrees, altitude in metres). `catalogue`: what the driver can do. `wrap`: gets
    each publisher, and returns what is published with, so that faults can be simulated."""

    vehicle: ResourceId
    settings: Settings
    clock: Clock
    origin: tuple[float, float, float]
    localization: Localization
    domain: str = "ground"
    catalogue: Sequence[BehaviorSpec] = GROUND
    logger: logging.Logger = field(default_factory=lambda: logging.getLogger("m2pem.onboard"))
    wrap: Callable[[Any], Any] = lambda publisher: publisher
