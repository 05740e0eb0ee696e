"""Which resources may fill a role now, and what each costs (docs/allocation.md)."""

import math
from collections.abc import Callable, Collection, ItemsView, Iterator, Mapping, Sequence, ValuesView
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import filterfalse
from typing import TYPE_CHECKING

from m2pem.allocation.assignment import MAX_COST_S, RoleOptions
from m2pem.allocation.candidates import Candidates, Group, Place
from m2pem.errors import ExpressionError
from m2pem.fleet.allocation import resources_of
from m2pem.fleet.behaviors import ALONG_ROUTES
from m2pem.fleet.facts import possible_resources, preference_s, unfit, vehicle_of
from m2pem.mission.behavior import Behavior, Need, Role, RoleKind
from m2pem.mission.candidate_facts import FLEET_FACTS, is_fact
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.expression import Expression
from m2pem.mission.expression.literals import shown
from m2pem.mission.expression.partial import first_false
from m2pem.mission.losses import Loss
from m2pem.mission.values import ReadValue, Value

if TYPE_CHECKING:
    from m2pem.allocation.candidates import Numbers, Places

UNKNOWN_TRAVEL_S = 86_400.0
"""Travel time of a vehicle whose position is not known: it comes after all others."""

_GOES_THERE = frozenset({"goto", "single_vehicle_routing", "area_survey", *ALONG_ROUTES})
"""Behaviors that go to the place of their task, not around it or beside it."""

_OF_PLACE = frozenset({"vehicle.distance", "vehicle.travel_time"})
"""Facts that depend on the place of the task."""


@dataclass(frozen=True, slots=True)
class Occupancy:
    """Why a resource is not free. `holder`: who has it now; `withdrawn`: why no mission gets it
    (it is lost, or with an operator). `label`: the holder in words; "": its id says it."""

    holder: str = ""
    withdrawn: str = ""
    label: str = ""


@dataclass(frozen=True, slots=True)
class Cost:
    """The parts of a candidate's cost in seconds of travel time. None: not known."""

    travel_s: float | None
    distance_m: float | None
    battery: float | None
    battery_s: float
    switching_s: float
    preference_s: float


@dataclass(frozen=True)
class Task:
    """The task whose roles are to be filled. `where`: returns where it begins; it is asked when
    that is needed. `read`: the data store, as seen from it. `used`: what its run has commanded
    before. `occupied`: what is not free for its run, and why. `lost`: what did its work before, and
    is not chosen for it again, and why. `given`: who fills roles by an operator's word."""

    behavior: Behavior
    where: Callable[[], Place]
    read: ReadValue
    used: Collection[str]
    occupied: Mapping[ResourceId, Occupancy]
    lost: Mapping[str, Loss] = field(default_factory=dict)
    given: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @cached_property
    def place(self) -> Place:
        """Where it begins."""
        return self.where()


@dataclass(frozen=True, slots=True)
class _Parts:
    """The costs of all resources of a group and their parts, one number for each."""

    distance_m: "Numbers"
    travel_s: "Numbers"
    battery_s: "Numbers"
    switching_s: "Numbers"
    preference_s: "Numbers"
    total_s: "Numbers"


@dataclass(frozen=True, slots=True)
class Candidacy:
    """What is found about the candidates for a role, the same for all tasks that ask for the same.

    `resources`: the candidates in the order of the fleet. `excluded`: why some cannot fill the
    role. `occupied`: why some are not free. `able`: those that are not excluded. `free`: those of
    them that are free, `places`: their places in the group. `busy`: those that others have.
    """

    resources: tuple[ResourceId, ...]
    excluded: Mapping[ResourceId, str]
    occupied: Mapping[ResourceId, Occupancy]
    able: Sequence[ResourceId]
    free: Mapping[ResourceId, None]
    places: "Places"
    busy: Sequence[ResourceId]


