"""The behaviors that a MAVLink vehicle offers, by its domain; needs no MAVLink library."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

from m2pem.api import FLOWN, SHARED, BehaviorSpec, BehaviorType, ParameterKind, ParameterSpec

_EVERYWHERE = (FLOWN - {"change_altitude"}) | {
    *("hold", "drive_stop", "return_to_launch", "set_speed", "deploy"),
}
_BY_DOMAIN: Mapping[str, frozenset[str]] = {
    "ground": _EVERYWHERE | {"reverse", "teleop"},
    "air": _EVERYWHERE | {"takeoff", "land", "change_altitude"},
    "surface": _EVERYWHERE | {"reverse", "teleop"},
    "subsurface": _EVERYWHERE | {"change_altitude"},
}

_BOUNDS: Mapping[ParameterKind, tuple[float | None, float | None]] = {
    ParameterKind.SPEED: (0.1, 100.0),
    ParameterKind.ALTITUDE: (-11_000.0, 20_000.0),
}
"""Bounds that every autopilot accepts; the vehicle itself refuses what it cannot do."""

ORBIT_TURNS = 1000.0

RUN_ONBOARD_MISSION = BehaviorSpec(
    "run_onboard_mission",
    BehaviorType.VEHICLE,
    (
        ParameterSpec(
            "first",
            ParameterKind.COUNT,
            minimum=0,
            maximum=65_000,
            doc="The item to begin with; 0, the default, is the first one after home.",
        ),
    ),
    doc="Carry out the mission that the vehicle has stored.",
)


@cache
def offered(domain: str) -> tuple[BehaviorSpec, ...]:
    """Return the behaviors of a domain; they are the same over MAVSDK."""
    names = _BY_DOMAIN.get(domain, _BY_DOMAIN["ground"])
    shared = (
        _bounded(spec)
        for (name, type_), spec in SHARED.items()
        if type_ is BehaviorType.VEHICLE and name in names
    )
    return (*shared, RUN_ONBOARD_MISSION)


def _bounded(spec: BehaviorSpec) -> BehaviorSpec:
    bounded = tuple(_bound(parameter) for parameter in spec.parameters)
    return replace(spec, parameters=bounded, keeps_speeds=spec.name == "single_vehicle_routing")


def _bound(spec: ParameterSpec) -> ParameterSpec:
    if spec.name == "turns":
        return replace(spec, maximum=ORBIT_TURNS)
    if spec.kind not in _BOUNDS:
        return spec
    low, high = _BOUNDS[spec.kind]
    return replace(spec, minimum=low, maximum=high)
