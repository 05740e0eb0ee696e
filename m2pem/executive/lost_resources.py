"""Lost vehicles whose link returns: each must stop before it counts as free.

Such a vehicle may still drive.

What it did when its link was lost has ended for its mission (LINK_LOST). The vehicle does not know
that, and goes on with it. So m2pem commands it to stop, at once and until it has acknowledged;
operators see why it is not ready meanwhile.
"""

import asyncio
import logging
from collections.abc import Callable
from dataclasses import replace

from m2pem.api.arbiter import BehaviorId, reclaims
from m2pem.api.clock import Clock
from m2pem.api.telemetry import LinkState, PayloadState, VehicleState
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.handover import Handover
from m2pem.fleet.allocation import Availability
from m2pem.mission.catalogue import ResourceId

log = logging.getLogger("m2pem.executive")

AGAIN_S = 1.0
"""After so long m2pem commands a resource that has not acknowledged again."""

ONCE_WITHIN_S = 15.0
"""An arbiter that has not returned by then is asked again."""

SAY_EVERY = 10
"""A reason that stays the same is logged the first time, and then each time of so many."""


class LostResources:
    """The resources whose link was lost, until they are free again.

    `epoch_of`: with which epoch the run of a behavior is driven here. `show`: to operators, how a
    resource is.
    """

    def __init__(
        self,
        arbiters: FleetArbiters,
        availability: Availability,
        handover: Handover,
        clock: Clock,
        epoch_of: Callable[[BehaviorId], int],
        show: Callable[[VehicleState | PayloadState], None],
    ) -> None:
        self._arbiters = arbiters
        self._availability = availability
        self._handover = handover
        self._clock = clock
        self._epoch_of = epoch_of
        self._show = show
        self._lost: dict[ResourceId, BehaviorId | None] = {}
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
        elif self._availability.reason(resource):
            return  # an operator has it, or it is manned: what it does is theirs
        holder = self._availability.holder(resource) or self._lost.get(resource)
        self._lost[resource] = holder
        self._why.pop(resource, None)
        self._silent[resource] = f"lost: {reason}"
        if resource not in self._handover.taken:
            self._availability.withdraw(resource, self._silent[resource])

    def on_telemetry(self, state: VehicleState | PayloadState) -> None:
        """A resource published its state. If its link was lost, stop it from now on."""
        resource = state.resource
        if resource not in self._lost or state.link is LinkState.LOST:
            return
        if resource in self._stopping:
            return
        log.warning("%s: its link is restored; it must end %s", resource, self._what(resource))
        self._explain(
            resource, f"its link is restored, and it must first end {self._what(resource)}"
        )
        task = asyncio.get_running_loop().create_task(self._stop(resource))
        self._stopping[resource] = task

    def annotated(self, state: VehicleState | PayloadState) -> VehicleState | PayloadState:
        """Return the state as operators see it: not ready, and why, until it is free."""
        why = self._why.get(state.resource)
        if why is None:
            return state
        self._said[state.resource] = state
        if not isinstance(state, VehicleState):
            return state
        return replace(state, ready=False, not_ready_reasons=(why, *state.not_ready_reasons))

    async def close(self) -> None:
        """Stop nothing more."""
        tasks = list(self._stopping.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

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
        del self._lost[resource], self._silent[resource], self._stopping[resource]
        self._why.pop(resource, None)
        self._handover.restore(resource)
        if (said := self._said.pop(resource, None)) is not None:
            self._show(said)
        now = self._availability.reason(resource) or "free"
        log.warning(
            "%s: its link is restored, it has ended what it did before, and is %s", resource, now
        )

    async def _end_command(self, resource: ResourceId) -> str:
        """Have it stop; returns "" when it has acknowledged, else why it is not free."""
        arbiter = self._arbiters.of(resource)
        try:
            async with asyncio.timeout(ONCE_WITHIN_S):
                if reclaims(arbiter):
                    return await arbiter.reclaim(resource)
                behavior = self._lost[resource]
                if behavior is not None:
                    await arbiter.cancel(behavior, self._epoch_of(behavior))
                if resource not in self._handover.taken:
                    await arbiter.hold(resource)
        except TimeoutError:
            return f"it has not acknowledged within {ONCE_WITHIN_S:g} s that it must stop"
        except Exception as error:  # an arbiter's fault must not make a vehicle free
            log.exception("%s: the arbiter raised", resource)
            return f"it cannot be commanded to stop: {type(error).__name__}: {error}"
        return ""

    def _explain(self, resource: ResourceId, why: str) -> None:
        self._why[resource] = why
        if resource not in self._handover.taken:
            self._availability.withdraw(resource, why)

    def _why_not_free(self, resource: ResourceId) -> str:
        return self._why.get(resource) or self._silent.get(resource, "")

    def _what(self, resource: ResourceId) -> str:
        return self._lost[resource] or "what it did before"
