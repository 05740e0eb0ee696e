"""Reads a behavior's parameters: units to SI, names to geometries, everything checked.

The check does it with what is written in the mission, the executive with what the data store holds
when the task starts.
"""

import json
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from m2pem.errors import M2pemError
from m2pem.fleet.behaviors import ALTITUDE_FRAME, takes_altitude
from m2pem.geo.geojson import GeometryError, coordinate, kind_of, parse_geojson
from m2pem.geo.local_frame import Origin
from m2pem.geo.positions import NO_ORIGIN, is_local, local_point, out_of_reach
from m2pem.mission.behavior import Behavior
from m2pem.mission.catalogue import BehaviorSpec, ParameterKind, ParameterSpec
from m2pem.mission.geometry import Geometry, Point, VehiclePosition
from m2pem.mission.values import Value
from m2pem.suggestions import did_you_mean, suggest
from m2pem.units import UNITS, Dimension, UnitError, article, plain_number, quantity

if TYPE_CHECKING:
    from m2pem.fleet.fleet import Fleet

ResolvedValue: TypeAlias = float | int | bool | str | Geometry | None
"""A parameter's value after units and names are resolved: SI numbers, texts, geometries."""

FindGeometry: TypeAlias = Callable[[str], Geometry | None]
"""The geometry of a name: what an operator handed over, else the fleet's; None if there is none."""

Offset: TypeAlias = tuple[float, float]
"""Metres behind the lead, and to its left; less than 0: ahead of it, and to its right."""

_OFFSETS_REMEDY = "write [[behind, left], ...] in metres, one for each member after the lead"

DIMENSIONS = {
    ParameterKind.DURATION: Dimension.DURATION,
    ParameterKind.DISTANCE: Dimension.DISTANCE,
    ParameterKind.ALTITUDE: Dimension.DISTANCE,
    ParameterKind.SPEED: Dimension.SPEED,
    ParameterKind.ANGLE: Dimension.ANGLE,
    ParameterKind.ANGULAR_SPEED: Dimension.ANGULAR_SPEED,
}


@dataclass(frozen=True, slots=True)
class ParameterProblem:
    """What is wrong with one parameter ("" when several are missing together).

    `rule`: "unknown-parameter", "missing-parameter", "bad-value", "out-of-bounds",
    "wrong-geometry", "unknown-vehicle" or "unknown-geometry"; an operator may still hand the
    geometry of the last one over before the task starts.
    """

    name: str
    rule: str
    message: str
    remedy: str = ""

    def __str__(self) -> str:
        return f"{self.message}; {self.remedy}" if self.remedy else self.message


class ParameterError(M2pemError):
    """Parameters cannot be used; `problems` lists everything that is wrong with them."""

    exit_status = 2

    def __init__(self, behavior: str, problems: Collection[ParameterProblem]) -> None:
        self.problems = tuple(problems)
        super().__init__(f"{behavior}: {' / '.join(str(problem) for problem in problems)}")


def accepted(spec: BehaviorSpec) -> Mapping[str, ParameterSpec]:
    """The parameters that a behavior takes; `altitude_frame` wherever there is an altitude."""
    if takes_altitude(spec.parameters):
        return {ALTITUDE_FRAME.name: ALTITUDE_FRAME, **spec.by_name}
    return spec.by_name


def resolve(
    spec: BehaviorSpec,
    raw: Mapping[str, Value],
    geometry: FindGeometry,
    vehicles: Collection[str],
    origin: Origin | None = None,
) -> dict[str, ResolvedValue]:
    """The values that an arbiter gets: SI numbers, geometries for names, defaults filled in.

    A null counts as not given. A position is the name of a point or vehicle, `[latitude,
    longitude, altitude]` as a list or as text, or the text `enu [east, north, up]`: metres in the
    ENU frame (REP-103) at `origin`, the fleet's. In place of the name of a geometry there may be
    GeoJSON, as an object or as text.

    Raises:
        ParameterError: with all problems.
    """
    values, problems = examine(spec, raw, geometry, vehicles, origin=origin)
    if problems:
        raise ParameterError(spec.name, problems)
    return values


def examine(
    spec: BehaviorSpec,
    raw: Mapping[str, Value],
    geometry: FindGeometry,
    vehicles: Collection[str],
    deferred: Collection[str] = (),
    origin: Origin | None = None,
) -> tuple[dict[str, ResolvedValue], list[ParameterProblem]]:
    """As `resolve`, but the problems are returned beside the values that are right.

    `deferred`: parameters that are given by an expression, whose values are not known yet.
    """
    specs = accepted(spec)
    names = {name for name, value in raw.items() if value is not None} | set(deferred)
    problems = [_unknown(name, spec, specs) for name in (*raw, *deferred) if name not in specs]
    problems += _missing(spec, names)
    reader = _Reader(geometry, vehicles, raw.get(ALTITUDE_FRAME.name), origin)
    values: dict[str, ResolvedValue] = {}
    for name, parameter in specs.items():
        if name in names and name not in deferred:
            try:
                values[name] = reader.read(parameter, raw[name])
            except _ProblemError as problem:
                message = f"parameter '{name}': {problem.message}"
                problems.append(ParameterProblem(name, problem.rule, message, problem.remedy))
        elif name not in names and parameter.default is not None:
            values[name] = parameter.default
    return values, problems


