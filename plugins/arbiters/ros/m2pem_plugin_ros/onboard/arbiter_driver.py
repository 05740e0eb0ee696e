"""A driver for an m2pem node that has its behaviors done by an arbiter on board.

So any arbiter of one vehicle or payload becomes a node that others command over ROS.
"""

import asyncio
import logging
from collections.abc import Coroutine, Mapping
from contextlib import suppress
from typing import Any
from uuid import UUID

from m2pem.api import (
    AdjustingArbiter,
    Arbiter,
    BehaviorReport,
    BehaviorRequest,
    BehaviorState,
    FleetBus,
    LinkState,
    PayloadState,
    ResolvedValue,
    ResourceId,
    VehiclePosition,
    VehicleState,
)
from m2pem_plugin_ros.drivers.driver import Health, Order, Outcome, Told

EPOCH = 1
"""The node looks after the epochs of runs itself."""

HEARD_WITHIN_S = 1.5
"""Of real time: so long a START waits for what `target` says, which DDS may bring later than it."""


class ArbiterDriver:
    """Implements `Driver`. `arbiter`: not connected yet; `resource` is what it is asked about.
    `bus`: the one that it was lent, which has what is heard on `target`."""

    def __init__(
        self,
        arbiter: Arbiter,
        resource: ResourceId,
        told: Told,
        bus: FleetBus,
        logger: logging.Logger,
    ) -> None:
        self._arbiter = arbiter
        self._resource = resource
        self._told = told
        self._bus = bus
        self._logger = logger
        self._state: VehicleState | PayloadState | None = None
        self._current: UUID | None = None
        self._calls: asyncio.Queue[Coroutine[Any, Any, None]] = asyncio.Queue()
        self._tasks: list[asyncio.Task[None]] = []

    # --- life -----------------------------------------------------------------------------------

    async def open(self) -> None:
        """Connect the arbiter; what it commands need not be there yet."""
        await self._arbiter.connect()
        create = asyncio.get_running_loop().create_task
        works = (self._call(), self._read_reports(), self._read_states())
        self._tasks = [create(work) for work in works]

    async def close(self) -> None:
        """Let go."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        while not self._calls.empty():
            self._calls.get_nowait().close()
        await self._arbiter.close()

    @property
    def state(self) -> PayloadState | None:
        """Where the payload looks, as the arbiter said last; None: it did not, or is no payload."""
        return self._state if isinstance(self._state, PayloadState) else None

    @property
    def health(self) -> Health:
        """Of a vehicle what the arbiter says; of a payload that it can be commanded."""
        if isinstance(self._state, VehicleState):
            own = self._state
            return Health(own.mode, own.ready, own.not_ready_reasons, own.battery_fraction)
        return Health(ready=True if self._state is not None else None)

    def refusal(self, request: BehaviorRequest) -> str:
        """The arbiter says so itself, when it is asked to begin: that is a failure `REJECTED`."""
        return ""

    # --- orders ---------------------------------------------------------------------------------

    def begin(self, order: Order) -> None:
        """Have the arbiter do this, in place of what it does."""
        before, self._current = self._current, order.goal
        preempts = tuple(str(goal) for goal in dict.fromkeys((*order.preempts, before)) if goal)
        request = BehaviorRequest(
            str(order.goal),
            EPOCH,
            order.request.behavior,
            order.request.parameters,
            (self._resource,),
            {},
            preempts,
        )
        self._calls.put_nowait(self._start(request, order.goal))

    def end(self, goal: UUID) -> None:
        """Have the arbiter end this."""
        self._calls.put_nowait(self._arbiter.cancel(str(goal), EPOCH))

    def adjust(self, goal: UUID, parameters: Mapping[str, ResolvedValue]) -> None:
        """Have the arbiter change it, if it can."""
        if isinstance(self._arbiter, AdjustingArbiter):
            self._calls.put_nowait(self._arbiter.adjust(str(goal), EPOCH, parameters))

    def hold(self) -> None:
        """Have it stand still."""
        self._calls.put_nowait(self._arbiter.hold(self._resource))

    def resume(self) -> None:
        """Have it go on."""
        self._calls.put_nowait(self._arbiter.resume(self._resource))

    async def look(self, order: Order) -> Outcome:
        """What the arbiter says of a goal."""
        return _outcome(await self._arbiter.query(str(order.goal), None))

    def forget(self) -> None:
        """What it does is nobody's any more."""
        if (goal := self._current) is not None:
            self.end(goal)

    # --- inside ---------------------------------------------------------------------------------

    async def _call(self) -> None:
        """One call after the other, in the order in which they were asked for."""
        while True:
            call = await self._calls.get()
            try:
                await call
            except Exception:  # of the arbiter; it must not make the node deaf
                self._logger.exception("%s: its arbiter", self._resource)

    async def _start(self, request: BehaviorRequest, goal: UUID) -> None:
        try:
            await self._know(request)
            await self._arbiter.start(request)
        except Exception as error:
            reason = f"the arbiter on board is wrong: {error!r}"
            self._told.ended(goal, Outcome(BehaviorState.FAILED, reason=reason))
            raise

    async def _know(self, request: BehaviorRequest) -> None:
        """Wait until it was heard where the vehicles are that matter, or not much longer."""
        carrier, of_a_vehicle, _ = self._resource.partition("/")
        values = request.parameters.values()
        named = [value.vehicle for value in values if isinstance(value, VehiclePosition)]
        missing = {ResourceId(name) for name in (*named, *([carrier] if of_a_vehicle else ()))}
        missing -= {name for name in missing if self._bus.latest(name) is not None}
        with suppress(TimeoutError):
            async with asyncio.timeout(HEARD_WITHIN_S):
                states = self._bus.subscribe()
                while missing:
                    state = await anext(states)
                    if isinstance(state, VehicleState):
                        missing.discard(state.resource)

    async def _read_reports(self) -> None:
        async for report in self._arbiter.reports():
            goal = UUID(report.id)
            if report.state is BehaviorState.RUNNING:
                self._told.progress(goal)
            elif report.state.terminal:
                if goal == self._current:
                    self._current = None
                self._told.ended(goal, _outcome(report))

    async def _read_states(self) -> None:
        async for state in self._arbiter.telemetry():
            if isinstance(state, VehicleState | PayloadState) and state.resource == self._resource:
                self._state = state
                if state.link is not LinkState.LOST:
                    self._told.heard()


def _outcome(report: BehaviorReport) -> Outcome:
    if report.state is BehaviorState.REJECTED:  # the node has said by then that it is accepted
        return Outcome(BehaviorState.FAILED, report.code, report.reason)
    return Outcome(report.state, report.code, report.reason, report.outputs)
