"""Says why resources were chosen, for record `ResourcesAllocated`, and why a task has none."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, islice

from m2pem.allocation.needs import ConsideredRole, Occupancy
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.values import Value

MAX_LISTED = 20
"""Candidates of a role that a record lists; it counts the others."""

DIGITS = 3
"""Decimal digits of seconds, metres and charges in a record."""


def what_was_considered(
    roles: Sequence[ConsideredRole],
    chosen: Mapping[str, Sequence[ResourceId]],
    together_with: Sequence[str],
) -> dict[str, Value]:
    """Return what a choice saw, as a value for the journal.

    `roles`: of the task, each with all its candidates. `chosen`: by role. `together_with`: the
    other requests that were decided at the same moment.
    """
    return {
        "roles": {
            each.role.name: _role(each, chosen.get(each.role.name, ()))
            for each in roles
            if each.role.need is not None
        },
        "together_with": list(together_with),
    }


def _role(considered: ConsideredRole, chosen: Sequence[ResourceId]) -> Value:
    ranked = _ranked(considered, chosen)
    return {
        "chosen": list(chosen),
        "candidates": [_candidate(considered, each) for each in ranked],
        "not_listed": max(0, len(considered.resources) - MAX_LISTED),
    }


def _ranked(considered: ConsideredRole, chosen: Sequence[ResourceId]) -> list[ResourceId]:
    """Return what is listed: the chosen ones first, then what was free by its cost, what was held
    by its cost, what was withdrawn, and what was excluded."""
    found, occupied = considered.candidacy, considered.occupied
    ranked = [each for each in found.resources if each in chosen]
    ranked += _cheapest(considered, [each for each in found.free if each not in chosen])
    if len(ranked) < MAX_LISTED:
        ranked += _cheapest(considered, [each for each in found.busy if each not in chosen])
    if len(ranked) < MAX_LISTED:
        withdrawn = (each for each in found.able if each in occupied and occupied[each].withdrawn)
        excluded = (each for each in found.resources if each in found.excluded)
        rest = (each for each in chain(withdrawn, excluded) if each not in chosen)
        ranked += islice(rest, MAX_LISTED)
    return ranked[:MAX_LISTED]


def _cheapest(considered: ConsideredRole, resources: Sequence[ResourceId]) -> Iterable[ResourceId]:
    """Return as many as may be listed, by their cost."""
    index = considered.costs.group.index
    totals_s = considered.costs.parts.total_s[[index[each] for each in resources]]
    return (resources[place] for place in totals_s.argsort(kind="stable")[:MAX_LISTED])


def _candidate(considered: ConsideredRole, resource: ResourceId) -> Value:
    found: dict[str, Value] = {"resource": resource}
    if resource in considered.excluded:
        found["excluded"] = considered.excluded[resource]
        return found
    occupancy = considered.occupied.get(resource)
    if occupancy is not None and occupancy.withdrawn:
        found["excluded"] = f"it is unavailable: {occupancy.withdrawn}"
    elif occupancy is not None:
        found["held_by"] = occupancy.holder
    cost = considered.costs.of(resource)
    return found | {
        "cost_s": round(considered.total_s(resource), DIGITS),
        "travel_s": _rounded(cost.travel_s),
        "distance_m": _rounded(cost.distance_m),
        "battery": _rounded(cost.battery),
        "battery_s": round(cost.battery_s, DIGITS),
        "switching_s": round(cost.switching_s, DIGITS),
        "preference_s": round(cost.preference_s, DIGITS),
    }


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, DIGITS)


def reason(roles: Sequence[ConsideredRole], given: Mapping[ResourceId, Occupancy]) -> str:
    """Say why a task has no resources now, role by role.

    `given`: resources that were given to other requests at the same moment, and to which.
    """
    said = [_why(each, given) for each in roles]
    missing = [text for text in said if text] or [_why_together(roles, given)]
    return "; ".join(missing)


def _why_together(roles: Sequence[ConsideredRole], given: Mapping[ResourceId, Occupancy]) -> str:
    """Say why roles are not filled of which each could be: they share candidates, or a task before
    keeps some."""
    free = {one for each in roles for one in each.options.costs_s if one not in given}
    least = sum(each.options.least for each in roles)
    if len(free) >= least:
        return "what is free is kept for tasks that asked before"
    states = {
        one: _state(each, one, given) for each in roles for one in each.candidacy.able[:MAX_NAMED]
    }
    said = ", ".join(f"{one} {state}" for one, state in states.items())
    return f"the roles together: {len(free)} of {least} free: {said}"


def _why(considered: ConsideredRole, given: Mapping[ResourceId, Occupancy]) -> str:
    options = considered.options
    free = [each for each in options.costs_s if each not in given]
    if len(free) >= options.least:
        return ""
    name = considered.role.name
    if not considered.resources:
        return f"role '{name}': the fleet has nothing that could fill it"
    said = [f"{each} {_state(considered, each, given)}" for each in named(considered, MAX_NAMED)]
    count = f"{len(free)} of {options.least} free: " if options.least > 1 else ""
    others = len(considered.resources) - len(said)
    more = f" and {others} others" if others else ""
    return f"role '{name}': {count}{', '.join(said)}{more}"


MAX_NAMED = 6
"""Candidates that a reason names; it counts the others."""


def named(considered: ConsideredRole, most: int) -> list[ResourceId]:
    """Return the first candidates; what may be free soon says more than what is excluded."""
    found = considered.candidacy
    first = list(found.able[:most])
    if len(first) < most:
        rest = (each for each in found.resources if each in found.excluded)
        first += islice(rest, most - len(first))
    return first


def _state(
    considered: ConsideredRole, resource: ResourceId, given: Mapping[ResourceId, Occupancy]
) -> str:
    if resource in considered.excluded:
        return f"is excluded ({considered.excluded[resource]})"
    held = given.get(resource, Occupancy())
    occupancy = considered.occupied.get(resource, held)
    if occupancy.withdrawn:
        return f"is unavailable ({occupancy.withdrawn})"
    holder = occupancy.label or occupancy.holder
    return f"is held by {holder}" if holder else "is free"


@dataclass(frozen=True, slots=True)
class Lack:
    """What a task lacks, without the values of telemetry, which change all the time. `holders`: who
    has what it could use, by resource. `without`: what cannot fill its roles, or nobody gets."""

    holders: dict[str, str]
    without: tuple[tuple[ResourceId, bool], ...]


def lack(roles: Sequence[ConsideredRole], given: Mapping[ResourceId, Occupancy]) -> Lack:
    """Return what a task lacks, of the first `MAX_LISTED` candidates of each role; `given`: as in
    `reason`."""
    holders: dict[str, str] = {}
    without: list[tuple[ResourceId, bool]] = []
    for role in roles:
        excluded, occupied = role.excluded, role.occupied
        for resource in named(role, MAX_LISTED):
            found = given.get(resource, Occupancy())
            found = occupied.get(resource, found)
            if resource in excluded or found.withdrawn:
                without.append((resource, resource in excluded))
            elif found.holder:
                holders[resource] = found.holder
    return Lack(holders, tuple(without))
