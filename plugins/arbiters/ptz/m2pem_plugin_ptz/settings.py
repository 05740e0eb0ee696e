"""The settings of a camera in the fleet file (docs/ptz.md), and the reader for those of drivers.

A camera inherits the connection of its vehicle, which may have any arbiter. So an unknown key is no
error, unless it is similar to a key of the camera.
"""

import difflib
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, TypeVar

from m2pem.api import Connection, Dimension, ResourceId, UnitError, quantity
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
    direction of pan 0 from the bow, clockwise, in radians."""

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
_MISSPELT = 0.8
_WIDEST_RAD = math.radians(170.0)


def _read(resource: ResourceId, given: Mapping[str, Any]) -> Settings:
    if "/" not in resource:
        raise PluginError(
            f"{resource}: the arbiter 'ptz' serves payloads; this is a vehicle: "
            "name the arbiter of the camera under the vehicle's `payloads`"
        )
    for key in given:
        near = difflib.get_close_matches(str(key), _KEYS, n=1, cutoff=_MISSPELT)
        if near and key not in _KEYS:
            raise _error(resource, str(key), f"there is no such setting; did you mean '{near[0]}'?")
    names = [str(name) for name in DriverName]
    driver = given.get("driver")
    if driver not in names:
        found = "it is missing" if driver is None else f"{driver!r} is not a driver of cameras"
        raise _error(resource, "driver", f"{found}; write one of {', '.join(names)}")
    pictures = given.get("pictures", "pictures")
    if not isinstance(pictures, str) or not pictures.strip():
        raise _error(resource, "pictures", f"{pictures!r} is not the name of a folder")
    return Settings(
        DriverName(driver),
        _reach(resource, _map(resource, "reach", given.get("reach", {}), _REACH)),
        _mounting(resource, _map(resource, "mounting", given.get("mounting", {}), _MOUNTING)),
        Path(pictures).expanduser(),
        _flag(resource, "stabilized", given.get("stabilized", False)),
        {key: value for key, value in given.items() if key not in _KEYS},
        _quantity(resource, "delay", given.get("delay", 0.0), Dimension.DURATION, 0.0, LONGEST_S),
    )


def _reach(resource: ResourceId, given: Mapping[str, Any]) -> Reach:
    usual = Reach()
    endless = _flag(resource, "reach.endless", given.get("endless", False))
    if endless and "pan" in given:
        raise _error(
            resource, "reach.pan", "an endless camera has no pan stops: remove one of the two"
        )
    turn, right = 2 * math.tau, math.pi / 2
    view = given.get("view", None)
    if view is None:
        view_rad = usual.view_rad
    else:
        width, height = _pair(resource, "reach.view", view)
        view_rad = (
            _quantity(resource, "reach.view", width, Dimension.ANGLE, 0.001, _WIDEST_RAD),
            _quantity(resource, "reach.view", height, Dimension.ANGLE, 0.001, _WIDEST_RAD),
        )
    rate = given.get("rate")
    return Reach(
        _range(resource, "reach.pan", given.get("pan"), usual.pan_rad, turn),
        _range(resource, "reach.tilt", given.get("tilt"), usual.tilt_rad, right),
        _number(resource, "reach.zoom_max", given.get("zoom_max", usual.zoom_max), 1.0, 1000.0),
        usual.rate_rad_s
        if rate is None
        else _quantity(resource, "reach.rate", rate, Dimension.ANGULAR_SPEED, 0.001, 100.0),
        view_rad,
        endless,
    )


def _mounting(resource: ResourceId, given: Mapping[str, Any]) -> Mounting:
    usual = Mounting()

    def metres(key: str, default: float) -> float:
        value = given.get(key, default)
        return _quantity(resource, f"mounting.{key}", value, Dimension.DISTANCE, -1000.0, 1000.0)

    pan = given.get("pan")
    return Mounting(
        metres("forward", usual.forward_m),
        metres("left", usual.left_m),
        metres("up", usual.up_m),
        0.0
        if pan is None
        else _quantity(resource, "mounting.pan", pan, Dimension.ANGLE, -math.tau, math.tau),
    )


def _range(
    resource: ResourceId, key: str, value: Any, usual: tuple[float, float], most: float
) -> tuple[float, float]:
    if value is None:
        return usual
    low, high = (
        _quantity(resource, key, end, Dimension.ANGLE, -most, most)
        for end in _pair(resource, key, value)
    )
    if low >= high:
        raise _error(resource, key, "the lowest comes first, such as [-90 deg, 30 deg]")
    return low, high


def _pair(resource: ResourceId, key: str, value: Any) -> tuple[Any, Any]:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise _error(resource, key, f"{value!r} is not two angles, such as [-90 deg, 30 deg]")
    return value[0], value[1]


def _map(resource: ResourceId, key: str, value: Any, known: Collection[str]) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise _error(resource, key, f"{value!r} is not a map; known in it: {', '.join(known)}")
    for name in value:
        if name not in known:
            near = difflib.get_close_matches(str(name), known, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"known: {', '.join(known)}"
            raise _error(resource, f"{key}.{name}", f"there is no such setting; {hint}")
    return value


def _flag(resource: ResourceId, key: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise _error(resource, key, f"{value!r} is neither true nor false")
    return value


def _quantity(
    resource: ResourceId, key: str, value: Any, dimension: Dimension, low: float, high: float
) -> float:
    try:
        read = quantity(value, dimension)
    except UnitError as error:
        raise _error(resource, key, str(error)) from error
    if not low <= read <= high:
        raise _error(resource, key, f"{value!r} is not within {low:g} and {high:g} (SI)")
    return read


def _number(resource: ResourceId, key: str, value: Any, low: float, high: float) -> float:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not low <= value <= high:
        raise _error(resource, key, f"{value!r} is not a number from {low:g} to {high:g}")
    return float(value)


def _error(resource: ResourceId, key: str, problem: str) -> PluginError:
    return PluginError(f"{resource}: connection.{key}: {problem}")


Choice = TypeVar("Choice", bound=StrEnum)

SIMILAR = 0.8
"""An unknown key this similar to a known one (0 to 1) is an error."""


class OwnSettings:
    """Reads the map at `connection`, or an inner map.

    All methods raise PluginError; the text names the resource and the key.
    """

    def __init__(
        self, resource: ResourceId, values: Mapping[str, Any], path: str = "connection"
    ) -> None:
        self.values = values
        self._resource = resource
        self._path = path

    @classmethod
    def of(cls, connection: Connection) -> "OwnSettings":
        """Return the reader of a camera's connection."""
        return cls(connection.resource, connection.settings)

    def error(self, key: str, problem: str) -> PluginError:
        """Return the error for the value of a key."""
        return PluginError(f"{self._resource}: {self._path}.{key}: {problem}")

    def refuse_slips(self, known: Collection[str]) -> None:
        """Raise an error for unknown keys that are similar to one of these."""
        for key in self.values:
            if key not in known:
                near = difflib.get_close_matches(str(key), known, n=1, cutoff=SIMILAR)
                if near and near[0] not in self.values:
                    raise self.error(
                        str(key), f"there is no such setting; did you mean '{near[0]}'?"
                    )

    def refuse_others(self, known: Sequence[str]) -> None:
        """Raise an error for keys other than these."""
        for key in self.values:
            if key not in known:
                near = difflib.get_close_matches(str(key), known, n=1)
                hint = f"did you mean '{near[0]}'?" if near else f"known: {', '.join(known)}"
                raise self.error(str(key), f"there is no such setting; {hint}")

    def inner(self, key: str, example: str) -> "OwnSettings":
        """Return the reader of an inner map; it is empty if the key is missing."""
        value = self.values.get(key, {})
        if not isinstance(value, Mapping):
            raise self.error(key, f"{value!r} is not a map such as {example}")
        return OwnSettings(self._resource, value, f"{self._path}.{key}")

    def whole(self, key: str, default: int | None, lowest: int, highest: int, what: str) -> int:
        """Return a whole number. Without a default it is required. `what` describes it in
        errors."""
        value = self.values.get(key, default)
        if value is None:
            raise self.error(key, f"it is missing: {what}, {lowest} to {highest}")
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        if not is_whole or not lowest <= value <= highest:
            raise self.error(key, f"{value!r} is not a whole number from {lowest} to {highest}")
        return int(value)

    def flag(self, key: str, default: bool) -> bool:
        value = self.values.get(key, default)
        if not isinstance(value, bool):
            raise self.error(key, f"{value!r} is neither true nor false")
        return value

    def text(self, key: str, default: str) -> str:
        """Return a text that is not empty."""
        value = self.values.get(key, default)
        if key in self.values and (not isinstance(value, str) or not value.strip()):
            raise self.error(key, f"{value!r} is not a text")
        return str(value)

    def choice(self, key: str, choices: type[Choice], default: Choice) -> Choice:
        """Return a member of an enumeration."""
        value = self.values.get(key, default)
        try:
            return choices(value)
        except ValueError:
            raise self.error(key, f"{value!r} is none of {', '.join(choices)}") from None