class Costs(Mapping[ResourceId, float]):
    """What the free candidates for a role cost, in seconds of travel time; less is better.

    It is computed when it is looked at: of the tasks that wait, most get nothing. `of` and
    `total_s` also tell it of candidates that are not free.
    """

    __slots__ = ("_candidacy", "_compute", "_known", "_parts", "group")

    def __init__(self, group: Group, candidacy: Candidacy, compute: Callable[[], _Parts]) -> None:
        """`compute`: returns the costs of all resources of the group."""
        self.group = group
        self._candidacy = candidacy
        self._compute = compute
        self._parts: _Parts | None = None
        self._known: dict[ResourceId, float] | None = None

    def __iter__(self) -> Iterator[ResourceId]:
        return iter(self._candidacy.free)

    def __len__(self) -> int:
        return len(self._candidacy.free)

    def __contains__(self, resource: object) -> bool:
        return resource in self._candidacy.free

    def __getitem__(self, resource: ResourceId) -> float:
        return self._all()[resource]

    def items(self) -> ItemsView[ResourceId, float]:
        """Return each free candidate and what it costs."""
        return self._all().items()

    def values(self) -> ValuesView[float]:
        """Return the costs of the free candidates."""
        return self._all().values()

    def _all(self) -> dict[ResourceId, float]:
        if self._known is None:
            found = self._candidacy
            totals_s = self.parts.total_s[found.places].tolist()
            self._known = dict(zip(found.free, totals_s, strict=True))
        return self._known

    @property
    def parts(self) -> _Parts:
        """The costs of all resources, and their parts."""
        if self._parts is None:
            self._parts = self._compute()
        return self._parts

    def total_s(self, resource: ResourceId) -> float:
        """Return the cost of any candidate."""
        return float(self.parts.total_s[self.group.index[resource]])

    def of(self, resource: ResourceId) -> Cost:
        """Return the parts of the cost of any candidate."""
        place, parts = self.group.index[resource], self.parts
        return Cost(
            _known(parts.travel_s[place]),
            _known(parts.distance_m[place]),
            _known(self.group.charge[place]),
            float(parts.battery_s[place]),
            float(parts.switching_s[place]),
            float(parts.preference_s[place]),
        )


@dataclass(slots=True)
class _Evaluated:
    """What an expression of a role has given for each candidate.

    `of_telemetry`: whether it reads facts of telemetry. `stale`: of which candidates these have
    changed since. `used`: whether a task has asked since the last decision.
    """

    of_telemetry: bool
    stale: set[ResourceId] = field(default_factory=set, init=False)
    used: bool = field(default=True, init=False)


@dataclass(slots=True)
class _Exclusions(_Evaluated):
    """Why some cannot fill a role by need. `why_not`: finds it again for one of them."""

    found: Mapping[ResourceId, str]
    group: Group
    why_not: Callable[[ResourceId], str]


@dataclass(slots=True)
class _Preferences(_Evaluated):
    """How many seconds each is worth, by its place in the group; NaN: it was not looked at."""

    found_s: "Numbers"


@dataclass(frozen=True, slots=True)
class ConsideredRole:
    """A role and all that was found about its candidates. `costs`: of each, when they are asked
    for. `named`: the mission or an operator says what fills the role; all of `resources` do."""

    role: Role
    options: RoleOptions
    candidacy: Candidacy
    costs: Costs
    named: bool = False

    @property
    def resources(self) -> tuple[ResourceId, ...]:
        """The candidates in the order of the fleet."""
        return self.candidacy.resources

    @property
    def excluded(self) -> Mapping[ResourceId, str]:
        """Why some cannot fill the role."""
        return self.candidacy.excluded

    @property
    def occupied(self) -> Mapping[ResourceId, Occupancy]:
        """Why some are not free."""
        return self.candidacy.occupied

    def excluding(self, reasons: Mapping[ResourceId, str]) -> "ConsideredRole":
        """Return the same role without some candidates, and why."""
        found = self.candidacy
        excluded = {**found.excluded, **reasons}
        candidacy = _candidacy(self.costs.group, found.resources, excluded, found.occupied)
        return replace(self, candidacy=candidacy)

    @property
    def reads_telemetry(self) -> bool:
        """Whether telemetry may exclude other candidates at any time."""
        need = self.role.need
        condition = None if need is None or self.named else need.condition
        return condition is not None and _reads_telemetry(condition)

    @property
    def reads_task(self) -> bool:
        """Whether the mission's data or the task's place say which candidates are excluded."""
        need = self.role.need
        if need is None or self.named:
            return False
        condition = need.condition
        return bool(need.same) or (condition is not None and not reads_candidate_alone(condition))

    def total_s(self, resource: ResourceId) -> float:
        """Return the cost of a candidate; less is better."""
        return self.costs.total_s(resource)


