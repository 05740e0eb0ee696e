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
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from heapq import merge
from types import MappingProxyType
from typing import TYPE_CHECKING

from m2pem.allocation.assignment import Request, assign
from m2pem.allocation.candidates import LatestState
from m2pem.allocation.explanation import Lack, lack, reason, what_was_considered
from m2pem.allocation.needs import ConsideredRole, Occupancy
from m2pem.api.alerts import AlertSeverity
from m2pem.api.clock import Clock
from m2pem.api.runs import Alert, RunId
from m2pem.engine import records as r
from m2pem.engine.elements.allocations import behavior_of
from m2pem.engine.inputs import BehaviorPreempted, ResourcesChosen, ResourcesNotFree
from m2pem.executive.allocation_requests import AskedFor, ConsideredRequest, Preempting
from m2pem.executive.dispatcher import Geometries
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.preemption import Holder, choose, preemptible
from m2pem.executive.runner import Runner
from m2pem.executive.space_allocation import SpaceAllocation, holders_of
from m2pem.executive.waiting_circles import WaitingCircles
from m2pem.executive.waiting_queue import WaitingQueue
from m2pem.fleet.allocation import Availability
from m2pem.fleet.space import may_wait_for_space
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.losses import PREEMPTED, UNAVAILABLE

if TYPE_CHECKING:
    from m2pem.deconfliction.conflicts import Refusal

REJECTED = "REJECTED"
"""The error of a task whose behavior another vehicle is in the way of, and which does not wait."""

log = logging.getLogger("m2pem.executive")

LOOK_AGAIN_US = 500_000
"""Telemetry makes the allocator look again at what waits after that time, in microseconds."""

