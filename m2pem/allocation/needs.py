"""Which resources may fill a role now, and what each costs (docs/allocation.md)."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from itertools import filterfalse
from typing import TYPE_CHECKING

from m2pem.allocation.assignment import MAX_COST_S, RoleOptions
from m2pem.allocation.candidates import Candidates, Group, Place
from m2pem.fleet.allocation import resources_of
from m2pem.fleet.facts import possible_resources, preference_s, unfit, vehicle_of
from m2pem.mission.behavior import Behavior, BehaviorType, Need, Role, RoleKind
from m2pem.mission.candidate_facts import is_fact
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.expression import Expression
from m2pem.mission.expression.literals import shown
from m2pem.mission.expression.partial import first_false
from m2pem.mission.losses import Loss
from m2pem.mission.values import ReadValue, Value

if TYPE_CHECKING:
    from m2pem.allocation.candidates import Numbers

UNKNOWN_TRAVEL_S = 86_400.0
"""Travel time of a vehicle whose position is not known: it comes after all others."""

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


@dataclass(frozen=True, slots=True)
class Task:
    """The task whose roles are to be filled. `read`: the data store, as seen from it. `used`: what
    its run has commanded before. `occupied`: what is not free for its run, and why. `lost`: what
    did its work before, and is not chosen for it again, and why. `given`: who fills roles by an
    operator's word."""

    behavior: Behavior
    place: Place
    read: ReadValue
    used: Collection[str]
    occupied: Mapping[ResourceId, Occupancy]
    lost: Mapping[str, Loss] = field(default_factory=dict)
    given: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class _Costs:
    """The costs of all resources of a group, one number for each."""

    group: Group
    distance_m: "Numbers"
    travel_s: "Numbers"
    battery_s: "Numbers"
    switching_s: "Numbers"
    preference_s: "Numbers"
    total_s: "Numbers"

    def of(self, resource: ResourceId) -> Cost:
        """Return the parts of the cost of one resource."""
        place = self.group.index[resource]
        return Cost(
            _known(self.travel_s[place]),
            _known(self.distance_m[place]),
            _known(self.group.charge[place]),
            float(self.battery_s[place]),
            float(self.switching_s[place]),
            float(self.preference_s[place]),
        )


@dataclass(frozen=True, slots=True)
class ConsideredRole:
    """A role and all that was found about its candidates.

    `resources`: the candidates in the order of the fleet. `excluded`: why some cannot fill the
    role. `occupied`: why some are not free. `costs`: the cost of each in seconds of travel time.
    `named`: the mission or an operator says what fills the role; all of `resources` do.
    """

    role: Role
    options: RoleOptions
    resources: tuple[ResourceId, ...]
    excluded: Mapping[ResourceId, str]
    occupied: Mapping[ResourceId, Occupancy]
    costs: _Costs
    named: bool = False

    def total_s(self, resource: ResourceId) -> float:
        """Return the cost of a candidate; less is better."""
        return float(self.costs.total_s[self.costs.group.index[resource]])


@dataclass(slots=True)
class RoleEvaluator:
    """Evaluates roles over one snapshot of the fleet. What does not depend on the place of a task
    is evaluated once for all tasks that ask for the same."""

    candidates: Candidates
    _excluded: dict[tuple[object, ...], Mapping[ResourceId, str]] = field(default_factory=dict)

    def role(self, role: Role, task: Task) -> ConsideredRole:
        """Look at all that may fill a role of a task.

        Raises:
            ExpressionError: an expression of the role has a wrong type.
        """
        fleet, group = self.candidates.fleet, self.candidates.group(role.kind)
        need = role.need or Need()
        excluded: Mapping[ResourceId, str] = {}
        resources = group.resources
        least, most = (0 if role.optional else need.least), need.most
        given = task.given.get(role.name)
        named = bool(given or role.resource)
        if named:
            resources = tuple(map(ResourceId, given)) if given else resources_of(role, fleet)
            least = most = 0 if role.optional and not resources else max(1, len(resources))
        else:
            excluded = self._exclusions(need, role.kind, task)
            if task.lost:
                excluded = {**excluded, **_lost_here(task.lost)}
        costs = self._costs(group, need, task, excluded)
        able = [each for each in resources if each not in excluded]
        totals = costs.total_s.tolist()
        index, occupied = group.index, task.occupied
        options = RoleOptions(
            role.name,
            least,
            most,
            {each: totals[index[each]] for each in able if each not in occupied},
            [each for each in able if each in occupied and not occupied[each].withdrawn],
        )
        return ConsideredRole(role, options, resources, excluded, occupied, costs, named)

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

    def _exclusions(self, need: Need, kind: RoleKind, task: Task) -> Mapping[ResourceId, str]:
        condition, behavior = need.condition, task.behavior
        data = () if condition is None else sorted(filterfalse(is_fact, condition.names))
        of_place = condition is not None and bool(condition.names & _OF_PLACE)
        key = (
            kind,
            behavior.name,
            behavior.type,
            condition,
            task.place if of_place else None,
            repr(task.read(need.same)) if need.same else "",
            *(repr(task.read(name)) for name in data),
        )
        if key not in self._excluded:
            group = self.candidates.group(kind)
            reasons = (
                (each, self._why_not(each, need, behavior.name, behavior.type, group, task))
                for each in group.resources
            )
            self._excluded[key] = {each: reason for each, reason in reasons if reason}
        return self._excluded[key]

    def _why_not(
        self,
        resource: ResourceId,
        need: Need,
        name: str,
        kind: BehaviorType,
        group: Group,
        task: Task,
    ) -> str:
        """Return why a resource cannot fill a role now; "": it can."""
        fleet = self.candidates.fleet
        if reason := unfit(fleet, self.candidates.graph, name, kind, resource):
            return reason
        if reason := self._why_not_same(resource, need, task):
            return reason
        if need.condition is None:
            return ""
        read = self._reader(resource, group, task)
        return "" if need.condition.holds(read) else _false_part(need.condition, read)

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

    def _costs(
        self, group: Group, need: Need, task: Task, excluded: Mapping[ResourceId, str]
    ) -> _Costs:
        import numpy as np  # noqa: PLC0415  # only a mission with roles by need has to load it

        fleet = self.candidates.fleet
        distance_m = self.candidates.distances_m(group, task.place)
        travel_s = distance_m / (task.place.speed_m_s or group.cruise_speed_m_s)
        battery_s = np.nan_to_num(fleet.battery_cost_s * (1.0 - group.charge), nan=0.0)
        switching_s = np.full(len(group.resources), fleet.switching_cost_s)
        used = [group.index[ResourceId(each)] for each in task.used if each in group.index]
        switching_s[used] = 0.0
        preferences_s = np.zeros(len(group.resources))
        if need.preference is not None:
            for place, resource in enumerate(group.resources):
                if resource not in excluded:
                    read = self._reader(resource, group, task)
                    preferences_s[place] = preference_s(need.preference, read)
        known_s = np.nan_to_num(travel_s, nan=UNKNOWN_TRAVEL_S)
        total_s = np.clip(
            known_s + battery_s + switching_s - preferences_s, -MAX_COST_S, MAX_COST_S
        )
        return _Costs(group, distance_m, travel_s, battery_s, switching_s, preferences_s, total_s)


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