@dataclass(slots=True)
class RoleEvaluator:
    """Evaluates roles over a snapshot of the fleet. What does not depend on the place of a task is
    evaluated once for all tasks that ask for the same, and again only where telemetry changes."""

    candidates: Candidates
    _excluded: dict[tuple[object, ...], _Exclusions] = field(default_factory=dict)
    _preferences: dict[tuple[object, ...], _Preferences] = field(default_factory=dict)
    _candidacies: dict[tuple[object, ...], Candidacy] = field(default_factory=dict)

    def look_again(self) -> None:
        """Take over the newest telemetry, for the next decision."""
        changed = self.candidates.look_again()
        self._candidacies.clear()
        self._excluded = {key: each for key, each in self._excluded.items() if each.used}
        self._preferences = {key: each for key, each in self._preferences.items() if each.used}
        for each in (*self._excluded.values(), *self._preferences.values()):
            each.used = False
            if each.of_telemetry:
                each.stale.update(changed)

    def telemetry_changes_candidates(self) -> bool:
        """Whether the newest telemetry excludes others than at the last decision, of the roles that
        read nothing but facts that do not depend on the task."""
        changed = self.candidates.look_again()
        for each in (*self._excluded.values(), *self._preferences.values()):
            if each.of_telemetry:
                each.stale.update(changed)
        for known in self._excluded.values():
            if known.stale:
                before = known.found.keys()
                try:
                    _find_again(known)
                except ExpressionError:
                    return True  # it is an error of the tasks that ask
                if known.found.keys() != before:
                    return True
        return False

    def role(self, role: Role, task: Task) -> ConsideredRole:
        """Look at all that may fill a role of a task.

        Raises:
            ExpressionError: an expression of the role has a wrong type.
        """
        fleet, group = self.candidates.fleet, self.candidates.group(role.kind)
        need = role.need or Need()
        least, most = (0 if role.optional else need.least), need.most
        given = task.given.get(role.name)
        named = bool(given or role.resource)
        if named:
            resources = tuple(map(ResourceId, given)) if given else resources_of(role, fleet)
            least = most = 0 if role.optional and not resources else max(1, len(resources))
            found = _candidacy(group, resources, {}, task.occupied)
        else:
            found = self._candidacy(need, role.kind, task)
        # A wrong type in `prefer` is an error of the task, whatever it gets: it is not put off.
        worth_s = self._worth_s(group, role, task, found.excluded)
        costs = Costs(group, found, lambda: self._costs(group, task, worth_s))
        options = RoleOptions(role.name, least, most, costs, found.busy)
        return ConsideredRole(role, options, found, costs, named)

    def ever(self, role: Role, task: Task) -> list[ResourceId]:
        """Return what may ever fill a role by need, as far as the fleet file says.

        Raises:
            ExpressionError: an expression of the role has a wrong type.
        """
        candidates = self.candidates
        found = possible_resources(candidates.fleet, candidates.graph, task.behavior, role)
        need = role.need or Need()
        return [each for each in found if not self._why_not_same(each, need, task)]

    # --- who may fill it --------------------------------------------------------------------------

    def _candidacy(self, need: Need, kind: RoleKind, task: Task) -> Candidacy:
        group = self.candidates.group(kind)
        key = *_key(kind, need.condition, need.same, task), self._fenced(task) and task.place
        excluded: Mapping[ResourceId, str]
        if task.lost:
            excluded = {**self._exclusions(key, need, kind, task), **_lost_here(task.lost)}
            return _candidacy(group, group.resources, excluded, task.occupied)
        known = self._candidacies.get(key)
        if known is None or known.occupied is not task.occupied:
            excluded = self._exclusions(key, need, kind, task)
            known = _candidacy(group, group.resources, excluded, task.occupied)
            self._candidacies[key] = known
        return known

    def _exclusions(
        self, key: tuple[object, ...], need: Need, kind: RoleKind, task: Task
    ) -> Mapping[ResourceId, str]:
        group = self.candidates.group(kind)
        known = self._excluded.get(key)
        if known is None:

            def why_not(resource: ResourceId) -> str:
                return self._why_not(resource, need, group, task)

            reasons = ((each, why_not(each)) for each in group.resources)
            of_telemetry = need.condition is not None and _reads_telemetry(need.condition)
            of_telemetry = of_telemetry or self._fenced(task)
            excluded = {each: why for each, why in reasons if why}
            known = self._excluded[key] = _Exclusions(of_telemetry, excluded, group, why_not)
        elif known.stale:
            _find_again(known)
        known.used = True
        return known.found

    def _why_not(self, resource: ResourceId, need: Need, group: Group, task: Task) -> str:
        """Return why a resource cannot fill a role now; "": it can."""
        fleet, graph, behavior = self.candidates.fleet, self.candidates.graph, task.behavior
        if reason := unfit(fleet, graph, behavior.name, behavior.type, resource):
            return reason
        if reason := self._why_not_same(resource, need, task):
            return reason
        if self._fenced(task) and (reason := self.candidates.breach(resource, task.place)):
            return reason
        if need.condition is None:
            return ""
        read = self._reader(resource, group, task)
        return "" if need.condition.holds(read) else _false_part(need.condition, read)

    def _fenced(self, task: Task) -> bool:
        """Whether the fence says who can get to a task."""
        return task.behavior.name in _GOES_THERE and self.candidates.fleet.fenced

    def _why_not_same(self, resource: ResourceId, need: Need, task: Task) -> str:
        """Return why it is not what an earlier role chose; "": it is, or nothing asks for that."""
        if not need.same:
            return ""
        same = task.read(need.same)
        chosen = same if isinstance(same, list) else [same]
        vehicle = vehicle_of(self.candidates.fleet, resource).id
        if resource in chosen or vehicle in chosen:
            return ""
        return f"it is not {need.same}, which is {shown(same)}"

    def _reader(self, resource: ResourceId, group: Group, task: Task) -> ReadValue:
        """Return what an expression of a role reads about one candidate."""
        facts = self.candidates.facts(resource)

        def read(name: str) -> Value:
            if name not in _OF_PLACE:
                return facts.get(name) if is_fact(name) else task.read(name)
            place = group.index[resource]
            distances_m = self.candidates.distances_m(group, task.place)
            if name == "vehicle.distance":
                return _known(distances_m[place])
            speed_m_s = task.place.speed_m_s or group.cruise_speed_m_s[place]
            return _known(distances_m[place] / speed_m_s)

        return read

    # --- what it costs ----------------------------------------------------------------------------

    def _costs(self, group: Group, task: Task, worth_s: "Numbers | None") -> _Parts:
        import numpy as np  # noqa: PLC0415  # only a mission with roles by need has to load it

        fleet = self.candidates.fleet
        distance_m = self.candidates.distances_m(group, task.place)
        travel_s = distance_m / (task.place.speed_m_s or group.cruise_speed_m_s)
        battery_s = np.where(np.isnan(group.charge), 0.0, fleet.battery_cost_s * (1 - group.charge))
        switching_s = np.full(len(group.resources), fleet.switching_cost_s)
        used = [group.index[ResourceId(each)] for each in task.used if each in group.index]
        switching_s[used] = 0.0
        if worth_s is None:
            worth_s = np.zeros(len(group.resources))
        known_s = np.where(np.isnan(travel_s), UNKNOWN_TRAVEL_S, travel_s)
        total_s = np.clip(known_s + battery_s + switching_s - worth_s, -MAX_COST_S, MAX_COST_S)
        return _Parts(distance_m, travel_s, battery_s, switching_s, worth_s, total_s)

    def _worth_s(
        self, group: Group, role: Role, task: Task, excluded: Mapping[ResourceId, str]
    ) -> "Numbers | None":
        """Return how many seconds each candidate is worth, 0 for one that is excluded; None: the
        role prefers nothing."""
        if role.need is None or role.need.preference is None:
            return None
        import numpy as np  # noqa: PLC0415

        preference = role.need.preference
        key = _key(role.kind, preference, "", task)
        known = self._preferences.get(key)
        if known is None:
            found_s = np.full(len(group.resources), np.nan)
            known = self._preferences[key] = _Preferences(_reads_telemetry(preference), found_s)
        known.used = True
        known.found_s[[group.index[each] for each in known.stale if each in group.index]] = np.nan
        known.stale.clear()
        for place in np.flatnonzero(np.isnan(known.found_s)).tolist():
            if (resource := group.resources[place]) not in excluded:
                read = self._reader(resource, group, task)
                known.found_s[place] = preference_s(preference, read)
        return np.where(np.isnan(known.found_s), 0.0, known.found_s)


