"""What a fleet says of a vehicle's software in the loop, in `connection.sitl` (docs/mavlink.md)."""

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from m2pem.api import Dimension, ResourceId, UnitError, quantity
from m2pem.errors import PluginError
from m2pem_plugin_mavlink.vehicle.identity import Firmware

_KEYS = ("firmware", "frame", "home", "heading", "parameters")
_FIRMWARES = {each.lower(): each for each in Firmware}


@dataclass(frozen=True, slots=True)
class SitlSettings:
    """`frame`: ArduPilot's frame or PX4's model; "" is the usual one of the domain.

    `home`: latitude and longitude in WGS-84 degrees, and metres above mean sea level, NaN where the
    fleet does not say; None: the vehicle has a place in the row at the fleet's origin.
    `heading_deg`: from true north, clockwise. `parameters`: of the autopilot, by name.
    """

    firmware: Firmware = Firmware.ARDUPILOT
    frame: str = ""
    home: tuple[float, float, float] | None = None
    heading_deg: float = 0.0
    parameters: Mapping[str, float] = field(default_factory=dict)


def read_sitl_settings(resource: ResourceId, value: Any) -> SitlSettings:
    """The settings in the map `connection.sitl`.

    Raises:
        PluginError: one of them is wrong; the text names the resource and the key.
    """
    if not isinstance(value, Mapping):
        raise _error(resource, "", f"{value!r} is not a map such as {{frame: quad}}")
    for key in value:
        if key not in _KEYS:
            near = difflib.get_close_matches(str(key), _KEYS, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"known: {', '.join(_KEYS)}"
            raise _error(resource, f".{key}", f"there is no such setting; {hint}")
    firmware = _FIRMWARES.get(str(value.get("firmware", Firmware.ARDUPILOT)).lower())
    if firmware is None:
        known = ", ".join(_FIRMWARES)
        raise _error(resource, ".firmware", f"{value['firmware']!r} is none of {known}")
    frame = value.get("frame", "")
    if not isinstance(frame, str):
        raise _error(resource, ".frame", f"{frame!r} is not a name such as quad")
    return SitlSettings(
        firmware,
        frame,
        _home(resource, value.get("home")),
        _heading_deg(resource, value.get("heading", "0 deg")),
        _parameters(resource, value.get("parameters", {})),
    )


def _home(resource: ResourceId, value: Any) -> tuple[float, float, float] | None:
    if value is None:
        return None
    if not isinstance(value, list) or len(value) not in (2, 3) or not all(map(_number, value)):
        raise _error(
            resource, ".home", f"{value!r} is not [latitude, longitude] or [.., .., altitude]"
        )
    latitude, longitude, altitude = (*map(float, value), math.nan)[:3]
    if abs(latitude) > 90.0 or abs(longitude) > 180.0:
        raise _error(resource, ".home", f"{value!r} is not [latitude, longitude] in degrees")
    return latitude, longitude, altitude


def _heading_deg(resource: ResourceId, value: Any) -> float:
    try:
        return math.degrees(quantity(value, Dimension.ANGLE)) % 360.0
    except UnitError as error:
        raise _error(resource, ".heading", str(error)) from None


def _parameters(resource: ResourceId, value: Any) -> dict[str, float]:
    if not isinstance(value, Mapping) or not all(map(_number, value.values())):
        raise _error(
            resource, ".parameters", "names of parameters and numbers, such as {BATT_FS_LOW_ACT: 2}"
        )
    return {str(name): float(number) for name, number in value.items()}


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _error(resource: ResourceId, key: str, problem: str) -> PluginError:
    return PluginError(f"{resource}: connection.sitl{key}: {problem}")
