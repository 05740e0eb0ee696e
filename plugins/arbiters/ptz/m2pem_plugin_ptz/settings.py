"""The settings of a camera in the fleet file (docs/ptz.md).

A camera inherits the connection of its vehicle, which may have any arbiter. So an unknown key is no
error, unless it is similar to a key of the camera.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from m2pem.api import Connection, ConnectionReader, Dimension, ResourceId
from m2pem.errors import PluginError
from m2pem_plugin_ptz.gimbal import Reach

LONGEST_S = 2.0
"""Longest delay."""


class DriverName(StrEnum):
    """The drivers of cameras."""

    ROS = "ros"
    MAVLINK = "mavlink"
    ONVIF = "onvif"


@dataclass(frozen=True, slots=True)
class Mounting:
    """The mount position in the vehicle's frame (REP-103: x forward, y left, z up; metres), and the
    direction of pan 0: clockwise from the vehicle's heading, in radians."""

    forward_m: float = 0.0
    left_m: float = 0.0
    up_m: float = 2.0
    pan_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Settings:
    """`own`: the keys of the driver, unread. `pictures`: the folder of pictures. `stabilized`:
    the camera keeps its horizon level. `delay_s`: delay of commands, by which moving targets are
    led."""

    driver: DriverName
    reach: Reach = field(default_factory=Reach)
    mounting: Mounting = field(default_factory=Mounting)
    pictures: Path = Path("pictures")
    stabilized: bool = False
    own: Mapping[str, Any] = field(default_factory=dict)
    delay_s: float = 0.0


def read_settings(connections: Mapping[ResourceId, Connection]) -> dict[ResourceId, Settings]:
    """Read the settings of all cameras.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    return {resource: _read(resource, each.settings) for resource, each in connections.items()}


_KEYS = ("driver", "reach", "mounting", "pictures", "stabilized", "delay")
_REACH = ("pan", "tilt", "zoom_max", "rate", "view", "endless")
_MOUNTING = ("forward", "left", "up", "pan")
_WIDEST_RAD = math.radians(170.0)


def _read(resource: ResourceId, given: Mapping[str, Any]) -> Settings:
    if "/" not in resource:
        raise PluginError(
            f"{resource}: the arbiter 'ptz' serves payloads; this is a vehicle: "
            "name the arbiter of the camera under the vehicle's `payloads`"
        )
    reader = ConnectionReader(resource, given)
    reader.refuse_misspelled(_KEYS)
    names = [str(name) for name in DriverName]
    driver = given.get("driver")
    if driver not in names:
        found = "it is missing" if driver is None else f"{driver!r} is not a driver of cameras"
        raise reader.error("driver", f"{found}; write one of {', '.join(names)}")
    pictures = given.get("pictures", "pictures")
    if not isinstance(pictures, str) or not pictures.strip():
        raise reader.error("pictures", f"{pictures!r} is not the name of a folder")
    return Settings(
        DriverName(driver),
        _reach(reader.inner("reach", "{pan: [-90 deg, 90 deg]}")),
        _mounting(reader.inner("mounting", "{up: 1.2 m}")),
        Path(pictures).expanduser(),
        reader.flag("stabilized", False),
        {key: value for key, value in given.items() if key not in _KEYS},
        reader.quantity("delay", 0.0, Dimension.DURATION, 0.0, LONGEST_S),
    )


def _reach(reader: ConnectionReader) -> Reach:
    reader.refuse_others(_REACH)
    usual = Reach()
    endless = reader.flag("endless", False)
    if endless and "pan" in reader.values:
        raise reader.error("pan", "an endless camera has no pan stops: remove one of the two")
    return Reach(
        _range(reader, "pan", usual.pan_rad, 2 * math.tau),
        _range(reader, "tilt", usual.tilt_rad, math.pi / 2),
        reader.number("zoom_max", usual.zoom_max, 1.0, 1000.0),
        reader.quantity("rate", usual.rate_rad_s, Dimension.ANGULAR_SPEED, 0.001, 100.0),
        _angles(reader, "view", usual.view_rad, 0.001, _WIDEST_RAD),
        endless,
    )


def _mounting(reader: ConnectionReader) -> Mounting:
    reader.refuse_others(_MOUNTING)
    usual = Mounting()

    def metres(key: str, default: float) -> float:
        return reader.quantity(key, default, Dimension.DISTANCE, -1000.0, 1000.0)

    return Mounting(
        metres("forward", usual.forward_m),
        metres("left", usual.left_m),
        metres("up", usual.up_m),
        reader.quantity("pan", usual.pan_rad, Dimension.ANGLE, -math.tau, math.tau),
    )


def _range(
    reader: ConnectionReader, key: str, usual: tuple[float, float], most: float
) -> tuple[float, float]:
    low, high = _angles(reader, key, usual, -most, most)
    if low >= high:
        raise reader.error(key, "the lowest comes first, such as [-90 deg, 30 deg]")
    return low, high


def _angles(
    reader: ConnectionReader, key: str, usual: tuple[float, float], lowest: float, highest: float
) -> tuple[float, float]:
    value = reader.values.get(key)
    if value is None:
        return usual
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise reader.error(key, f"{value!r} is not two angles, such as [-90 deg, 30 deg]")
    one, other = (reader.quantity_of(key, each, Dimension.ANGLE, lowest, highest) for each in value)
    return one, other
