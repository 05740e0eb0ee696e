"""The behaviors of cameras that turn. It needs no library and no connection."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

from m2pem.api import SHARED, BehaviorSpec, BehaviorType, ParameterKind, ParameterSpec

_MOST: Mapping[ParameterKind, float] = {
    ParameterKind.ANGULAR_SPEED: 10.0,
    ParameterKind.COUNT: 10_000,
    ParameterKind.DURATION: 1e7,
}
"""Upper bounds of parameters without a bound of their own."""


@cache
def offered() -> tuple[BehaviorSpec, ...]:
    """Return the shared behaviors of payloads. The driver refuses what its camera cannot do."""
    return tuple(
        replace(spec, parameters=tuple(_bounded(parameter) for parameter in spec.parameters))
        for (_, type_), spec in SHARED.items()
        if type_ is BehaviorType.PAYLOAD
    )


def _bounded(spec: ParameterSpec) -> ParameterSpec:
    return replace(spec, maximum=_MOST[spec.kind]) if spec.kind in _MOST else spec
