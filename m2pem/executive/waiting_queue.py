"""The queue of the allocator: requests in the order of service, each with what may fill its roles.

Most requests of a long queue need the same. Of these, as many are looked at as can be served.
"""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from m2pem.allocation.candidates import Candidates, LatestState, Place
from m2pem.allocation.needs import Occupancy, RoleEvaluator, Task
from m2pem.api.arbiter import BehaviorId, BehaviorRequest, ResolvedValue
from m2pem.api.runs import RunId
from m2pem.engine.data import reader
from m2pem.engine.elements.allocations import behavior_of
from m2pem.engine.inputs import ResourcesNotFree
from m2pem.engine.keeping import may_use
from m2pem.engine.state import AllocationRequest, BehaviorPhase, RunState, RunStatus
from m2pem.errors import ExpressionError
from m2pem.executive.allocation_requests import AskedFor, ConsideredRequest
from m2pem.executive.dispatcher import Geometries
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.runner import Runner
from m2pem.executive.waiting_tasks import holder_label
from m2pem.fleet.allocation import Availability, is_behavior
from m2pem.fleet.parameters import ParameterError, resolve
from m2pem.mission.behavior import Behavior
from m2pem.mission.catalogue import BehaviorSpec, ResourceId

log = logging.getLogger("m2pem.executive")


@dataclass(slots=True)
class SameNeed:
    """Requests that wait for one resource each, and that the same resources can serve. Of those
    that a decision has found free, every request served takes one. So no more of the queue have to
    be looked at than are free, and one, to know why it waits."""

    first: ConsideredRequest
    looked_at: int = 1

    @property
    def is_done(self) -> bool:
        """Whether none of those behind can be served."""
        return self.looked_at >= len(self.first.roles[0].options.costs_s)


