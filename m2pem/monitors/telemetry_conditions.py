"""What telemetry says of the conditions in requirements: `distance(a, b) < 5 m`."""

import math
import operator
from collections.abc import Callable, Iterable, Mapping

from m2pem.api.telemetry import LinkState, VehicleState
from m2pem.engine.inputs import MonitoredRequirement
from m2pem.geo.local_frame import distance_m
from m2pem.verify.ltl import parse
from m2pem.verify.ltl.formula import Measured

Latest = Callable[[str], VehicleState | None]
"""The newest state of a vehicle; None: there is none."""

_COMPARE: Mapping[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}


def known(requirements: Iterable[MonitoredRequirement], latest: Latest) -> dict[str, bool]:
    """Return what telemetry says now of the conditions of requirements, by their texts, as far as
    it says anything."""
    found = {}
    for text in dict.fromkeys(each for one in requirements for each in one.conditions):
        condition = parse(text)
        assert isinstance(condition, Measured)
        now = holds(condition, latest)
        if now is not None:
            found[text] = now
    return found


def holds(condition: Measured, latest: Latest) -> bool | None:
    """Return whether a condition holds; None: telemetry does not say it.

    What a vehicle said before its link was lost counts no more.
    """
    states = [latest(each) for each in condition.resources]
    if condition.quantity == "link":
        state = states[0]
        if state is None:
            return None
        return (state.link.value == condition.value) == (condition.operator == "==")
    if any(each is None or each.link is LinkState.LOST for each in states):
        return None
    value = _value(condition.quantity, [each for each in states if each is not None])
    if value is None or math.isnan(value) or isinstance(condition.value, str):
        return None
    return _COMPARE[condition.operator](value, condition.value)


def _value(quantity: str, states: list[VehicleState]) -> float | None:
    state = states[0]
    match quantity:
        case "distance":
            return _distance_m(state, states[1])
        case "altitude":
            return state.altitude_above_home_m
        case "speed":
            velocity = state.velocity_enu_m_s
            return math.hypot(*velocity) if velocity is not None else None
        case _:
            return state.battery_fraction


def _distance_m(one: VehicleState, two: VehicleState) -> float | None:
    """The straight distance, in metres."""
    if one.position is None or two.position is None:
        return None
    ground_m = distance_m(one.position.latlon, two.position.latlon)
    return math.hypot(ground_m, one.position.altitude_m - two.position.altitude_m)
