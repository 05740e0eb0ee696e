"""Behaviors that a fleet declares of its own vehicles and payloads: `own_behaviors`.

It is a map of names in a connection. A name alone is a shared behavior (docs/fleets.md). A new one
lists its parameters:

    own_behaviors:
      area_survey:
      sweep_street:
        doc: Drive along a route with the brush down.
        parameters:
          route: {kind: route, required: true}
          passes: {kind: count, minimum: 1, maximum: 5, default: 1}
          speed: speed
        writes: [sweep.swept]

Bounds and defaults carry units, as everywhere in a fleet.
"""

import math
import re
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

from m2pem.errors import PluginError
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.parameters import DIMENSIONS
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import (
    BehaviorSpec,
    ParameterKind,
    ParameterSpec,
    ResourceId,
    ResumePolicy,
)
from m2pem.suggestions import did_you_mean
from m2pem.units import UnitError, quantity

_BEHAVIOR_KEYS = ("parameters", "required_one_of", "resume", "ends", "writes", "doc")
_PARAMETER_KEYS = ("kind", "required", "minimum", "maximum", "choices", "default", "doc")
_DOTTED = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*")
_PLAIN = frozenset({ParameterKind.NUMBER, ParameterKind.COUNT})


def read_declared_behaviors(
    resource: ResourceId,
    value: Any,
    type_: BehaviorType = BehaviorType.VEHICLE,
    more_keys: Collection[str] = (),
) -> tuple[BehaviorSpec, ...]:
    """Read `own_behaviors`. `value` is what the fleet has there, or None. `type_`: whether the
    behaviors are of vehicles or of payloads. `more_keys`: further keys of a behavior, which the
    arbiter reads itself.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    place = f"{resource}: connection.own_behaviors"
    declared = {} if value is None else _map(place, value, "names of behaviors")
    return tuple(
        _behavior(f"{place}.{name}", name, body, type_, more_keys)
        for name, body in declared.items()
    )


def _behavior(
    place: str, name: str, body: Any, type_: BehaviorType, more_keys: Collection[str]
) -> BehaviorSpec:
    all_ = f"all {type_.value}s"
    shared = SHARED.get((name, type_))
    if shared is not None:
        if body is not None:
            wrong = f"'{name}' is the same for {all_}; write '{name}:' alone, or rename it"
            raise _error(place, wrong)
        return shared
    if body is None:
        known = [known for known, of in SHARED if of is type_]
        new = f"For a new one, list its parameters: {name}: {{parameters: {{speed: speed}}}}"
        hint = f"{did_you_mean(name, known)} {new}".lstrip()
        raise _error(place, f"{all_} share no such behavior; {hint}")
    given = _map(place, body, "parameters and other keys of a behavior")
    _known(place, given, (*_BEHAVIOR_KEYS, *more_keys))
    parameters = _map(
        f"{place}.parameters", given.get("parameters", {}), "names of parameters and their kinds"
    )
    specs = tuple(
        _parameter(f"{place}.parameters.{key}", key, parameters[key]) for key in parameters
    )
    resume = given.get("resume", ResumePolicy.HOLD.value)
    return BehaviorSpec(
        name,
        type_,
        specs,
        _groups(f"{place}.required_one_of", given.get("required_one_of", []), parameters),
        ResumePolicy(_one_of(f"{place}.resume", resume, [each.value for each in ResumePolicy])),
        _flag(f"{place}.ends", given.get("ends", True)),
        _text(f"{place}.doc", given.get("doc", "")),
        _writes(f"{place}.writes", given.get("writes", [])),
    )


def _parameter(place: str, name: str, body: Any) -> ParameterSpec:
    given = (
        {"kind": body} if isinstance(body, str) else _map(place, body, "a kind, or a map with one")
    )
    _known(place, given, _PARAMETER_KEYS)
    kinds = [each.value for each in ParameterKind]
    if "kind" not in given:
        raise _error(f"{place}.kind", f"it is missing: one of {', '.join(kinds)}")
    kind = ParameterKind(_one_of(f"{place}.kind", given["kind"], kinds))
    least = _number(f"{place}.minimum", given.get("minimum"), kind)
    most = _number(f"{place}.maximum", given.get("maximum"), kind)
    if least is not None and most is not None and least > most:
        raise _error(f"{place}.minimum", f"{least:g} is above the maximum, {most:g}")
    spec = ParameterSpec(
        name,
        kind,
        _flag(f"{place}.required", given.get("required", False)),
        least,
        most,
        _choices(f"{place}.choices", given.get("choices", []), kind),
        doc=_text(f"{place}.doc", given.get("doc", "")),
    )
    if "default" not in given:
        return spec
    return replace(spec, default=_default(f"{place}.default", given["default"], spec))


def _default(place: str, value: Any, spec: ParameterSpec) -> float | str | bool:
    if spec.required:
        raise _error(place, "a required parameter is always given; leave one of the two out")
    if spec.kind is ParameterKind.BOOLEAN:
        return _flag(place, value)
    if spec.kind is ParameterKind.TEXT:
        text = _text(place, value)
        return _one_of(place, text, spec.choices) if spec.choices else text
    number = _number(place, value, spec.kind)
    if number is None:
        raise _error(place, "it is empty; leave it out if there is none")
    if spec.minimum is not None and number < spec.minimum:
        raise _error(place, f"{number:g} is below the minimum, {spec.minimum:g}")
    if spec.maximum is not None and number > spec.maximum:
        raise _error(place, f"{number:g} is above the maximum, {spec.maximum:g}")
    return number


def _groups(place: str, value: Any, parameters: Collection[str]) -> tuple[tuple[str, ...], ...]:
    example = "such as [[target], [bearing, elevation]]"
    if not isinstance(value, list) or not all(isinstance(each, list) and each for each in value):
        raise _error(place, f"{value!r} is not a list of lists of parameters, {example}")
    for name in [name for group in value for name in group]:
        _one_of(place, name, list(parameters))
    return tuple(tuple(group) for group in value)


def _writes(place: str, value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
        raise _error(place, f"{value!r} is not a list of names, such as [sweep.swept]")
    for name in value:
        if not _DOTTED.fullmatch(name):
            raise _error(place, f"'{name}' is not a name of the data store such as sweep.swept")
    return tuple(value)


def _choices(place: str, value: Any, kind: ParameterKind) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
        raise _error(place, f"{value!r} is not a list of texts")
    if value and kind is not ParameterKind.TEXT:
        raise _error(place, f"only a text has choices, not {_article(kind)}")
    return tuple(value)


def _number(place: str, value: Any, kind: ParameterKind) -> float | None:
    if value is None:
        return None
    if kind in DIMENSIONS:
        try:
            return quantity(value, DIMENSIONS[kind])
        except UnitError as error:
            raise _error(place, str(error)) from None
    if kind not in _PLAIN:
        raise _error(place, f"{_article(kind)} is not a number")
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise _error(place, f"{value!r} is not a number")
    if kind is ParameterKind.COUNT and (value != int(value) or value < 0):
        raise _error(place, f"{value!r} is not a whole number, 0 or more")
    return float(value)


def _map(place: str, value: Any, of_what: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping) or not all(isinstance(key, str) and key for key in value):
        raise _error(place, f"{value!r} is not a map of {of_what}")
    return value


def _flag(place: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise _error(place, f"{value!r} is neither true nor false")
    return value


def _text(place: str, value: Any) -> str:
    if not isinstance(value, str):
        raise _error(place, f"{value!r} is not a text")
    return value


def _known(place: str, given: Mapping[str, Any], keys: Collection[str]) -> None:
    for key in given:
        if key not in keys:
            hint = did_you_mean(str(key), keys) or f"known: {', '.join(keys)}"
            raise _error(f"{place}.{key}", f"there is no such key; {hint}")


def _one_of(place: str, value: Any, known: Collection[str]) -> str:
    if not isinstance(value, str) or value not in known:
        problem = f"{value!r} is none of {', '.join(known)}; {did_you_mean(str(value), known)}"
        raise _error(place, problem.rstrip("; "))
    return value


def _article(kind: ParameterKind) -> str:
    noun = kind.value.replace("_", " ")
    return f"an {noun}" if noun[0] in "aeiou" else f"a {noun}"


def _error(place: str, problem: str) -> PluginError:
    return PluginError(f"{place}: {problem}")