def examine_behavior(
    behavior: Behavior, spec: BehaviorSpec, geometry: FindGeometry, fleet: "Fleet"
) -> tuple[dict[str, ResolvedValue], list[ParameterProblem]]:
    """As `examine`, of the parameters of a task's behavior as the mission's file gives them."""
    literal = {p.name: p.value for p in behavior.parameters if isinstance(p.value, str)}
    deferred = [p.name for p in behavior.parameters if p.name not in literal]
    return examine(spec, literal, geometry, fleet.vehicles, deferred, fleet.origin)


def _unknown(name: str, spec: BehaviorSpec, specs: Mapping[str, ParameterSpec]) -> ParameterProblem:
    message = f"{spec.name} has no parameter '{name}'"
    return ParameterProblem(name, "unknown-parameter", message, suggest(name, specs, "parameters"))


def _missing(spec: BehaviorSpec, names: Collection[str]) -> list[ParameterProblem]:
    problems = [
        ParameterProblem(p.name, "missing-parameter", f"{spec.name} needs the parameter '{p.name}'")
        for p in spec.parameters
        if p.required and p.name not in names
    ]
    groups = spec.required_one_of
    if groups and not any(all(name in names for name in group) for group in groups):
        choices = ", or ".join(" and ".join(f"'{name}'" for name in group) for group in groups)
        problems.append(ParameterProblem("", "missing-parameter", f"{spec.name} needs {choices}"))
    return problems


class _ProblemError(Exception):
    def __init__(self, rule: str, message: str, remedy: str = "") -> None:
        self.rule = rule
        self.message = message
        self.remedy = remedy
        super().__init__(message)


@dataclass(frozen=True, slots=True)
class _Reader:
    """Reads one value after another; `frame` is the behavior's `altitude_frame` as given."""

    geometry: FindGeometry
    vehicles: Collection[str]
    frame: Value
    origin: Origin | None

    def read(self, spec: ParameterSpec, value: Value) -> ResolvedValue:
        match spec.kind:
            case ParameterKind.ROUTE | ParameterKind.AREA:
                return self._named(spec.kind.value, value)
            case ParameterKind.POSITION:
                return self._position(value)
            case ParameterKind.VEHICLE:
                return self._vehicle(value)
            case ParameterKind.TEXT:
                return _text(spec, value)
            case ParameterKind.OFFSETS:
                return _offsets(value)
            case ParameterKind.BOOLEAN:
                return _boolean(value)
            case _:
                return _bounded(spec, _number(spec.kind, value))

    def _named(self, kind: str, value: Value) -> Geometry:
        if isinstance(value, str) and value.lstrip().startswith("{"):
            value = _json(value, "no GeoJSON object", 'write {"type": "Point", "coordinates": ...}')
        if isinstance(value, dict):
            return self._inline(kind, value)
        if not isinstance(value, str):
            raise _ProblemError("bad-value", f"{value!r} is not the name of {article(kind)}")
        found = self.geometry(value)
        if found is None:
            raise _ProblemError("unknown-geometry", f"there is no {kind} named '{value}'")
        if kind_of(found) != kind:
            message = f"'{value}' is {article(kind_of(found))}, not {article(kind)}"
            raise _ProblemError("wrong-geometry", message)
        return found

    def _inline(self, kind: str, value: Mapping[str, Value]) -> Geometry:
        """Read GeoJSON, as what is left of a behavior is given to another vehicle."""
        try:
            found = parse_geojson(value)
        except GeometryError as error:
            raise _ProblemError("bad-value", f"GeoJSON: {error}") from None
        if kind_of(found) != kind:
            message = f"the GeoJSON is {article(kind_of(found))}, not {article(kind)}"
            raise _ProblemError("wrong-geometry", message)
        return found

    def _position(self, value: Value) -> Geometry:
        if isinstance(value, str) and is_local(value):
            return self._local(value)
        if isinstance(value, str) and value.lstrip().startswith("["):
            value = _json(value, "not a position", "write [latitude, longitude, altitude]")
        if isinstance(value, list):
            return self._coordinates(value)
        if isinstance(value, str) and value in self.vehicles and self.geometry(value) is None:
            return VehiclePosition(value)
        try:
            return self._named("point", value)
        except _ProblemError as problem:
            if problem.rule != "unknown-geometry":
                raise
            message = f"there is no point or vehicle named {value!r}"
            hint = did_you_mean(str(value), self.vehicles)
            raise _ProblemError("unknown-geometry", message, hint) from None

    def _local(self, value: str) -> Point:
        if self.origin is None or self.origin == NO_ORIGIN:
            message = f"{value!r} counts from the origin of the fleet, which has none"
            raise _ProblemError("bad-value", message, "give the fleet an `origin`")
        try:
            return local_point(value, self.origin)
        except GeometryError as error:
            raise _ProblemError("bad-value", str(error), "write enu [east, north, up]") from None

    def _coordinates(self, value: list[Value]) -> Point:
        if not 2 <= len(value) <= 3:
            message = f"{value!r} is not a position"
            raise _ProblemError("bad-value", message, "write [latitude, longitude, altitude]")
        frame = self.frame if isinstance(self.frame, str) else "relative"
        altitude = value[2] if len(value) == 3 else None
        try:
            place = coordinate(value[0], value[1], altitude, "position")
        except GeometryError as error:
            raise _ProblemError("bad-value", str(error)) from None
        origin = self.origin or NO_ORIGIN
        if origin != NO_ORIGIN and (wrong := out_of_reach(place, origin)):
            raise _ProblemError("out-of-reach", *wrong)
        return Point(place, frame)

    def _vehicle(self, value: Value) -> VehiclePosition:
        if isinstance(value, str) and value in self.vehicles:
            return VehiclePosition(value)
        hint = suggest(str(value), self.vehicles, "vehicles")
        raise _ProblemError("unknown-vehicle", f"no vehicle is named {value!r}", hint)


