"""Lost vehicles whose link returns: each must stop before it counts as free.

Such a vehicle may still drive.

What it did when its link was lost has ended for its mission (LINK_LOST). The vehicle does not know
that, and goes on with it. So m2pem commands it to stop, at once and until it has acknowledged;
operators see why it is not ready meanwhile, and afterwards that it is held.

After a restart of the executive, the journals of resumed runs say which vehicles were lost before,
and marks beside the journal which were lost by runs that are over.
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, replace

from m2pem.api.arbiter import Arbiter, BehaviorId, reclaims
from m2pem.api.bus import FleetBus
from m2pem.api.clock import Clock
from m2pem.api.telemetry import LinkState, PayloadState, VehicleState
from m2pem.engine.state import OutOfReach
from m2pem.errors import StaleCommandError
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.handover import Handover
from m2pem.executive.lost_marks import LostMark, LostMarks
from m2pem.fleet.allocation import Availability, is_behavior
from m2pem.mission.catalogue import BehaviorState, ResourceId

log = logging.getLogger("m2pem.executive")

AGAIN_S = 1.0
"""After so long m2pem commands a resource that has not acknowledged again."""

ONCE_WITHIN_S = 15.0
"""An arbiter that has not returned by then is asked again."""

SAY_EVERY = 10
"""A reason that stays the same is logged the first time, and then each time of so many."""


RETURNED = "returned: held"
"""How a resource is shown that has returned and stopped, until it is commanded again."""


@dataclass(frozen=True, slots=True)
class _Lost:
    """What a lost resource may still do; None: nothing is known of it. `is_earlier`: it was lost
    before this executive began, whose arbiters do not know that; `native_ref` as in reports."""

    behavior: BehaviorId | None
    is_earlier: bool = False
    native_ref: str | None = None


class LostResources:
    """The resources whose link was lost, until they are free again.

    `epoch_of`: with which epoch the run of a behavior is driven here. `out_of_reach`: what a
    resource does that is being lost, by the runs that are driven here. `why_not_served`: "", or why
    another executive may command the vehicles by now. `bus`: what faces, operators, metrics and
    requirements read; it gets a state of all that is lost. `returned`: is called when a resource
    has returned and stopped. `marks`: of what is lost, for the next executive.
    """

    def __init__(
        self,
        arbiters: FleetArbiters,
        availability: Availability,
        handover: Handover,
        clock: Clock,
        epoch_of: Callable[[BehaviorId], int],
        out_of_reach: Callable[[ResourceId], OutOfReach | None],
        why_not_served: Callable[[], Awaitable[str]],
        bus: FleetBus,
        returned: Callable[[ResourceId, str], None],
        marks: LostMarks,
    ) -> None:
        self._arbiters = arbiters
        self._availability = availability
        self._handover = handover
        self._clock = clock
        self._epoch_of = epoch_of
        self._out_of_reach = out_of_reach
        self._why_not_served = why_not_served
        self._bus = bus
        self._returned = returned
        self._marks = marks
        self._held: set[ResourceId] = set()
        self._lost: dict[ResourceId, _Lost] = {}
        self._stopping: dict[ResourceId, asyncio.Task[None]] = {}
        handover.why_not_free = self._why_not_free
        self._silent: dict[ResourceId, str] = {}
        self._why: dict[ResourceId, str] = {}
        self._said: dict[ResourceId, VehicleState | PayloadState] = {}

    def lost(self, resource: ResourceId, reason: str) -> None:
        """The link of a resource is lost: withdraw it until it has returned and stopped."""
        stopping = self._stopping.pop(resource, None)
        if stopping is not None:
            stopping.cancel()
        elif self._availability.reason(resource) and not self._availability.is_lent(resource):
            self._publish_lost(resource)
            return  # an operator has it, or it is manned: what it does is theirs
        commands = self._is_commanded(resource)
        holder = self._availability.holder(resource)
        if commands or resource not in self._lost:
            self._lost[resource] = _Lost(holder if commands else None)
            if (was := self._out_of_reach(resource)) is not None:
                self._mark(resource, was.behavior, was.native_ref)
        self._withdraw(resource, reason)

    def lost_before(
        self, resource: ResourceId, behavior: BehaviorId, native_ref: str | None
    ) -> None:
        """A resource was lost before the executive was started again, and may still do what it was
        commanded: withdraw it until it has returned and stopped."""
        if resource in self._lost:
            return
        self._lost[resource] = _Lost(behavior, is_earlier=True, native_ref=native_ref)
        self._mark(resource, behavior, native_ref)
        self._withdraw(resource, _why_lost(behavior))

    def take_up(self, resources: Iterable[ResourceId]) -> None:
        """Withdraw what the marks say that runs which are over have lost."""
        for resource in resources:
            mark = self._marks.get(resource)
            if mark is not None:
                log.warning("%s: %s; it is stopped when it is received", resource, mark.why)
                lost = _Lost(mark.behavior, is_earlier=True, native_ref=mark.native_ref)
                self._lost[resource] = lost
                self._withdraw(resource, mark.why)

    def is_lost_since_before(self, resource: ResourceId) -> bool:
        """Whether a resource was lost before the executive was started again, was not received
        since then, and does nothing for a run that was resumed."""
        lost = self._lost.get(resource)
        if lost is None or resource in self._stopping:
            return False
        return lost.is_earlier and not self._is_commanded(resource)

    def epoch_before(self, behavior: BehaviorId) -> int:
        """Return with which epoch the run of a behavior was driven that a lost resource may still
        do, when it was lost; 0: none does it."""
        for resource, lost in self._lost.items():
            if lost.behavior == behavior and (mark := self._marks.get(resource)) is not None:
                return mark.epoch
        return 0

    def _mark(self, resource: ResourceId, behavior: BehaviorId, native_ref: str | None) -> None:
        epoch, why = self._epoch_of(behavior), _why_lost(behavior)
        self._marks.put(resource, LostMark(behavior, native_ref, epoch, why))

    def _withdraw(self, resource: ResourceId, reason: str) -> None:
        self._why.pop(resource, None)
        self._held.discard(resource)
        self._silent[resource] = f"lost: {reason}"
        if resource not in self._handover.taken:
            self._availability.withdraw(resource, self._silent[resource])
        self._publish_lost(resource)

    def shown(self, resource: ResourceId) -> str:
        """Return how a resource is that was lost: why it is not free, or that it is held. "": it
        was not lost, or does something else by now."""
        if why := self._why_not_free(resource):
            return why
        if resource not in self._held:
            return ""
        if resource in self._handover.taken or self._is_commanded(resource):
            self._held.discard(resource)
            return ""
        return RETURNED

    def on_telemetry(self, state: VehicleState | PayloadState) -> None:
        """A resource published its state. If its link was lost, stop it from now on."""
        resource = state.resource
        if resource not in self._lost or resource in self._stopping or _is_not_received(state):
            return
        about = {"resource": resource, "notice": True}
        what = self._what(resource)
        log.warning("%s: its link is restored; it must end %s", resource, what, extra=about)
        self._explain(
            resource, f"its link is restored, and it must first end {self._what(resource)}"
        )
        task = asyncio.get_running_loop().create_task(self._stop(resource))
        self._stopping[resource] = task

    def annotated(self, state: VehicleState | PayloadState) -> VehicleState | PayloadState:
        """Return the state as operators see it: not ready, and why, until it is free; then that it
        is held, until it is commanded again."""
        resource = state.resource
        if resource in self._silent and resource not in self._why:
            state = replace(state, link=LinkState.LOST)
        why = self.shown(resource) or ("lost" if state.link is LinkState.LOST else "")
        if resource in self._why:
            self._said[resource] = state
        if not why or not isinstance(state, VehicleState):
            return state
        ready = state.ready if why == RETURNED else False
        return replace(state, ready=ready, not_ready_reasons=(why, *state.not_ready_reasons))

    async def close(self) -> None:
        """Stop nothing more."""
        tasks = list(self._stopping.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await self._marks.close()

    # --- inside ---------------------------------------------------------------------------------

    async def _stop(self, resource: ResourceId) -> None:
        before, times = "", 0
        while why := await self._end_command(resource):
            self._explain(resource, why)
            times = times + 1 if why == before else 0
            if times % SAY_EVERY == 0:
                log.warning("%s: its link is restored, and it is not free yet: %s", resource, why)
            before = why
            await self._clock.sleep(AGAIN_S)
        ended = self._what(resource)
        del self._lost[resource], self._silent[resource], self._stopping[resource]
        self._why.pop(resource, None)
        self._marks.remove(resource)
        self._held.add(resource)
        self._handover.restore(resource)
        self._returned(resource, f"it has ended {ended}")
        if (said := self._said.pop(resource, None)) is not None:
            self._bus.publish(self.annotated(said))
        now = self._availability.reason(resource) or "free"
        log.warning(
            "%s: its link is restored, it has ended what it did before, and is %s",
            resource,
            now,
            extra={"resource": resource, "notice": True},
        )

    async def _end_command(self, resource: ResourceId) -> str:
        """Have it stop; returns "" when it has acknowledged, else why it is not free."""
        arbiter = self._arbiters.of(resource)
        try:
            async with asyncio.timeout(ONCE_WITHIN_S):
                # A link counts as lost after this process stood still, too.
                if why := await self._why_not_served():
                    return f"it is not commanded to stop: {why}"
                lost = self._lost[resource]
                if lost.is_earlier and self._is_commanded(resource):
                    return ""  # a run that was resumed later has it: it had returned
                if lost.is_earlier and (why := await self._end_earlier(arbiter, resource, lost)):
                    return why
                if reclaims(arbiter):
                    return await arbiter.reclaim(resource)
                if lost.behavior is not None:
                    # Of a run that is not driven here any more, the hold that follows is enough.
                    with suppress(StaleCommandError):
                        await arbiter.cancel(lost.behavior, self._epoch_of(lost.behavior))
                if resource not in self._handover.taken:
                    await arbiter.hold(resource)
        except TimeoutError:
            return f"it has not acknowledged within {ONCE_WITHIN_S:g} s that it must stop"
        except Exception as error:  # an arbiter's fault must not make a vehicle free
            log.exception("%s: the arbiter raised", resource)
            return f"it cannot be commanded to stop: {type(error).__name__}: {error}"
        return ""

    async def _end_earlier(self, arbiter: Arbiter, resource: ResourceId, lost: _Lost) -> str:
        """End what an earlier executive commanded: the arbiter looks at the resource, which may
        still do it. Returns "" when it has ended, else why it is not free."""
        assert lost.behavior is not None
        report = await arbiter.query(lost.behavior, lost.native_ref)
        if report.state in (BehaviorState.ACCEPTED, BehaviorState.RUNNING):
            try:
                await arbiter.cancel(lost.behavior, self._epoch_of(lost.behavior))
            except StaleCommandError:
                await arbiter.hold(resource)
                return ""
            return f"its link is restored, and it still does {lost.behavior}, which is cancelled"
        if report.state is BehaviorState.UNKNOWN and resource not in self._handover.taken:
            await arbiter.hold(resource)
        return ""

    def _publish_lost(self, resource: ResourceId) -> None:
        state = self._bus.latest(resource) or _nothing_received(resource, self._clock.now_us())
        # What it said before the loss may have changed; its time stays that of its position.
        if isinstance(state, VehicleState):
            state = replace(state, link=LinkState.LOST, not_ready_reasons=())
        else:
            state = replace(state, link=LinkState.LOST, detections=())
        self._bus.publish(self.annotated(state))

    def _explain(self, resource: ResourceId, why: str) -> None:
        self._why[resource] = why
        if resource not in self._handover.taken:
            self._availability.withdraw(resource, why)

    def _is_commanded(self, resource: ResourceId) -> bool:
        """Whether a behavior has it; what an incident or a run keeps for later does nothing new."""
        return is_behavior(self._availability.holder(resource))

    def _why_not_free(self, resource: ResourceId) -> str:
        return self._why.get(resource) or self._silent.get(resource, "")

    def _what(self, resource: ResourceId) -> str:
        return self._lost[resource].behavior or "what it did before"


def _is_not_received(state: VehicleState | PayloadState) -> bool:
    """Whether the link is lost, or its arbiter still looks for a vehicle: the state says nothing
    of it."""
    if state.link is not LinkState.DEGRADED or not isinstance(state, VehicleState):
        return state.link is LinkState.LOST
    return (state.position, state.battery_fraction, state.armed) == (None, None, None)


def _nothing_received(resource: ResourceId, now_us: int) -> VehicleState | PayloadState:
    return (PayloadState if "/" in resource else VehicleState)(resource, now_us)


def _why_lost(behavior: BehaviorId) -> str:
    return f"the link was lost before a restart, when it did {behavior}"
