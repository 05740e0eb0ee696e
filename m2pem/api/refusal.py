"""Checks the resolved parameters of a request; whoever sent it, an arbiter trusts none of them."""

import math
from collections.abc import Mapping

from m2pem.api.arbiter import ResolvedValue
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