def _json(text: str, what: str, remedy: str) -> Value:
    try:
        read: Value = json.loads(text)
    except (ValueError, RecursionError):
        raise _ProblemError("bad-value", f"{text!r} is {what}", remedy) from None
    return read


def _text(spec: ParameterSpec, value: Value) -> str:
    if not isinstance(value, str):
        raise _ProblemError("bad-value", f"{value!r} is not a text")
    if spec.choices and value not in spec.choices:
        message = f"{value!r} is not one of {', '.join(spec.choices)}"
        raise _ProblemError("bad-value", message, did_you_mean(value, spec.choices))
    return value


def _offsets(value: Value) -> str:
    try:
        return json.dumps(read_offsets(value))
    except ValueError as error:
        raise _ProblemError("bad-value", str(error), _OFFSETS_REMEDY) from None


def _boolean(value: Value) -> bool:
    if isinstance(value, bool):
        return value
    if value in ("true", "false"):
        return value == "true"
    raise _ProblemError("bad-value", f"{value!r} is neither true nor false")


def _number(kind: ParameterKind, value: Value) -> float | int:
    try:
        if kind in DIMENSIONS:
            return quantity(value, DIMENSIONS[kind])
        number = plain_number(value)
    except UnitError as error:
        raise _ProblemError("bad-value", str(error)) from None
    if kind is ParameterKind.COUNT:
        if number != int(number) or number < 0:
            raise _ProblemError("bad-value", f"{value!r} is not a whole number, 0 or more")
        return int(number)
    return number


def _bounded(spec: ParameterSpec, number: float | int) -> float | int:
    dimension = DIMENSIONS.get(spec.kind)
    unit = f" {next(iter(UNITS[dimension]))}" if dimension else ""
    if spec.minimum is not None and number < spec.minimum:
        message = f"{number:g}{unit} is below {spec.minimum:g}{unit}"
        raise _ProblemError("out-of-bounds", message)
    if spec.maximum is not None and number > spec.maximum:
        message = f"{number:g}{unit} is above {spec.maximum:g}{unit}"
        raise _ProblemError("out-of-bounds", message)
    return number


def read_offsets(value: Value) -> tuple[Offset, ...]:
    """The offsets of the members after the lead, from a list or its text.

    Raises:
        ValueError: it is no list of pairs of numbers, or two members would be in one place.
    """
    if isinstance(value, str):
        try:
            value = json.loads(value)
        except (ValueError, RecursionError):
            raise ValueError(f"{value!r} is no list of offsets") from None
    if not isinstance(value, list) or not value:
        raise ValueError(f"{value!r} is no list of offsets")
    found: list[Offset] = [(0.0, 0.0)]
    for pair in value:
        if not isinstance(pair, list) or len(pair) != 2 or not all(map(_is_number, pair)):
            raise ValueError(f"{pair!r} is no offset")
        place = float(pair[0]), float(pair[1])  # type: ignore[arg-type]  # numbers, as was seen
        if place in found:
            raise ValueError(f"two members would be at {pair!r}")
        found.append(place)
    return tuple(found[1:])


def _is_number(value: Value) -> bool:
    plain = isinstance(value, int | float) and not isinstance(value, bool)
    return plain and math.isfinite(float(value))  # type: ignore[arg-type]  # it is a number
