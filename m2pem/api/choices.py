"""Why resources were chosen for the roles of a task, in words.

`choice_of` reads `considered` of record `ResourcesAllocated` (docs/allocation.md).
"""

from collections.abc import Callable, Mapping

import msgspec

from m2pem.api import records as r

NOT_MET = "requires is false: "
"""Begins why a candidate is excluded by the role's condition."""

MAX_NAMED = 3
"""Candidates that were not chosen which a sentence names; it counts the others."""

LEAST_S = 0.05
"""Costs that differ by less are the same for people, in seconds."""


class Candidate(msgspec.Struct, frozen=True):
    """A candidate for a role. Costs are in seconds of travel time; None: not known.

    `excluded`: why it cannot fill the role. `held_by`: the behavior, request or operator that has
    it. Both "": it was free.
    """

    resource: str
    excluded: str = ""
    held_by: str = ""
    cost_s: float | None = None
    travel_s: float | None = None
    distance_m: float | None = None
    battery: float | None = None
    battery_s: float = 0.0
    switching_s: float = 0.0
    preference_s: float = 0.0


class RoleChoice(msgspec.Struct, frozen=True):
    """What was chosen for a role, and all its candidates: the chosen ones first, then the others
    from the best to the excluded ones. `not_listed`: how many more there were."""

    chosen: tuple[str, ...]
    candidates: tuple[Candidate, ...]
    not_listed: int = 0

    @property
    def others(self) -> tuple[Candidate, ...]:
        """The candidates that were not chosen."""
        return tuple(each for each in self.candidates if each.resource not in self.chosen)


class Choice(msgspec.Struct, frozen=True):
    """The choice for a task, by role. `together_with`: the requests decided at the same moment."""

    roles: dict[str, RoleChoice]
    together_with: tuple[str, ...] = ()


def how_chosen(candidate: Candidate, name: "NameHolder") -> str:
    """Say how a chosen resource came to the task: it was free, or was taken from a lower one."""
    return f"taken from {name(candidate.held_by)}" if candidate.held_by else "chosen"


NameHolder = Callable[[str], str]
"""Returns words for who holds a resource, given the id of a behavior or request, or a name."""


def choice_of(record: r.ResourcesAllocated) -> Choice:
    """Read what a choice considered."""
    return msgspec.convert(record.considered, Choice)


def why_not(candidate: Candidate, choice: Choice, role: str, name: NameHolder) -> str:
    """Say why a candidate was not chosen for a role."""
    if candidate.excluded:
        return f"excluded, {candidate.excluded}"
    if candidate.held_by:
        return f"held by {name(candidate.held_by)}"
    for other, filled in choice.roles.items():
        if other != role and candidate.resource in filled.chosen:
            return f"chosen for {other}"
    chosen = _dearest(choice.roles[role])
    if chosen is None or chosen.cost_s is None or candidate.cost_s is None:
        return "not needed"
    more_s = candidate.cost_s - chosen.cost_s
    if more_s <= -LEAST_S:
        return f"costs {-more_s:.1f} s less, but another task or role needs it"
    if more_s < LEAST_S:
        return "costs the same, and comes later in the fleet file or is needed by another task"
    return f"costs {more_s:.1f} s more{_in_brackets(_difference(candidate, chosen))}"


def _dearest(choice: RoleChoice) -> Candidate | None:
    chosen = [each for each in choice.candidates if each.resource in choice.chosen]
    return max(chosen, key=lambda each: each.cost_s or 0.0, default=None)


def _difference(candidate: Candidate, chosen: Candidate) -> str:
    """Return the parts by which a candidate costs more or less than the one that was chosen."""
    if candidate.travel_s is None:
        return "its position is not known"
    parts = {
        "travel": candidate.travel_s - (chosen.travel_s or 0.0),
        "battery": candidate.battery_s - chosen.battery_s,
        "switching": candidate.switching_s - chosen.switching_s,
        "preference": chosen.preference_s - candidate.preference_s,
    }
    differ = {name: more_s for name, more_s in parts.items() if abs(more_s) >= LEAST_S}
    return ", ".join(f"{name} {more_s:+.1f} s" for name, more_s in differ.items())


def _in_brackets(text: str) -> str:
    return f" ({text})" if text else ""


def choice_sentence(record: r.ResourcesAllocated, name: NameHolder) -> str:
    """Say what was chosen for each role, and in brackets why nothing else was."""
    choice = choice_of(record)
    parts = [_role_sentence(choice, role, name) for role in choice.roles]
    return "; ".join(part for part in parts if part) or ", ".join(_named(record.roles))


def _named(roles: Mapping[str, tuple[str, ...]]) -> list[str]:
    return [f"{', '.join(resources)} for {role}" for role, resources in roles.items()]


def _role_sentence(choice: Choice, role: str, name: NameHolder) -> str:
    found = choice.roles[role]
    if not found.chosen:
        return f"nothing is chosen for {role}, which is optional"
    verb = "is" if len(found.chosen) == 1 else "are"
    first = next((each for each in found.candidates if each.resource in found.chosen), None)
    reasons = [] if first is None or not first.travel_s else [f"{first.travel_s:.0f} s away"]
    taken = [each for each in found.candidates if each.resource in found.chosen and each.held_by]
    reasons += [f"{each.resource}: {how_chosen(each, name)}" for each in taken]
    others = found.others
    for each in others[:MAX_NAMED]:
        why = why_not(each, choice, role, name).removeprefix("excluded, ").removeprefix(NOT_MET)
        reasons.append(f"{each.resource}: {why}")
    more = len(others) - MAX_NAMED + found.not_listed
    if more > 0:
        reasons.append(f"and {more} others")
    return f"{', '.join(found.chosen)} {verb} chosen for {role}{_in_brackets('; '.join(reasons))}"
