"""Vehicles and payloads that a task with a greater priority takes from other runs.

Only where the fleet file allows it (`allocation: {preemption: true}`). The behavior that has the
vehicle ends with error PREEMPTED, or another does the rest of its work (`onLoss` of its role). The
vehicle is held for the task with the greater priority from that moment, and given to it when the
other behavior has ended. What a run keeps between tasks is given at once. As the priority must be
strictly greater, tasks cannot take a vehicle from each other in turn.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from m2pem.allocation.assignment import Request, RoleOptions, assign
from m2pem.allocation.candidates import LatestState
from m2pem.allocation.needs import ConsideredRole
from m2pem.engine.elements.behaviors import BRINGS_DOWN
from m2pem.engine.state import Behavior, BehaviorPhase, RunState, RunStatus
from m2pem.executive.runner import Runner
from m2pem.mission.behavior import Role
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.elements import ScriptTask, SendTask, ServiceTask

PREEMPTION_COST_S = 200_000.0
"""A vehicle that has to be taken from another run comes after all that are free, in seconds."""

_COMES_DOWN = frozenset({"rtl", "land", "qrtl", "qland", "landing", "return", "descend", "smart"})
"""Words in the modes in which vehicles return or land by themselves."""


@dataclass(frozen=True, slots=True)
class Holder:
    """A behavior of another run that a task with a greater priority may take vehicles from, or
    what that run keeps between tasks. `goes_on`: it is not ending already."""

    runner: Runner
    id: str
    resources: tuple[ResourceId, ...]
    element: str
    priority: int
    goes_on: bool = True

    @property
    def task(self) -> str:
        """The label of its task."""
        return self.runner.run.state.label_of(self.element)

    @property
    def label(self) -> str:
        """What it is for people: the task and its run."""
        return f"{self.task} of {self.runner.id}"


def priority_of(roles: Iterable[Role]) -> int:
    """Return the greatest priority of the roles of a task; 0 if none says one."""
    return max((role.need.priority for role in roles if role.need is not None), default=0)


def preemptible(runners: Iterable[Runner], latest: LatestState) -> list[Holder]:
    """Return the behaviors from which vehicles may be taken, and what is kept and idle.

    Not from a paused run, which decides nothing; not from a behavior that brings its vehicle down,
    or whose vehicle returns or lands by itself; and not from one that an operator is asked about.
    """
    found: list[Holder] = []
    for runner in runners:
        state = runner.run.state
        if state.status is not RunStatus.RUNNING or runner.done.is_set():
            continue
        for behavior in state.behaviors.values():
            if behavior.phase is BehaviorPhase.UNSETTLED or behavior.name in BRINGS_DOWN:
                continue
            found.append(
                Holder(
                    runner,
                    behavior.id,
                    tuple(map(ResourceId, behavior.resources)),
                    behavior.element,
                    priority_of(_roles(state, behavior)),
                    behavior.phase is BehaviorPhase.ACTIVE,
                )
            )
        found += [
            Holder(runner, each.id, (ResourceId(each.resource),), each.element, each.priority)
            for each in state.kept.values()
            if each.resource not in state.held
        ]
    return [each for each in found if not any(_comes_down(one, latest) for one in each.resources)]


def _roles(state: RunState, behavior: Behavior) -> Iterator[Role]:
    node = state.mission.elements.get(behavior.element)
    if isinstance(node, ScriptTask | ServiceTask | SendTask) and node.behavior is not None:
        yield from node.behavior.roles


def _comes_down(resource: ResourceId, latest: LatestState) -> bool:
    vehicle = latest(ResourceId(resource.partition("/")[0]))
    words = re.findall(r"[a-z]+", getattr(vehicle, "mode", "").lower())
    return not _COMES_DOWN.isdisjoint(words)


def choose(
    request: str,
    roles: Iterable[ConsideredRole],
    holders: Mapping[ResourceId, Holder],
    kept: Iterable[ResourceId],
    order: Mapping[ResourceId, int],
) -> dict[str, tuple[ResourceId, ...]] | None:
    """Choose resources for a request among those that are free and those of `holders`.

    `kept`: resources that other requests have or keep. Returns what fills each role; None: not even
    so all can be filled.
    """
    not_free = set(kept)
    options = tuple(_options(role, holders, not_free) for role in roles)
    return assign([Request(request, options)], order).get(request)


def _options(
    considered: ConsideredRole, holders: Mapping[ResourceId, Holder], kept: set[ResourceId]
) -> RoleOptions:
    known = considered.options
    costs_s = {each: cost for each, cost in known.costs_s.items() if each not in kept}
    for each in known.busy:
        if each in holders and each not in kept:
            costs_s[each] = considered.total_s(each) + PREEMPTION_COST_S
    return replace(known, most=max(known.least, 1), costs_s=costs_s, busy=())
