"""The parameters of a behavior, as every arbiter reads them.

They are resolved (`m2pem.fleet.parameters`): SI numbers, texts and geometries. `refusal` checks
them against an arbiter's catalogue; an arbiter checks them in every request.
"""

import math
from collections.abc import Mapping
from typing import Any

from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.parameters import ResolvedValue
from m2pem.mission.catalogue import BehaviorSpec, ParameterKind, ParameterSpec
from m2pem.mission.geometry import Area, Point, Route, VehiclePosition
from m2pem.suggestions import suggest

ALTITUDE_FRAME = "altitude_frame"

_GEOMETRIES: Mapping[ParameterKind, tuple[type, ...]] = {
    ParameterKind.ROUTE: (Route,),
    ParameterKind.AREA: (Area,),
    ParameterKind.POSITION: (Point, VehiclePosition),
    ParameterKind.VEHICLE: (VehiclePosition,),
}


_DEFAULTS = {
    parameter.name: parameter.default
    for spec in SHARED.values()
    for parameter in spec.parameters
    if isinstance(parameter.default, int | float)
}
"""Of the shared catalogue, in which no two behaviors have another default for the same name."""


class BehaviorParameters:
    """The parameters of one behavior, by the names of the shared catalogue (docs/fleets.md).

    The name of an accessor says its unit. Where a parameter is not given it returns the default of
    the shared catalogue, else None. An arbiter that needs them in a frame of its own derives a
    class from this one.
    """

    def __init__(self, values: Mapping[str, ResolvedValue]) -> None:
        self._values = dict(values)

    def update(self, values: Mapping[str, ResolvedValue]) -> None:
        """Take these in place of those of the same names (`AdjustingArbiter.adjust`)."""
        self._values.update(values)

    def __contains__(self, name: str) -> bool:
        return self._values.get(name) is not None

    def only(self, *names: str) -> dict[str, ResolvedValue]:
        """Return those of these names that are given, to pass them on."""
        return {name: self._values[name] for name in names if name in self}

    @property
    def given(self) -> Mapping[str, ResolvedValue]:
        """All that are given."""
        return {name: value for name, value in self._values.items() if value is not None}

    def number(self, name: str) -> float | None:
        """Return a number in SI; None if it is not given."""
        value = self._values.get(name)
        if isinstance(value, bool) or not isinstance(value, int | float):
            return None
        return float(value)

    def flag(self, name: str) -> bool:
        """Return whether a parameter is true."""
        return self._values.get(name) is True

    def text(self, name: str) -> str:
        """Return a text; "" if it is not given."""
        value = self._values.get(name)
        return value if isinstance(value, str) else ""

    # --- where ----------------------------------------------------------------------------------

    @property
    def route(self) -> Route | None:
        value = self._values.get("route")
        return value if isinstance(value, Route) else None

    @property
    def area(self) -> Area | None:
        value = self._values.get("area")
        return value if isinstance(value, Area) else None

    @property
    def target(self) -> Point | VehiclePosition | None:
        value = self._values.get("target")
        return value if isinstance(value, Point | VehiclePosition) else None

    @property
    def target_vehicle(self) -> str | None:
        """The vehicle that `target` names, if it names one."""
        target = self.target
        return target.vehicle if isinstance(target, VehiclePosition) else None

    @property
    def altitude_m(self) -> float | None:
        """The altitude in metres in the frame `altitude_frame`."""
        return self.number("altitude")

    @property
    def altitude_frame(self) -> str:
        """The zero of `altitude_m`: "relative" (home), "amsl" or "terrain"."""
        return self.text("altitude_frame") or "relative"

    @property
    def heading_rad(self) -> float | None:
        """The heading from true north, clockwise."""
        return self.number("heading")

    @property
    def yaw_rad(self) -> float | None:
        """The heading as yaw: from east, counter-clockwise (REP-103)."""
        heading_rad = self.heading_rad
        return None if heading_rad is None else math.pi / 2 - heading_rad

    @property
    def bearing_rad(self) -> float | None:
        """Clockwise from the heading of the vehicle or of the target."""
        return self.number("bearing")

    @property
    def elevation_rad(self) -> float | None:
        """The elevation above the horizon."""
        return self.number("elevation")

    @property
    def tolerance_m(self) -> float | None:
        return self.number("tolerance")

    @property
    def radius_m(self) -> float | None:
        return self.number("radius")

    @property
    def offset_m(self) -> float | None:
        """From the target that is followed."""
        return self.number("offset")

    @property
    def distance_m(self) -> float:
        """The distance to move backwards."""
        return self._number_or_default("distance")

    @property
    def spacing_m(self) -> float | None:
        """Between the tracks of a survey, or the members of a formation."""
        return self.number("spacing")

    @property
    def overshoot_m(self) -> float:
        """The distance by which the tracks of a survey extend beyond its area."""
        return self.number("overshoot") or 0.0

    # --- how fast, how long, how often ----------------------------------------------------------

    @property
    def speed_m_s(self) -> float | None:
        """The speed over ground."""
        return self.number("speed")

    @property
    def turn_rate_rad_s(self) -> float | None:
        """The `speed` of a camera's turning."""
        return self.number("speed")

    @property
    def duration_s(self) -> float | None:
        return self.number("duration")

    @property
    def timeout_s(self) -> float | None:
        return self.number("timeout")

    @property
    def turns(self) -> float | None:
        """The number of turns around the target."""
        return self.number("turns")

    @property
    def zoom(self) -> float:
        """The magnification: 1 is the widest view."""
        return self._number_or_default("level")

    @property
    def count(self) -> int:
        """The number of pictures."""
        return int(self._number_or_default("count"))

    @property
    def interval_s(self) -> float:
        """The time between two pictures."""
        return self._number_or_default("interval")

    @property
    def loop(self) -> bool:
        """Whether a route begins again at its end."""
        return self.flag("loop")

    def _number_or_default(self, name: str) -> float:
        value = self.number(name)
        return float(_DEFAULTS[name]) if value is None else value