class WaitingQueue:
    """The requests of all runs of an executive that have no behavior yet.

    `latest`: the newest telemetry of a resource. `runners`: the runs that are driven here.
    `in_turn`: tasks that need the same are served in their order. It is not so where one may have
    no space, or take from other runs what another may not.
    """

    def __init__(
        self,
        arbiters: FleetArbiters,
        availability: Availability,
        latest: LatestState,
        geometries: Geometries,
        runners: Mapping[RunId, Runner],
        *,
        in_turn: bool,
    ) -> None:
        self._arbiters = arbiters
        self._availability = availability
        self._latest = latest
        self._geometries = geometries
        self._runners = runners
        self._in_turn = in_turn
        self._holders: dict[str, Occupancy] = {}
        self.asked: dict[str, AskedFor] = {}
        fleet = arbiters.fleet
        self.order = {each: place for place, each in enumerate((*fleet.vehicles, *fleet.payloads))}
        """The place of each resource in the fleet file."""

    @cached_property
    def evaluator(self) -> RoleEvaluator:
        """What says which resources may fill a role, and at which cost."""
        fleet, graph = self._arbiters.fleet, self._arbiters.graph
        return RoleEvaluator(Candidates(fleet, graph, self._latest))

    def consider(self) -> tuple[list[ConsideredRequest], list[ConsideredRequest]]:
        """Return the requests that are looked at, in their order, and those that are not: as many
        as there are free resources are before them and need the same."""
        self.evaluator.look_again()
        found: list[ConsideredRequest] = []
        behind: list[ConsideredRequest] = []
        occupied = self._occupied()
        of_runs: dict[RunId, Mapping[ResourceId, Occupancy]] = {}
        queues: dict[tuple[object, ...] | None, SameNeed] = {}
        for asked, request in self._open_requests():
            state = asked.runner.run.state
            if state.run not in of_runs:
                of_runs[state.run] = _without(occupied, _ending(state))
            free_of = of_runs[state.run]
            if state.kept:  # it has what its run keeps for it
                own = {each.id for each in state.kept.values() if may_use(each, request.token)}
                free_of = _without(free_of, own)
            need = asked.need if self._in_turn and free_of is occupied else None
            queue = queues.get(need)
            if queue is not None and queue.is_done:
                first = queue.first
                behind.append(ConsideredRequest(asked, request, first.task, first.roles))
                continue
            try:
                task = self._task(asked.runner, request, free_of)
                roles = tuple(self.evaluator.role(role, task) for role in task.behavior.roles)
            except ExpressionError as error:
                asked.runner.post(ResourcesNotFree(request.id, str(error), code="EXPRESSION"))
                continue
            except Exception as error:
                log.exception("%s: a bug in m2pem", request.id)
                asked.runner.fail(error)
                continue
            found.append(ConsideredRequest(asked, request, task, roles))
            if queue is not None:
                queue.looked_at += 1
            elif need is not None:
                queues[need] = SameNeed(found[-1])
        return found, behind

    def _open_requests(self) -> list[tuple[AskedFor, AllocationRequest]]:
        """Return all that nothing was chosen for, in the order of service."""
        found = []
        for allocation, asked in self.asked.items():
            state = asked.runner.run.state
            request = state.allocations.get(allocation)
            if not asked.chosen and request is not None and state.status is RunStatus.RUNNING:
                found.append((asked, request))
        found.sort(key=lambda each: each[0].look_at(each[1]))
        return found

    def _task(
        self,
        runner: Runner,
        request: AllocationRequest,
        occupied: Mapping[ResourceId, Occupancy],
    ) -> Task:
        behavior, lost = behavior_of(request), request.token.lost_work
        return Task(
            behavior,
            lambda: self._place(runner, behavior, request),
            reader(request.token),
            runner.run.state.commanded,
            occupied,
            {} if lost is None else lost.resources,
            request.token.replacements or {},
        )

    def _occupied(self) -> dict[ResourceId, Occupancy]:
        """Return what is not free, and why; also what behaviors have been given that wait for
        their turn in the dispatcher."""
        found = {
            each: Occupancy(withdrawn=why) for each, why in self._availability.withdrawn().items()
        }
        held = dict(self._availability.held())
        requested = {
            ResourceId(resource): behaviors
            for runner in self._runners.values()
            for resource, behaviors in runner.run.state.held.items()
        }
        known: dict[str, Occupancy] = {}
        for resource in held | requested:
            if resource in found:
                continue
            by, behaviors = held.get(resource, ""), requested.get(resource, [])
            if behaviors and (by in behaviors or not is_behavior(by)):
                by = behaviors[-1]  # it waits until the one before it has ended
            if by not in known:
                before = self._holders.get(by)
                if before is None or not before.label:
                    before = Occupancy(by, label=self.label(by))
                known[by] = before
            found[resource] = known[by]
        self._holders = known
        return found

    def label(self, holder: str) -> str:
        """Return words for a behavior or request; "" if it is not known."""
        label = holder_label(self._runners, holder)
        return f"{label} ({holder})" if label else ""

    def _place(self, runner: Runner, behavior: Behavior, request: AllocationRequest) -> Place:
        """Return where the task begins; anywhere, if its parameters make no sense: its behavior is
        refused later, with the reason."""
        spec = self._spec(behavior)
        if spec is None:
            return Place()
        try:
            return self.evaluator.candidates.place_of(self._parameters(spec, runner.id, request))
        except ParameterError:
            return Place()
        except Exception as error:  # a bug in m2pem holds this run, not all that asks
            log.exception("%s: a bug in m2pem", request.id)
            runner.fail(error)
            return Place()

    def _parameters(
        self, spec: BehaviorSpec, run: RunId, request: AllocationRequest
    ) -> dict[str, ResolvedValue]:
        fleet = self._arbiters.fleet
        return resolve(
            spec,
            request.parameters,
            lambda name: self._geometries(run, name),
            fleet.vehicles,
            fleet.origin,
        )

    def _spec(self, behavior: Behavior) -> BehaviorSpec | None:
        """Return how the behavior is taken by the first resource that offers it."""
        graph = self._arbiters.graph
        found = (graph.spec(each, behavior.name, behavior.type) for each in self.order)
        return next((spec for spec in found if spec is not None), None)

    def behavior_request(
        self, each: ConsideredRequest, chosen: Mapping[str, tuple[ResourceId, ...]]
    ) -> tuple[BehaviorRequest, BehaviorSpec] | None:
        """Return the behavior that is requested with what is chosen; None: it will be refused."""
        behavior = behavior_of(each.request)
        roles = each.filled(chosen)
        resources = tuple(dict.fromkeys(one for ids in roles.values() for one in ids))
        spec = self._spec(behavior)
        if spec is None:
            return None
        try:
            parameters = self._parameters(spec, each.asked.runner.id, each.request)
        except ParameterError:
            return None  # its behavior is refused later, with the reason
        number = BehaviorId(each.request.id)
        return BehaviorRequest(number, 0, behavior.name, parameters, resources, roles), spec


def _ending(state: RunState) -> set[str]:
    """Return the behaviors that a run has cancelled: it may preempt these itself."""
    behaviors = state.behaviors.values()
    return {each.id for each in behaviors if each.phase is BehaviorPhase.CANCELLING}


def _without(
    occupied: Mapping[ResourceId, Occupancy], holders: set[str]
) -> Mapping[ResourceId, Occupancy]:
    """Return what is not free for a task that may have what some holders have."""
    if not holders:
        return occupied
    return {each: found for each, found in occupied.items() if found.holder not in holders}
