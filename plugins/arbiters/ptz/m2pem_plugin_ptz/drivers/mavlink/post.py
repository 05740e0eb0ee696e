"""What the parts of a MAVLink camera are made with."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from m2pem.api import Clock, ResourceId
from m2pem_plugin_ptz.drivers.mavlink.carrier import Carrier
from m2pem_plugin_ptz.drivers.mavlink.settings import MavlinkSettings
from m2pem_plugin_ptz.head import Reach

if TYPE_CHECKING:
    from m2pem_plugin_mavlink import VehicleLink


@dataclass(frozen=True, slots=True)
class Post:
    """`reach`: as the fleet says. `heard`: is called when a part of the camera has said something
    that shows that it is there."""

    resource: ResourceId
    settings: MavlinkSettings
    reach: Reach
    carrier: Carrier
    link: "VehicleLink"
    clock: Clock
    logger: logging.Logger
    heard: Callable[[], None]

    def now_s(self) -> float:
        """Seconds of the clock."""
        return self.clock.now_us() / 1e6
