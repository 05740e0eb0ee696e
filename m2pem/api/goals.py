"""A base class of arbiters for vehicles that have one goal at a time and report their state."""

import asyncio
import uuid
from collections.abc import AsyncIterator, Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

from m2pem.api.arbiter import (
    ArbiterContext,
    BehaviorId,
    BehaviorReport,
    BehaviorRequest,
    Connection,
    Limits,
)
from m2pem.api.async_queue import AsyncQueue
from m2pem.api.behavior_tracker import BehaviorTracker
from m2pem.api.capabilities import ArbiterCapabilities
from m2pem.api.latest_task import cancel_and_wait
from m2pem.api.telemetry import PayloadState, VehicleState
from m2pem.mission.catalogue import BehaviorSpec, BehaviorState, ResourceId
from m2pem.mission.values import Value

STATES_WAITING = 1000
CONNECT_WITHIN_S = 2.0
RETRY_AFTER_S = 0.5


class GoalArbiter:
    """Implements the contract of `Arbiter` for subclasses that only communicate with vehicles.

    A subclass has `behaviors` and `bounds`, and implements `listen`, `begin`, `end`, `hold` and
    `resume`. It passes each state of a vehicle to `receive`. A goal is a text, unique forever, that
    identifies a behavior on the vehicle: after a restart the behavior is found again by it. When no
    state arrives, the vehicle's behavior ends as LOST. All times are those of the context's clock.
    """

    capabilities: ClassVar[ArbiterCapabilities] = ArbiterCapabilities()
    behaviors: ClassVar[Sequence[BehaviorSpec]] = ()
    bounds: ClassVar[Limits] = Limits()

    def __init__(
        self, connections: Mapping[ResourceId, Connection], context: ArbiterContext
    ) -> None:
        self.connections = connections
        self.context = context
        self._ledger = BehaviorTracker(self.catalogue, context.logger)
        self._states: AsyncQueue[VehicleState | PayloadState] = AsyncQueue(STATES_WAITING)
        self._behaviors: dict[str, BehaviorId] = {}
        self._goals: dict[ResourceId, str] = {}
        self._received_us: dict[ResourceId, int] = {}
        self._all_received = asyncio.Event()
        self._tasks: list[asyncio.Task[None]] = []

    # --- methods that a subclass implements -----------------------------------------------------

    async def listen(self, resource: ResourceId) -> None:
        """Connect to a resource and pass its states to `receive`, as long as the link lasts.

        It is called again soon after it returns or raises OSError.
        """
        raise NotImplementedError

    def refusal(self, request: BehaviorRequest) -> str:
        """Why a request that fits the catalogue cannot be done; "" if it can."""
        return ""

    async def begin(self, request: BehaviorRequest, goal: str) -> None:
        """Send the resources a goal, in place of their present one."""
        raise NotImplementedError

    async def end(self, resource: ResourceId, goal: str) -> None:
        """Cancel a goal of a resource, if it still has it."""
        raise NotImplementedError

    async def hold(self, resource: ResourceId) -> None:
        """Bring the resource to a stand, and keep its goal."""
        raise NotImplementedError

    async def resume(self, resource: ResourceId) -> None:
        """Let the resource go on to its goal."""
        raise NotImplementedError

    def held(self, resource: ResourceId) -> bool:
        """Whether the resource reports that it is held. Override it if a hold outlives this process
        on the vehicle; it is called after a restart."""
        return False

    # --- methods that a subclass calls ----------------------------------------------------------

    def receive(
        self,
        state: VehicleState | PayloadState,
        goal: str = "",
        became: BehaviorState | None = None,
        code: str = "",
        reason: str = "",
        remaining: Mapping[str, Value] | None = None,
    ) -> None:
        """Process a state of a resource, and its present or last goal.

        `became`: how the goal ended (SUCCEEDED, FAILED with a `code`, CANCELLED); None before its
        end. `remaining`: what is left of it, as in `BehaviorReport`. The same values may be passed
        repeatedly.
        """
        self._states.put(state)
        self._received_us[state.resource] = self.context.clock.now_us()
        if len(self._received_us) == len(self.connections):
            self._all_received.set()
        self._goals[state.resource] = goal
        if behavior := self._behaviors.get(goal):
            self._ledger.progress(behavior)
            if remaining is not None:
                self._ledger.remains(behavior, remaining)
            if became is not None:
                self._ledger.end(behavior, became, code, reason)

    # --- the protocol ---------------------------------------------------------------------------

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """Return `behaviors`, for every resource."""
        return self.behaviors

    def limits(self, resource: ResourceId) -> Limits:
        """Return `bounds`, for every resource."""
        return self.bounds

    async def connect(self) -> None:
        """Connect to all resources; return when each has sent a state, or soon."""
        create = asyncio.get_running_loop().create_task
        self._tasks = [create(self._listen_on(resource)) for resource in self.connections]
        self._tasks += [create(self._watch(resource)) for resource in self.connections]
        all_received = create(self._all_received.wait())
        late = asyncio.ensure_future(self.context.clock.sleep(CONNECT_WITHIN_S))
        await asyncio.wait([all_received, late], return_when=asyncio.FIRST_COMPLETED)
        await cancel_and_wait(all_received, late)

    async def start(self, request: BehaviorRequest) -> None:
        """`begin`, unless the request is known, past, refused, or for a busy resource."""
        goal = uuid.uuid4().hex
        if self._ledger.admit(request, goal, self.refusal):
            self._behaviors[goal] = request.id
            await self.begin(request, goal)

    async def cancel(self, behavior: BehaviorId, epoch: int) -> None:
        """`end` on each resource that the behavior holds."""
        if self._ledger.may_cancel(behavior, epoch):
            goal = self._ledger.last(behavior).native_ref or ""
            for resource in self.connections:
                if self._ledger.holder(resource) == behavior:
                    await self.end(resource, goal)

    async def query(self, behavior: BehaviorId, native_ref: str | None) -> BehaviorReport:
        """Return the known state; after a restart, find the behavior by the resources' goals."""
        self._ledger.fence(behavior, self.context.epoch_of(behavior))
        holders = [resource for resource, goal in self._goals.items() if goal == native_ref]
        if native_ref and holders and native_ref not in self._behaviors:
            self._behaviors[native_ref] = behavior
            self._ledger.adopt(behavior, holders, native_ref)
        known = self._ledger.last(behavior)
        return known if known.state.terminal else replace(known, held=any(map(self.held, holders)))

    def reports(self) -> AsyncIterator[BehaviorReport]:
        """Reports as they come, for one reader, until `close`."""
        return self._ledger.reports()

    def telemetry(self) -> AsyncIterator[VehicleState | PayloadState]:
        """States as they come; a slow reader misses old ones."""
        return self._states.read()

    async def close(self) -> None:
        """Close all connections. Vehicles go on with their goals."""
        await cancel_and_wait(*self._tasks)
        self._tasks = []
        self._states.close()
        self._ledger.close()

    # --- inside ---------------------------------------------------------------------------------

    async def _listen_on(self, resource: ResourceId) -> None:
        while True:
            try:
                await self.listen(resource)
            except OSError as error:
                self.context.logger.info("%s: %s", resource, error)
            except Exception:  # a fault of one vehicle must not affect the others
                self.context.logger.exception("%s: cannot be understood", resource)
            await self.context.clock.sleep(RETRY_AFTER_S)

    async def _watch(self, resource: ResourceId) -> None:
        # A whole number: of less than a microsecond no clock would wait to the end.
        bound_us = round(self.limits(resource).lost_after_s * 1_000_000)
        last_us = self.context.clock.now_us()
        while True:
            last_us = self._received_us.get(resource, last_us)
            silent_us = self.context.clock.now_us() - last_us
            if silent_us >= bound_us:
                self._ledger.lose(resource, f"no telemetry for {silent_us / 1_000_000:.1f} s")
            wait_us = bound_us - silent_us if silent_us < bound_us else bound_us
            await self.context.clock.sleep(wait_us / 1_000_000)