def _find_again(known: _Exclusions) -> None:
    """Evaluate again the candidates of which telemetry has changed."""
    again = {each: known.why_not(each) for each in known.stale if each in known.group.index}
    if any(known.found.get(each, "") != why for each, why in again.items()):
        found = {**known.found, **again}
        known.found = {each: why for each, why in found.items() if why}
    known.stale.clear()


def _key(
    kind: RoleKind, expression: Expression | None, same: str, task: Task
) -> tuple[object, ...]:
    """Return what it depends on, besides the fleet, what is found for a role of a task."""
    names = frozenset[str]() if expression is None else expression.names
    return (
        kind,
        task.behavior.name,
        task.behavior.type,
        expression,
        None if _OF_PLACE.isdisjoint(names) else task.place,
        repr(task.read(same)) if same else "",
        *(repr(task.read(name)) for name in sorted(filterfalse(is_fact, names))),
    )


def reads_candidate_alone(expression: Expression) -> bool:
    """Whether an expression of a role reads facts that do not depend on the task."""
    return all(map(is_fact, expression.names)) and _OF_PLACE.isdisjoint(expression.names)


def _reads_telemetry(expression: Expression) -> bool:
    return any(is_fact(each) and each not in FLEET_FACTS for each in expression.names)


def _candidacy(
    group: Group,
    resources: tuple[ResourceId, ...],
    excluded: Mapping[ResourceId, str],
    occupied: Mapping[ResourceId, Occupancy],
) -> Candidacy:
    import numpy as np  # noqa: PLC0415

    able = [each for each in resources if each not in excluded] if excluded else resources
    free = dict.fromkeys(each for each in able if each not in occupied)
    return Candidacy(
        resources,
        excluded,
        occupied,
        able,
        free,
        np.fromiter(map(group.index.__getitem__, free), np.intp, len(free)),
        [each for each in able if each in occupied and not occupied[each].withdrawn],
    )


def _lost_here(lost: Mapping[str, Loss]) -> dict[ResourceId, str]:
    return {
        ResourceId(each): f"this task has lost it: {loss.code}"
        + (f" ({loss.reason})" if loss.reason else "")
        for each, loss in lost.items()
    }


def _known(number: float) -> float | None:
    return None if math.isnan(number) else float(number)


def _false_part(condition: Expression, read: ReadValue) -> str:
    """Say with which values a condition does not hold: those of its first part that is false."""
    names = sorted(first_false(condition, lambda _: True, read))
    values = ", ".join(f"{name} = {shown(read(name))}" for name in names)
    return f"requires is false: {values}" if values else "requires is false"
