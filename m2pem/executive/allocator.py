"""The allocator: chooses resources for the tasks of all runs that ask, together.

Requests that arrive in one turn of the event loop, and those that wait, are decided at one moment.
What is chosen is held for its request until the run has journaled the choice and requests the
behavior. While a request waits, the allocator looks again when a resource is released, lost or
received again, and at most every half second when telemetry arrives.

In a fleet whose tasks wait for space, what is chosen must have its space as well: it is reserved
together with the resources.
"""

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from m2pem.allocation.assignment import Request, assign
from m2pem.allocation.candidates import Candidates, LatestState, Place
from m2pem.allocation.explanation import reason, what_was_considered
from m2pem.allocation.needs import ConsideredRole, Occupancy, RoleEvaluator, Task
from m2pem.api.arbiter import BehaviorId, BehaviorRequest, ResolvedValue
from m2pem.api.clock import Clock
from m2pem.api.control import Alert, RunId
from m2pem.engine import records as r
from m2pem.engine.data import reader
from m2pem.engine.elements.allocations import behavior_of
from m2pem.engine.inputs import BehaviorPreempted, ResourcesChosen, ResourcesNotFree
from m2pem.engine.keeping import may_use
from m2pem.engine.state import AllocationRequest, BehaviorPhase, RunStatus
from m2pem.errors import ExpressionError
from m2pem.executive.allocation_requests import AskedFor, ConsideredRequest, Preempting
from m2pem.executive.dispatcher import Geometries
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.preemption import Holder, choose, preemptible
from m2pem.executive.runner import Runner
from m2pem.executive.space_allocation import (
    SpaceAllocation,
    holders_of,
)
from m2pem.executive.waiting_circles import WaitingCircles
from m2pem.executive.waiting_tasks import holder_label
from m2pem.fleet.allocation import Availability, is_behavior
from m2pem.fleet.parameters import ParameterError, resolve
from m2pem.fleet.space import may_wait_for_space
from m2pem.mission.behavior import Behavior
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.mission.losses import PREEMPTED, UNAVAILABLE

if TYPE_CHECKING:
    from m2pem.deconfliction.conflicts import Refusal

REJECTED = "REJECTED"
"""The error of a task whose behavior another vehicle is in the way of, and which does not wait."""

log = logging.getLogger("m2pem.executive")

LOOK_AGAIN_US = 500_000
"""Telemetry makes the allocator look again at what waits after that time, in microseconds."""


_MAY_FREE = (r.RunResumed, r.ResourceReturned, r.OperatorGaveControlBack)
"""Records after which a task of the run may get what it could not get before."""


