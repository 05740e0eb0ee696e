"""A driver for an m2pem node that executes behaviors by an arbiter on board.

It makes a node of any arbiter of one vehicle or payload.
"""

import asyncio
import logging
from collections.abc import Awaitable, Coroutine, Mapping
from contextlib import suppress
from typing import Any
from uuid import UUID

from m2pem.api import (
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
    adjusts,
)
from m2pem.api.latest_task import LatestTask, cancel_and_wait
from m2pem_plugin_ros.drivers.driver import DriverEvents, Health, Order, Outcome

EPOCH = 1
"""The node checks the epochs of runs itself."""

FIRST_CONTACT_WITHIN_S = 1.5
"""A START waits this long in real time for states on `target`, which DDS may deliver later."""


class ArbiterDriver:
    """Implements `Driver`. `arbiter` is not connected yet. `bus` is the bus of the arbiter's
    context, which receives the states on `target`."""

    def __init__(
        self,
        arbiter: Arbiter,
        resource: ResourceId,
        events: DriverEvents,
        bus: FleetBus,
        logger: logging.Logger,
    ) -> None:
        self._arbiter = arbiter
        self._resource = resource
        self._events = events
        self._bus = bus
        self._logger = logger
        self._state: VehicleState | PayloadState | None = None
        self._current: UUID | None = None
        self._calls: asyncio.Queue[Coroutine[Any, Any, Awaitable[str] | None]] = asyncio.Queue()
        self._tasks: list[asyncio.Task[None]] = []
        self._answers = LatestTask()

    # --- life -----------------------------------------------------------------------------------

    async def open(self) -> None:
        """Connect the arbiter."""
        await self._arbiter.connect()
        create = asyncio.get_running_loop().create_task
        works = (self._call(), self._read_reports(), self._read_states())
        self._tasks = [create(work) for work in works]

    async def close(self) -> None:
        await cancel_and_wait(*self._tasks)
        await self._answers.close()
        while not self._calls.empty():
            self._calls.get_nowait().close()
        await self._arbiter.close()

    @property
    def state(self) -> PayloadState | None:
        """The last state of the payload; None if there is none, or for a vehicle."""
        return self._state if isinstance(self._state, PayloadState) else None

    @property
    def health(self) -> Health:
        """The health of a vehicle by the arbiter. A payload is ready when it has a state."""
        if isinstance(self._state, VehicleState):
            own = self._state
            return Health(own.mode, own.ready, own.not_ready_reasons, own.battery_fraction)
        return Health(ready=True if self._state is not None else None)

    def refusal(self, request: BehaviorRequest) -> str:
        """Return "". The arbiter rejects a request itself when it is started."""
        return ""

    # --- orders ---------------------------------------------------------------------------------

    def begin(self, order: Order) -> None:
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
        self._calls.put_nowait(self._arbiter.cancel(str(goal), EPOCH))

    def adjust(self, goal: UUID, parameters: Mapping[str, ResolvedValue]) -> None:
        if adjusts(self._arbiter):
            self._calls.put_nowait(self._arbiter.adjust(str(goal), EPOCH, parameters))

    def hold(self) -> None:
        self._calls.put_nowait(self._arbiter.hold(self._resource))

    def resume(self) -> None:
        self._calls.put_nowait(self._arbiter.resume(self._resource))

    async def query(self, order: Order) -> Outcome:
        return _outcome(await self._arbiter.query(str(order.goal), None))

    def claim(self, run: UUID, epoch: int) -> None:
        """Do nothing: the node checks the epochs itself."""

    def abandon(self) -> None:
        if (goal := self._current) is not None:
            self.end(goal)

    # --- inside ---------------------------------------------------------------------------------

    async def _call(self) -> None:
        """Make the calls to the arbiter one after the other."""
        while True:
            call = await self._calls.get()
            try:
                answer = await call
            except Exception:  # an error of the arbiter must not end the node
                self._logger.exception("%s: its arbiter failed", self._resource)
                continue
            if answer is not None:
                self._answers.add(self._answered(answer))

    async def _answered(self, answer: Awaitable[str]) -> None:
        """Log that parameters were not taken. The next call does not wait for the answer."""
        if wrong := await answer:
            self._logger.warning("%s may go on as before: %s", self._resource, wrong)

    async def _start(self, request: BehaviorRequest, goal: UUID) -> None:
        try:
            await self._wait_for_states(request)
            await self._arbiter.start(request)
        except Exception as error:
            reason = f"internal error of the arbiter on board: {error!r}"
            self._events.ended(goal, Outcome(BehaviorState.FAILED, reason=reason))
            raise

    async def _wait_for_states(self, request: BehaviorRequest) -> None:
        """Wait for the states of all vehicles that the request needs, or for
        FIRST_CONTACT_WITHIN_S."""
        carrier, of_a_vehicle, _ = self._resource.partition("/")
        values = request.parameters.values()
        named = [value.vehicle for value in values if isinstance(value, VehiclePosition)]
        missing = {ResourceId(name) for name in (*named, *([carrier] if of_a_vehicle else ()))}
        missing -= {name for name in missing if self._bus.latest(name) is not None}
        with suppress(TimeoutError):
            async with asyncio.timeout(FIRST_CONTACT_WITHIN_S):
                states = self._bus.subscribe()
                while missing:
                    state = await anext(states)
                    if isinstance(state, VehicleState):
                        missing.discard(state.resource)

    async def _read_reports(self) -> None:
        async for report in self._arbiter.reports():
            goal = UUID(report.id)
            if report.state is BehaviorState.RUNNING:
                self._events.progress(goal)
                if report.remaining is not None:
                    self._events.remains(goal, report.remaining)
            elif report.state.terminal:
                if goal == self._current:
                    self._current = None
                self._events.ended(goal, _outcome(report))

    async def _read_states(self) -> None:
        async for state in self._arbiter.telemetry():
            if isinstance(state, VehicleState | PayloadState) and state.resource == self._resource:
                self._state = state
                if state.link is not LinkState.LOST:
                    self._events.alive()


def _outcome(report: BehaviorReport) -> Outcome:
    if report.state is BehaviorState.REJECTED:  # the node has reported the acceptance by then
        return Outcome(BehaviorState.FAILED, report.code, report.reason)
    return Outcome(report.state, report.code, report.reason, report.outputs)