def refusal(spec: BehaviorSpec, parameters: Mapping[str, ResolvedValue]) -> str:
    """Why the behavior cannot be done with these, naming every bad parameter; "" if it can."""
    problems = []
    given = {name: value for name, value in parameters.items() if value is not None}
    for name, value in given.items():
        if name in spec.by_name:
            problem = _problem(spec.by_name[name], value)
            if problem:
                problems.append(f"parameter '{name}': {problem}")
        elif name != ALTITUDE_FRAME:
            known = suggest(name, spec.by_name, "parameters")
            problems.append(f"{spec.name} has no parameter '{name}'; {known}")
    problems += [
        f"{spec.name} needs the parameter '{parameter.name}'"
        for parameter in spec.parameters
        if parameter.required and parameter.name not in given
    ]
    groups = spec.required_one_of
    if groups and not any(all(name in given for name in group) for group in groups):
        choices = ", or ".join(" and ".join(f"'{name}'" for name in group) for group in groups)
        problems.append(f"{spec.name} needs {choices}")
    return " / ".join(problems)


def _problem(spec: ParameterSpec, value: ResolvedValue) -> str:
    if spec.kind in _GEOMETRIES:
        if isinstance(value, _GEOMETRIES[spec.kind]):
            return ""
        return f"{value!r} is not the {spec.kind.value} that is expected"
    if spec.kind is ParameterKind.BOOLEAN:
        return "" if isinstance(value, bool) else f"{value!r} is neither true nor false"
    if spec.kind in (ParameterKind.TEXT, ParameterKind.OFFSETS):
        if not isinstance(value, str):
            return f"{value!r} is not a text"
        if spec.choices and value not in spec.choices:
            return f"{value!r} is not one of {', '.join(spec.choices)}"
        return ""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return f"{value!r} is not a finite number"
    if spec.minimum is not None and value < spec.minimum:
        return f"{value:g} is below {spec.minimum:g}"
    if spec.maximum is not None and value > spec.maximum:
        return f"{value:g} is above {spec.maximum:g}"
    if spec.kind is ParameterKind.COUNT and value != int(value):
        return f"{value:g} is not a whole number"
    return ""


def encode_parameters(
    parameters: Mapping[str, ResolvedValue], longest_route: int = 0
) -> dict[str, Any]:
    """Return parameters as JSON values, for the `native_ref` that finds a behavior after a restart.

    Areas are left out, and routes of more than `longest_route` waypoints: every report carries the
    text.
    """
    encoded: dict[str, Any] = {}
    for name, value in parameters.items():
        match value:
            case Point():
                encoded[name] = {"point": list(value.position), "frame": value.altitude_frame}
            case Route() if len(value.waypoints) <= longest_route:
                route = [list(each) for each in value.waypoints]
                encoded[name] = {"route": route, "frame": value.altitude_frame}
                if value.speeds_m_s:
                    encoded[name]["speeds"] = list(value.speeds_m_s)
                if value.altitude_frames:
                    encoded[name]["frames"] = list(value.altitude_frames)
            case VehiclePosition():
                encoded[name] = {"vehicle": value.vehicle}
            case bool() | int() | float() | str():
                encoded[name] = value
    return encoded


def decode_parameters(encoded: Mapping[str, Any]) -> dict[str, ResolvedValue]:
    """Return what `encode_parameters` encoded.

    Raises:
        ValueError, TypeError, KeyError, AttributeError: it has not encoded this.
    """
    return {str(name): _decoded(value) for name, value in encoded.items()}


def _decoded(value: Any) -> ResolvedValue:
    if not isinstance(value, dict):
        return value  # type: ignore[no-any-return]  # a number or text of JSON
    if "vehicle" in value:
        return VehiclePosition(str(value["vehicle"]))
    if "route" in value:
        speeds = tuple(None if each is None else float(each) for each in value.get("speeds", ()))
        frames = tuple(map(str, value.get("frames", ())))
        return Route(tuple(map(_coordinate, value["route"])), str(value["frame"]), speeds, frames)
    return Point(_coordinate(value["point"]), str(value["frame"]))


def _coordinate(value: Any) -> tuple[float, float, float | None]:
    latitude, longitude, altitude = value
    return float(latitude), float(longitude), None if altitude is None else float(altitude)