class Allocator:
    """Chooses resources for the requests of all runs of an executive.

    `latest`: the newest telemetry of a resource. `runners`: the runs that are driven here.
    `publish`: takes warnings for operators. `space`: what tasks wait for beside their resources;
    None: nothing.
    """

    def __init__(
        self,
        arbiters: FleetArbiters,
        availability: Availability,
        latest: LatestState,
        clock: Clock,
        geometries: Geometries,
        runners: Mapping[RunId, Runner],
        publish: Callable[[Alert], None],
        space: SpaceAllocation | None = None,
    ) -> None:
        self._arbiters = arbiters
        self._availability = availability
        self._latest = latest
        self._clock = clock
        self._geometries = geometries
        self._runners = runners
        self._publish = publish
        self._space = space
        self._asked: dict[str, AskedFor] = {}
        self._scheduled = False
        self._later: asyncio.Task[None] | None = None
        self._looked_us = 0
        self._circles = WaitingCircles(runners, arbiters.graph, publish)
        fleet = arbiters.fleet
        self._order = {each: place for place, each in enumerate((*fleet.vehicles, *fleet.payloads))}

    # --- what runs ask ----------------------------------------------------------------------------

    def ask(self, runner: Runner, allocation: str, *, again: bool) -> None:
        """Choose resources for a request; the run gets the answer as an input.

        `again`: what was chosen for it had been taken meanwhile.
        """
        asked = self._asked.setdefault(allocation, AskedFor(runner))
        if again and asked.chosen:
            asked.chosen, asked.preempts = False, None
            self._release(allocation)
        self._decide_soon()

    def withdraw(self, allocation: str) -> None:
        """Forget a request: its task needs no resources any more."""
        if self._asked.pop(allocation, None) is not None:
            self._release(allocation)

    def _release(self, allocation: str) -> None:
        if self._space is not None:
            self._space.release(allocation)
        self._availability.release(allocation)

    def on_records(self, run: RunId, records: Sequence[r.Record]) -> None:
        """Hand what is held for a request to the behavior that was requested for it."""
        for record in records:
            if isinstance(record, r.BehaviorRequested):
                if self._asked.pop(record.allocation, None) is not None:
                    self._availability.hand_on(record.allocation, record.behavior)
                    if self._space is not None:
                        self._space.hand_on(record.allocation, record.behavior)
                        self.resources_changed()
                if self._arbiters.fleet.preemption:
                    self.resources_changed()  # what it has may be taken for a task that waits
            elif isinstance(record, _MAY_FREE):
                self._decide_soon()

    def let_go(self, run: RunId) -> None:
        """Forget the requests of a run that is not driven here any more."""
        for allocation, asked in list(self._asked.items()):
            if asked.runner.id == run:
                self.withdraw(allocation)

    # --- what changes -----------------------------------------------------------------------------

    def resources_changed(self) -> None:
        """Look again at what waits: a resource is free, or is not available any more."""
        if any(not each.chosen or each.preempts for each in self._asked.values()):
            self._decide_soon()

    def on_telemetry(self) -> None:
        """Look again at what waits, `LOOK_AGAIN_US` after the last time."""
        if any(not each.chosen for each in self._asked.values()):
            self._look_after(LOOK_AGAIN_US)

    def _look_after(self, wait_us: int) -> None:
        if self._later is None:
            self._later = asyncio.create_task(self._look_later(wait_us))

    async def _look_later(self, wait_us: int) -> None:
        await self._clock.sleep_until(self._looked_us + wait_us)
        self._later = None
        self.resources_changed()

    def close(self) -> None:
        """Look no more."""
        if self._later is not None:
            self._later.cancel()

    # --- deciding ---------------------------------------------------------------------------------

    def _decide_soon(self) -> None:
        if not self._scheduled:
            self._scheduled = True
            asyncio.get_running_loop().call_soon(self._decide)

    def _decide(self) -> None:
        self._scheduled = False
        self._looked_us = self._clock.now_us()
        try:
            self._decide_all()
        except Exception as error:  # a bug in m2pem: what waits would wait for ever
            log.exception("the choice of resources: a bug in m2pem")
            for asked in self._asked.values():
                if not asked.chosen or asked.preempts:
                    asked.runner.fail(error)

    def _decide_all(self) -> None:
        if self._space is not None and self._asked and self._space.awaits_positions():
            self._look_after(LOOK_AGAIN_US // 5)
            return
        self._give_preempted()
        evaluator = RoleEvaluator(
            Candidates(self._arbiters.fleet, self._arbiters.graph, self._latest)
        )
        waiting = self._consider(evaluator)
        waiting.sort(key=lambda each: (-each.priority, each.request.at_us, each.request.id))
        requests = {
            each.request.id: Request(each.request.id, tuple(role.options for role in each.roles))
            for each in waiting
        }
        chosen, without_space = self._assign(waiting, requests)
        refusals = {
            number: _foremost(list(found.values()))
            for number, found in without_space.items()
            if number not in chosen
        }
        served = [each.request.id for each in waiting if each.request.id in chosen]
        given = {
            resource: Occupancy(request, label=self._label(request))
            for request, roles in chosen.items()
            for ids in roles.values()
            for resource in ids
        }
        for each in waiting:
            number = each.request.id
            if number in chosen:
                others = [other for other in served if other != number]
                self._give(each, chosen[number], others, without_space.get(number, {}))
            elif number in refusals:
                refusal = refusals[number]
                if refusal.wait_s is None or not any(
                    blocker.behavior in chosen for blocker in refusal.blockers
                ):  # else it is said when those behaviors are requested, by their names
                    self._refuse_space(each, refusal)
        left = [each for each in waiting if each.request.id not in chosen]
        lacking = [each for each in left if each.request.id not in refusals]
        for each, why in self._preempt(lacking, set(given)):
            if why is not None and why.wait_s is not None:
                refusals[each.request.id] = why
                self._refuse_space(each, why)
            else:
                self._refuse(each, given, evaluator, why)
        self._circles.look(left, refusals)

    def _assign(
        self, waiting: Sequence[ConsideredRequest], requests: dict[str, Request]
    ) -> tuple[
        dict[str, dict[str, tuple[ResourceId, ...]]], "dict[str, dict[ResourceId, Refusal]]"
    ]:
        """Choose for all requests that can be served, in their order. What is chosen has its space:
        it is chosen again without a vehicle that has not.

        Returns what is chosen, and by request why vehicles have no space for it, the best first.
        """
        space = self._space
        chosen = assign(list(requests.values()), self._order)
        if space is None:
            return chosen, {}
        refusals: dict[str, dict[ResourceId, Refusal]] = {}
        space.begin()
        while True:
            space.begin_round()
            for each in waiting:
                number = each.request.id
                if number not in chosen:
                    space.keep_back(number)
                    continue
                refusal = self._without_space(each, chosen[number])
                if refusal is not None:
                    refusals.setdefault(number, {})[refusal.vehicle] = refusal
                    requests[number] = _without(requests[number], refusal.vehicle)
                    break
            else:
                for number in chosen:
                    space.commit(number)
                return chosen, refusals
            chosen = assign(list(requests.values()), self._order)

    def _without_space(
        self, each: ConsideredRequest, chosen: Mapping[str, tuple[ResourceId, ...]]
    ) -> "Refusal | None":
        """Return why a request has no space with what is chosen for it; None: it has."""
        assert self._space is not None
        fleet, behavior = self._arbiters.fleet, behavior_of(each.request)
        resources = tuple(one for ids in self._filled(each, chosen).values() for one in ids)
        if not may_wait_for_space(fleet, behavior.type, behavior.name, resources):
            return None
        wanted = self._wanted(each, chosen)
        return None if wanted is None else self._space.refusal(*wanted)

    def _wanted(
        self, each: ConsideredRequest, chosen: Mapping[str, tuple[ResourceId, ...]]
    ) -> tuple[BehaviorRequest, BehaviorSpec] | None:
        """Return the behavior that is requested with what is chosen; None: it will be refused."""
        behavior = behavior_of(each.request)
        roles = self._filled(each, chosen)
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

    def _consider(self, evaluator: RoleEvaluator) -> list[ConsideredRequest]:
        found: list[ConsideredRequest] = []
        occupied = self._occupied()
        for allocation, asked in self._asked.items():
            state = asked.runner.run.state
            request = state.allocations.get(allocation)
            if asked.chosen or request is None or state.status is not RunStatus.RUNNING:
                continue
            try:
                task = self._task(evaluator, asked.runner, request, occupied)
                roles = tuple(evaluator.role(role, task) for role in task.behavior.roles)
            except ExpressionError as error:
                asked.runner.post(ResourcesNotFree(allocation, str(error), code="EXPRESSION"))
                continue
            except Exception as error:
                log.exception("%s: a bug in m2pem", allocation)
                asked.runner.fail(error)
                continue
            found.append(ConsideredRequest(asked, request, task, roles))
        return found

    def _task(
        self,
        evaluator: RoleEvaluator,
        runner: Runner,
        request: AllocationRequest,
        occupied: Mapping[ResourceId, Occupancy],
    ) -> Task:
        behavior, state = behavior_of(request), runner.run.state
        ending = {
            each.id for each in state.behaviors.values() if each.phase is BehaviorPhase.CANCELLING
        }
        # The run may preempt what it has cancelled itself, and has what it keeps for this task.
        ending |= {each.id for each in state.kept.values() if may_use(each, request.token)}
        if ending:
            occupied = {
                each: found for each, found in occupied.items() if found.holder not in ending
            }
        lost = request.token.lost_work
        return Task(
            behavior,
            self._place(evaluator.candidates, runner.id, behavior, request),
            reader(request.token),
            state.commanded,
            occupied,
            {} if lost is None else lost.resources,
            request.token.replacements or {},
        )

    def _occupied(self) -> dict[ResourceId, Occupancy]:
        """Return what is not free, and why; also what behaviors have been given that wait for
        their turn in the dispatcher."""
        requested = {
            resource: holders[-1]
            for runner in self._runners.values()
            for resource, holders in runner.run.state.held.items()
        }
        found: dict[ResourceId, Occupancy] = {}
        for resource in self._order:
            if withdrawn := self._availability.reason(resource):
                found[resource] = Occupancy(withdrawn=withdrawn)
                continue
            holder = self._availability.holder(resource)
            if not is_behavior(holder):
                holder = requested.get(resource) or holder
            if holder:
                found[resource] = Occupancy(holder, label=self._label(holder))
        return found

    def _label(self, holder: str) -> str:
        """Return words for a behavior or request; "" if it is not known."""
        label = holder_label(self._runners, holder)
        return f"{label} ({holder})" if label else ""

    def _place(
        self, candidates: Candidates, run: RunId, behavior: Behavior, request: AllocationRequest
    ) -> Place:
        """Return where the task begins; anywhere, if its parameters make no sense: its behavior is
        refused later, with the reason."""
        spec = self._spec(behavior)
        if spec is None:
            return Place()
        try:
            return candidates.place_of(self._parameters(spec, run, request))
        except ParameterError:
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
        found = (graph.spec(each, behavior.name, behavior.type) for each in self._order)
        return next((spec for spec in found if spec is not None), None)

    def _give(
        self,
        each: ConsideredRequest,
        chosen: Mapping[str, tuple[ResourceId, ...]],
        together_with: Sequence[str],
        without_space: Mapping[ResourceId, "Refusal"],
    ) -> None:
        answer, _ = self._hold_for(each, chosen, together_with, without_space)
        each.asked.runner.post(answer)

    def _hold_for(
        self,
        each: ConsideredRequest,
        chosen: Mapping[str, tuple[ResourceId, ...]],
        together_with: Sequence[str] = (),
        without_space: Mapping[ResourceId, "Refusal"] = MappingProxyType({}),
    ) -> tuple[ResourcesChosen, tuple[ResourceId, ...]]:
        """Hold what was chosen for a request; return the answer to it, and the resources."""
        roles = self._filled(each, chosen)
        resources = tuple(resource for ids in roles.values() for resource in ids)
        each.asked.chosen = True
        self._availability.adopt(resources, each.request.id)
        seen = [_excluding(role, without_space) for role in each.roles]
        considered = what_was_considered(seen, roles, together_with)
        return ResourcesChosen(each.request.id, dict(roles), considered), resources

    def _filled(
        self, each: ConsideredRequest, chosen: Mapping[str, tuple[ResourceId, ...]]
    ) -> dict[str, tuple[ResourceId, ...]]:
        """Return what fills each role, a named team, and what an operator named, in their order."""
        return {
            role.role.name: role.resources if role.named else chosen[role.role.name]
            for role in each.roles
            if role.role.name in chosen
        }

    def _refuse_space(self, each: ConsideredRequest, refusal: "Refusal") -> None:
        """Let a task wait for space, or throw its error."""
        blockers = [(blocker.vehicle, blocker.behavior) for blocker in refusal.blockers]
        lacks = (refusal.vehicle, refusal.space, blockers)
        if refusal.wait_s is not None and each.asked.lacks == lacks:
            return
        each.asked.lacks = lacks
        code = "" if refusal.wait_s is not None else REJECTED
        each.asked.runner.post(
            ResourcesNotFree(
                each.request.id, refusal.reason, holders_of(refusal), code, refusal.wait_s
            )
        )

    def _refuse(
        self,
        each: ConsideredRequest,
        given: Mapping[ResourceId, Occupancy],
        evaluator: RoleEvaluator,
        without_space: "Refusal | None" = None,
    ) -> None:
        """Let a task wait for its resources, or throw its error. `without_space`: why it takes none
        from other runs."""
        holders = {
            str(resource): holder
            for role in each.roles
            for resource in (*role.options.busy, *role.options.costs_s)
            if (holder := _holder(role, resource) or given.get(resource, Occupancy()).holder)
        }
        why = reason(each.roles, given)
        if without_space is not None:
            why = f"{why}; {without_space.vehicle} is not taken: {without_space.reason}"
        lacks = (holders, [(frozenset(role.excluded), _withdrawn(role)) for role in each.roles])
        waits = each.waits and not each.is_hopeless(evaluator)
        if waits and each.asked.lacks == lacks:
            return
        each.asked.lacks = lacks
        code = "" if waits else UNAVAILABLE
        each.asked.runner.post(ResourcesNotFree(each.request.id, why, holders, code))

    # --- preemption -------------------------------------------------------------------------------

    def _preempt(
        self, left: Sequence[ConsideredRequest], given: set[ResourceId]
    ) -> "list[tuple[ConsideredRequest, Refusal | None]]":
        """Take resources from other runs for requests that get none. Returns the requests for which
        that is not possible; with why, if they would have no space then.

        `given`: what others were given at the same moment.
        """
        if not self._arbiters.fleet.preemption:
            return [(each, None) for each in left]
        without: list[tuple[ConsideredRequest, Refusal | None]] = []
        behaviors = preemptible(self._runners.values(), self._latest)
        kept = set(given)
        for place, each in enumerate(left):
            holders = {
                resource: holder
                for holder in behaviors
                if holder.runner is not each.asked.runner and holder.priority < each.priority
                for resource in holder.resources
                if self._availability.holder(resource) in (None, holder.id)
            }
            before = [other.request.id for other in left[:place]]
            chosen, refusal = self._with_space(each, holders, kept, before)
            taken = [e for ids in (chosen or {}).values() for e in ids if e in holders]
            if chosen is None or not taken:
                kept.update(able for role in each.roles for able in role.options.costs_s)
                without.append((each, refusal))
                continue
            answer, resources = self._hold_for(each, chosen)
            kept.update(resources)
            self._take(each, {resource: holders[resource] for resource in taken})
            victims = frozenset(holders[resource].id for resource in taken)
            each.asked.preempts = Preempting(answer, resources, victims, self._wanted(each, chosen))
        return without

    def _with_space(
        self,
        each: ConsideredRequest,
        holders: Mapping[ResourceId, Holder],
        kept: set[ResourceId],
        before: Sequence[str],
    ) -> "tuple[dict[str, tuple[ResourceId, ...]] | None, Refusal | None]":
        """Choose resources for a request, also among those of `holders`, with which it has space
        when their behaviors have ended; that space is reserved. A vehicle whose task could not
        begin then is not taken from another run.

        Returns what is chosen, if anything; else why what could be taken has no space.
        """
        refusals: list[Refusal] = []
        without: set[ResourceId] = set()
        while True:
            chosen = choose(each.request.id, each.roles, holders, kept | without, self._order)
            taken = [e for ids in (chosen or {}).values() for e in ids if e in holders]
            if chosen is None or not taken:
                return None, _foremost(refusals) if refusals else None
            wanted = None if self._space is None else self._wanted(each, chosen)
            if self._space is None or wanted is None:
                return chosen, None
            ending = {holders[resource].id for resource in taken}
            refusal = self._space.refusal_after(*wanted, ending, before)
            if refusal is None:
                return chosen, None
            refusals.append(refusal)
            without.add(refusal.vehicle)

    def _take(self, each: ConsideredRequest, taken: Mapping[ResourceId, Holder]) -> None:
        """End the behaviors that have what a request gets, or the keeping of it, and tell the
        operators of both runs."""
        names = ", ".join(f"{name} is taken from {holder.label}" for name, holder in taken.items())
        has = {str(resource): holder.id for resource, holder in taken.items()}
        reason = f"{names}, whose priority is lower and which ends first"
        each.asked.lacks = None
        each.asked.runner.post(ResourcesNotFree(each.request.id, reason, has))
        ending: set[str] = set()
        for resource, holder in taken.items():
            kept = resource in holder.runner.run.state.kept
            if not kept and (holder.id in ending or not holder.goes_on):
                continue  # it ends already
            ending.add(holder.id)
            reason = (
                f"{resource} goes to {each.request.token.node.label} of {each.asked.runner.id}, "
                f"whose priority {each.priority} is greater than {holder.priority}"
            )
            holder.runner.post(BehaviorPreempted(holder.id, resource, each.request.id, reason))
            text = f"{holder.task} is preempted: {reason}"
            self._publish(Alert(holder.runner.id, PREEMPTED, text))

    def _give_preempted(self) -> None:
        """Give requests what was taken for them if the behaviors that had it have ended."""
        for allocation, asked in self._asked.items():
            preempts = asked.preempts
            if preempts is None:
                continue
            ended = not any(map(self._availability.is_held, preempts.behaviors))
            gone = any(self._availability.reason(each) for each in preempts.resources)
            if gone or (ended and not self._has_space(preempts)):
                # Lost, or taken by an operator, meanwhile; or another vehicle has come into the
                # space that was free: it is chosen again, among all that asks.
                asked.chosen, asked.preempts = False, None
                self._release(allocation)
            elif ended:
                asked.preempts = None
                asked.runner.post(preempts.answer)

    def _has_space(self, preempts: Preempting) -> bool:
        """Whether a task has space with the vehicles that were taken for it, where they stand."""
        if self._space is None or preempts.wanted is None:
            return True
        return self._space.refusal_after(*preempts.wanted, (), ()) is None


def _foremost(refusals: "Sequence[Refusal]") -> "Refusal":
    """Return which refusal a task gets: of the best vehicle for which it may wait, if any."""
    return next((each for each in refusals if each.wait_s is not None), refusals[0])


def _excluding(
    role: ConsideredRole, without_space: "Mapping[ResourceId, Refusal]"
) -> ConsideredRole:
    """Return a role whose candidates without space are excluded."""
    reasons = {each: why.reason for each, why in without_space.items() if each in role.resources}
    return replace(role, excluded={**role.excluded, **reasons}) if reasons else role


def _without(request: Request, vehicle: ResourceId) -> Request:
    """Return a request for which a vehicle is not free."""
    roles = tuple(
        replace(
            role,
            costs_s={each: cost for each, cost in role.costs_s.items() if each != vehicle},
            busy=[*role.busy, vehicle],
        )
        if vehicle in role.costs_s
        else role
        for role in request.roles
    )
    return Request(request.id, roles)


def _withdrawn(role: ConsideredRole) -> frozenset[ResourceId]:
    return frozenset(each for each, found in role.occupied.items() if found.withdrawn)


def _holder(role: ConsideredRole, resource: ResourceId) -> str:
    occupancy = role.occupied.get(resource)
    return occupancy.holder if occupancy is not None else ""
