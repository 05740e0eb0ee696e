"""From a behavior to what each member does: one plan for each shared team behavior."""

from collections.abc import Callable, Mapping
from functools import partial

from m2pem.api.arbiter import BehaviorRequest
from m2pem.teams.areas import escort, observe, survey
from m2pem.teams.columns import march, one_by_one
from m2pem.teams.plan import Leg, Plan, Setting

PLANS: Mapping[str, Callable[[Setting], Plan]] = {
    "formation": partial(march, default_shape="wedge"),
    "road_following_formation": partial(march, default_shape="column"),
    "road_sweep": partial(march, default_shape="line"),
    "bridge_crossing": one_by_one,
    "area_survey": survey,
    "area_observe": observe,
    "escort": escort,
}
"""By the behavior's name. Each raises TeamRefusedError when it cannot be done."""


def alike(request: BehaviorRequest) -> Plan:
    """A behavior of vehicles that several are to do at once: each does it."""
    return Plan(
        tuple(Leg(each, request.behavior, request.parameters) for each in request.resources)
    )
