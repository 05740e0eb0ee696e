"""The specification of a simulated vehicle, and the settings of `sim: {max_speed: 3 m/s}` and
`--set`."""

import difflib
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from m2pem.api import Dimension, GeoPosition, UnitError, quantity
from m2pem.api.simulator_settings import coordinates, fraction
from m2pem_plugin_ros.frames import Origin, to_local
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import Settings
from m2pem_plugin_ros.simulator.dynamics import Chassis
from m2pem_plugin_ros.simulator.sensors import Capacity, DetectorSpec, Inaccuracy, Target

FORT = GeoPosition(38.1075, -77.3192, 60.0)
"""Where vehicles without a fleet file stand: near the field of the vignettes."""


@dataclass(frozen=True, slots=True)
class VehicleSpec:
    """One simulated vehicle.

    `settings`: the connection as the executive has it, so that both use the same topics. `start`:
    in the local frame. `origin`: of that frame, latitude and longitude in degrees, altitude in
    metres above mean sea level. `battery`: initial charge, 0 to 1.
    """

    name: str
    settings: Settings
    domain: str = "ground"
    start: Pose = field(default_factory=lambda: Pose(0.0, 0.0, 0.0))
    origin: tuple[float, float, float] = (FORT.latitude_deg, FORT.longitude_deg, FORT.altitude_m)
    chassis: Chassis = field(default_factory=Chassis)
    inaccuracy: Inaccuracy = field(default_factory=Inaccuracy)
    capacity: Capacity = field(default_factory=Capacity)
    battery: float = 1.0
    detectors: tuple[DetectorSpec, ...] = ()

    @property
    def hardware_id(self) -> str:
        """Its name in /diagnostics."""
        return self.settings.hardware_id or self.name


REHEARSAL_KEYS = frozenset(
    [
        "cruise_speed",
        "deceleration",
        "climb_rate",
        "endurance",
        "default_altitude",
        "altitude",
        "kind",
        "detections",
        "faults",
        "telemetry_hz",
        "state",
    ]
)
"""Keys of the same map that only `m2pem run --simulate` reads."""

DETECTOR_SETTINGS = ("range", "targets")


class SettingError(ValueError):
    """A setting cannot be used. The text says what is right."""


def apply_settings(words: Mapping[str, Any], spec: VehicleSpec) -> VehicleSpec:
    """Return the vehicle with settings applied.

    Raises:
        WordError: a word is not known, or its value has no sense.
    """
    for key, value in words.items():
        if key in SETTINGS:
            spec = _applied(key, value, spec)
        elif key not in REHEARSAL_KEYS:
            raise _unknown(key, SETTINGS)
    return spec


def detector(words: Mapping[str, Any], spec: DetectorSpec, origin: Origin) -> DetectorSpec:
    """Return the detector with the settings `range` and `targets` applied.

    Raises:
        WordError: a word is not known, or its value has no sense.
    """
    for key in words:
        if key not in DETECTOR_SETTINGS and key not in REHEARSAL_KEYS:
            raise _unknown(key, DETECTOR_SETTINGS)
    try:
        targets = words.get("targets", [])
        if not isinstance(targets, list | tuple):
            raise SettingError("it is no list, such as [{type: gpr, position: [38.1, -77.3]}]")
        found = tuple(_target(each, origin) for each in targets)
    except ValueError as error:
        raise SettingError(f"targets: {error}") from error
    if "range" not in words:
        return replace(spec, targets=found)
    reach_m = _positive(Dimension.DISTANCE)("range", words["range"])
    return replace(spec, range_m=reach_m, targets=found)


def _unknown(key: str, known: Collection[str]) -> SettingError:
    near = difflib.get_close_matches(str(key), known, n=1)
    hint = f"did you mean '{near[0]}'?" if near else f"known: {', '.join(known)}"
    return SettingError(f"{key}: simulated vehicles know no such setting; {hint}")


def position(value: Any, altitude_m: float) -> GeoPosition:
    """Read [lat, lon] or [lat, lon, alt]; without an altitude it is `altitude_m`.

    Raises:
        ValueError: it is something else.
    """
    latitude, longitude, altitude = coordinates(value)
    return GeoPosition(latitude, longitude, altitude_m if altitude is None else altitude)


def _target(item: Any, origin: Origin) -> Target:
    if not isinstance(item, Mapping) or set(item) != {"type", "position"}:
        raise SettingError(f"{item!r} is not {{type: gpr, position: [38.1, -77.3]}}")
    place = position(item["position"], origin[2])
    east_m, north_m, _ = to_local(place, origin)
    return Target(str(item["type"]), east_m, north_m)


Read = Callable[[str, Any], float]


def _fraction(key: str, value: Any) -> float:
    try:
        return fraction(value)
    except ValueError as error:
        raise SettingError(f"{key}: {error}") from error


def _quantity(dimension: Dimension) -> Read:
    def read(key: str, value: Any) -> float:
        try:
            return quantity(value, dimension)
        except UnitError as error:
            raise SettingError(f"{key}: {error}") from error

    return read


def _positive(dimension: Dimension, *, zero: bool = False) -> Read:
    read = _quantity(dimension)

    def positive(key: str, value: Any) -> float:
        number = read(key, value)
        if number < 0 or (number == 0 and not zero):
            raise SettingError(f"{key}: {value!r} is {'below' if zero else 'not above'} 0")
        return number

    return positive


_DISTANCE, _SPEED = _positive(Dimension.DISTANCE), _positive(Dimension.SPEED)
_NO_DISTANCE = _positive(Dimension.DISTANCE, zero=True)
_DURATION, _NO_DURATION = (_positive(Dimension.DURATION, zero=zero) for zero in (False, True))

SETTINGS: Mapping[str, tuple[str, str, Read | None]] = {
    "home": ("", "start", None),
    "heading": ("", "start", _quantity(Dimension.ANGLE)),
    "battery": ("", "battery", _fraction),
    "max_speed": ("chassis", "speed_m_s", _SPEED),
    "max_reverse": ("chassis", "reverse_m_s", _positive(Dimension.SPEED, zero=True)),
    "acceleration": ("chassis", "acceleration_m_s2", _positive(Dimension.ACCELERATION)),
    "turn_rate": ("chassis", "yaw_rate_rad_s", _positive(Dimension.ANGULAR_SPEED)),
    "turn_radius": ("chassis", "turn_radius_m", _NO_DISTANCE),
    "lag": ("chassis", "lag_s", _NO_DURATION),
    "drift": ("inaccuracy", "drift", _fraction),
    "noise": ("inaccuracy", "noise_m", _NO_DISTANCE),
    "battery_range": ("capacity", "range_m", _DISTANCE),
    "battery_life": ("capacity", "standing_s", _DURATION),
}
"""Each setting: the part of the vehicle, its field, and the function that reads it."""


def _applied(key: str, value: Any, spec: VehicleSpec) -> VehicleSpec:
    part, field, read = SETTINGS[key]
    if read is None:
        try:
            place = position(value, spec.origin[2])
        except ValueError as error:
            raise SettingError(f"{key}: {error}") from error
        east_m, north_m, _ = to_local(place, spec.origin)
        return replace(
            spec, start=Pose(east_m, north_m, spec.start.yaw_rad, place.altitude_m - spec.origin[2])
        )
    number = read(key, value)
    if key == "heading":
        return replace(spec, start=replace(spec.start, yaw_rad=math.pi / 2 - number))
    if not part:
        return replace(spec, battery=number)
    return replace(spec, **{part: replace(getattr(spec, part), **{field: number})})
