"""What a fleet says of the connection to a camera that turns (docs/ptz.md)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from m2pem.api import Connection, ResourceId
from m2pem_plugin_ptz.head import Reach


class DriverName(StrEnum):
    """The ways to reach a camera."""

    ROS = "ros"
    MAVLINK = "mavlink"
    ONVIF = "onvif"


@dataclass(frozen=True, slots=True)
class Mounting:
    """Where the camera is on its vehicle, in the vehicle's frame (REP-103: x forward, y left, z up;
    metres), and to where its pan 0 points, from the bow, clockwise, in radians."""

    forward_m: float = 0.0
    left_m: float = 0.0
    up_m: float = 2.0
    pan_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Settings:
    """`own`: the keys that are the driver's own, unread. `pictures`: the folder that pictures are
    stored in; `stabilized`: the camera keeps its horizon level by itself."""

    driver: DriverName
    reach: Reach = field(default_factory=Reach)
    mounting: Mounting = field(default_factory=Mounting)
    pictures: Path = Path("pictures")
    stabilized: bool = False
    own: Mapping[str, Any] = field(default_factory=dict)


def read_settings(connections: Mapping[ResourceId, Connection]) -> dict[ResourceId, Settings]:
    """The settings of all cameras.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    raise NotImplementedError