_MAY_FREE = (
    r.RunPaused,
    r.RunResumed,
    r.ResourceReturned,
    r.OperatorGaveControlBack,
    r.BehaviorCancelRequested,
)
"""Records after which a task may get what it could not get before: of the run, or of another one
where a task of the run keeps nothing more from it."""


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
        self._runners = runners
        self._publish = publish
        self._space = space
        in_turn = space is None and not arbiters.fleet.preemption
        self._queue = WaitingQueue(
            arbiters, availability, latest, geometries, runners, in_turn=in_turn
        )
        self._scheduled = False
        self._later: asyncio.Task[None] | None = None
        self._looked_us = 0
        self._circles = WaitingCircles(runners, arbiters.graph, publish)
        self._named_holders: set[str] = set()
        self._must_look = True
        self._reads_telemetry = True

    # --- what runs ask ----------------------------------------------------------------------------

    def ask(self, runner: Runner, allocation: str, *, again: bool) -> None:
        """Choose resources for a request; the run gets the answer as an input.

        `again`: what was chosen for it had been taken meanwhile.
        """
        asked = self._queue.asked.setdefault(allocation, AskedFor(runner))
        if again and asked.chosen:
            asked.chosen, asked.preempts = False, None
            self._release(allocation)
        self._decide_soon()

    def withdraw(self, allocation: str) -> None:
        """Forget a request: its task needs no resources any more."""
        if self._queue.asked.pop(allocation, None) is not None:
            self._release(allocation)

    def _release(self, allocation: str) -> None:
        if self._space is not None:
            self._space.release(allocation)
        self._availability.release(allocation)

    def on_records(self, records: Sequence[r.Record]) -> None:
        """Hand what is held for a request to the behavior that was requested for it."""
        for record in records:
            if isinstance(record, r.BehaviorRequested):
                if self._queue.asked.pop(record.allocation, None) is not None:
                    # Tasks that wait were told that the request has its resources.
                    self._must_look |= record.allocation in self._named_holders
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
        for allocation, asked in list(self._queue.asked.items()):
            if asked.runner.id == run:
                self.withdraw(allocation)

    # --- what changes -----------------------------------------------------------------------------

    def resources_changed(self) -> None:
        """Look again at what waits: a resource is free, or is not available any more."""
        if any(not each.chosen or each.preempts for each in self._queue.asked.values()):
            self._decide_soon()

    def on_telemetry(self) -> None:
        """Look again at what waits, `LOOK_AGAIN_US` after the last time, if telemetry may decide
        what it gets."""
        may_decide = self._must_look or self._reads_telemetry
        if may_decide and any(not each.chosen for each in self._queue.asked.values()):
            self._look_after(LOOK_AGAIN_US)

    def _look_after(self, wait_us: int) -> None:
        if self._later is None:
            self._later = asyncio.create_task(self._look_later(wait_us))

    async def _look_later(self, wait_us: int) -> None:
        await self._clock.sleep_until(self._looked_us + wait_us)
        self._later = None
        self._looked_us = self._clock.now_us()
        if self._must_look or self._queue.evaluator.telemetry_changes_candidates():
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
            for asked in self._queue.asked.values():
                if not asked.chosen or asked.preempts:
                    asked.runner.fail(error)

    def _decide_all(self) -> None:
        if self._space is not None and self._queue.asked and self._space.awaits_positions():
            self._look_after(LOOK_AGAIN_US // 5)
            return
        self._give_preempted()
        waiting, behind = self._queue.consider()
        preempts = self._arbiters.fleet.preemption
        requests = {
            each.request.id: Request(
                each.request.id,
                tuple(role.options for role in each.roles),
                # One that does not get what it needs now may take the rest from other runs.
                waits=each.waits or preempts,
                in_turn=each.in_turn,
            )
            for each in waiting
        }
        chosen, without_space, kept = self._assign(waiting, requests)
        refusals = {
            number: _foremost(list(found.values()))
            for number, found in without_space.items()
            if number not in chosen
        }
        served = [each.request.id for each in waiting if each.request.id in chosen]
        given = {
            resource: Occupancy(request, label=self._queue.label(request))
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
        considered = [role for each in (*left, *behind) for role in each.roles]
        self._reads_telemetry = any(role.reads_telemetry for role in considered)
        self._must_look = (
            self._space is not None
            or self._arbiters.fleet.preemption
            or any(role.reads_task for role in considered)
        )
        self._named_holders.clear()
        for each, no_space in self._preempt(left, set(refusals), set(given)):
            if no_space is not None and no_space.wait_s is not None:
                refusals[each.request.id] = no_space
                self._refuse_space(each, no_space)
            else:
                self._refuse(each, self._lack(each, given), given, no_space)
        of_queues: dict[int, Lack] = {}
        for each in behind:
            roles = id(each.roles)
            if roles not in of_queues:
                of_queues[roles] = self._lack(each, given)
            self._refuse(each, of_queues[roles], given)
        reasons = {
            number: [each, *without_space.get(number, {}).values()]
            for number, each in refusals.items()
        }
        self._circles.look(list(merge(left, behind, key=_place)), reasons, kept)

    def _assign(
        self, waiting: Sequence[ConsideredRequest], requests: dict[str, Request]
    ) -> tuple[
        dict[str, dict[str, tuple[ResourceId, ...]]],
        "dict[str, dict[ResourceId, Refusal]]",
        dict[ResourceId, str],
    ]:
        """Choose for all requests that can be served, in their order. What is chosen has its space:
        it is chosen again without a vehicle that has not.

        Returns what is chosen; by request why vehicles have no space for it, the best first; and
        what is kept from later ones, with the request that waits.
        """
        space = self._space
        kept: dict[ResourceId, str] = {}
        chosen = assign(list(requests.values()), self._queue.order, kept)
        if space is None:
            return chosen, {}, kept
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
                    keeps = space.kept_with(number)
                    requests[number] = _not_free(requests[number], refusal.vehicle, keeps)
                    break
            else:
                for number in chosen:
                    space.commit(number)
                return chosen, refusals, kept
            kept.clear()
            chosen = assign(list(requests.values()), self._queue.order, kept)

    def _without_space(
        self, each: ConsideredRequest, chosen: Mapping[str, tuple[ResourceId, ...]]
    ) -> "Refusal | None":
        """Return why a request has no space with what is chosen for it; None: it has."""
        assert self._space is not None
        fleet, behavior = self._arbiters.fleet, behavior_of(each.request)
        resources = tuple(one for ids in each.filled(chosen).values() for one in ids)
        if not may_wait_for_space(fleet, behavior.type, behavior.name, resources):
            return None
        wanted = self._queue.behavior_request(each, chosen)
        return None if wanted is None else self._space.refusal(*wanted)

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
        roles = each.filled(chosen)
        resources = tuple(resource for ids in roles.values() for resource in ids)
        each.asked.chosen = True
        self._availability.adopt(resources, each.request.id)
        seen = [_excluding(role, without_space) for role in each.roles]
        considered = what_was_considered(seen, roles, together_with)
        return ResourcesChosen(each.request.id, dict(roles), considered), resources

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

    def _lack(self, each: ConsideredRequest, given: Mapping[ResourceId, Occupancy]) -> Lack:
        lacks = lack(each.roles, given)
        self._named_holders.update(lacks.holders.values())
        return lacks

    def _refuse(
        self,
        each: ConsideredRequest,
        lacks: Lack,
        given: Mapping[ResourceId, Occupancy],
        without_space: "Refusal | None" = None,
    ) -> None:
        """Let a task wait for its resources, or throw its error. `without_space`: why it takes none
        from other runs."""
        waits = each.waits and not each.is_hopeless(self._queue.evaluator)
        if waits and each.asked.lacks == lacks:
            return
        each.asked.lacks = lacks
        code = "" if waits else UNAVAILABLE
        why = reason(each.roles, given)
        if without_space is not None:
            why = f"{why}; {without_space.vehicle} is not taken: {without_space.reason}"
        each.asked.runner.post(ResourcesNotFree(each.request.id, why, lacks.holders, code))

    # --- preemption -------------------------------------------------------------------------------

    def _preempt(
        self,
        left: Sequence[ConsideredRequest],
        without_space: Collection[str],
        given: Collection[ResourceId],
    ) -> "list[tuple[ConsideredRequest, Refusal | None]]":
        """Take resources from other runs for requests that get none. Returns the requests for which
        that is not possible; with why, if they would have no space then.

        `left`: all that waits. `without_space`: those of them that wait for space alone. `given`:
        what others were given at the same moment.
        """
        if not self._arbiters.fleet.preemption:
            return [(each, None) for each in left if each.request.id not in without_space]
        without: list[tuple[ConsideredRequest, Refusal | None]] = []
        behaviors = preemptible(self._runners.values(), self._latest)
        kept = set(given)
        for place, each in enumerate(left):
            if each.request.id in without_space:
                kept.update(() if self._space is None else self._space.kept_with(each.request.id))
                continue
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
            each.asked.preempts = Preempting(
                answer, resources, victims, self._queue.behavior_request(each, chosen)
            )
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
            chosen = choose(each.request.id, each.roles, holders, kept | without, self._queue.order)
            taken = [e for ids in (chosen or {}).values() for e in ids if e in holders]
            if chosen is None or not taken:
                return None, _foremost(refusals) if refusals else None
            wanted = None if self._space is None else self._queue.behavior_request(each, chosen)
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
            self._publish(
                Alert(holder.runner.id, PREEMPTED, text, AlertSeverity.NOTICE, (resource,))
            )

    def _give_preempted(self) -> None:
        """Give requests what was taken for them if the behaviors that had it have ended."""
        for allocation, asked in self._queue.asked.items():
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


def _place(each: ConsideredRequest) -> tuple[int, int, int, str]:
    return each.asked.look_at(each.request)


def _foremost(refusals: "Sequence[Refusal]") -> "Refusal":
    """Return which refusal a task gets: of the best vehicle for which it may wait, if any."""
    return next((each for each in refusals if each.wait_s is not None), refusals[0])


def _excluding(
    role: ConsideredRole, without_space: "Mapping[ResourceId, Refusal]"
) -> ConsideredRole:
    """Return a role whose candidates without space are excluded."""
    reasons = {each: why.reason for each, why in without_space.items() if each in role.resources}
    return role.excluding(reasons) if reasons else role


def _not_free(request: Request, vehicle: ResourceId, keeps: Sequence[ResourceId]) -> Request:
    """Return a request for which a vehicle is not free. `keeps`: what it keeps as it waits."""
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
    return replace(request, roles=roles, keeps=keeps)
