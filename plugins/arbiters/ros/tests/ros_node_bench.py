"""A NodeDriver with somebody to tell, for tests."""

import asyncio
import logging
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from typing import Any, cast
from uuid import UUID, uuid4, uuid5

from m2pem_interfaces.msg import VehicleStatus
from m2pem_plugin_ros.drivers.driver import DriverSetup, Order, Outcome
from m2pem_plugin_ros.drivers.node import NodeDriver
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.settings import Settings, Via

from m2pem.api import ArbiterContext, BehaviorRequest, BehaviorState, Connection, ResourceId, Value
from m2pem.api.clock import SystemClock

AMPLE_S = 40.0
LOOK_S = 0.005


class RecordedEvents:
    """Implements `DriverEvents`: writes down what a driver tells."""

    def __init__(self) -> None:
        self.times_heard = 0
        self.begun: list[UUID] = []
        self.left: list[tuple[UUID, Mapping[str, Value]]] = []
        self.ends: list[tuple[UUID, Outcome]] = []
        self.newer: list[tuple[str, int]] = []

    def alive(self) -> None:
        self.times_heard += 1

    def progress(self, goal: UUID) -> None:
        if goal not in self.begun:
            self.begun.append(goal)

    def remains(self, goal: UUID, remaining: Mapping[str, Value]) -> None:
        self.left.append((goal, remaining))

    def ended(self, goal: UUID, outcome: Outcome) -> None:
        self.ends.append((goal, outcome))

    def superseded(self, run: str, newest: int) -> None:
        self.newer.append((run, newest))


class Bench:
    """The driver of one vehicle, and what it has told."""

    def __init__(self, ros: RosRuntime, vehicle: str, via: Via, speed: float = 1.0) -> None:
        self.events = RecordedEvents()
        self.ros = ros
        self.clock = SystemClock(speed)
        logger = logging.getLogger("m2pem.test")
        context = ArbiterContext(self.clock, cast("Any", None), logger, (38.0, -77.0, 60.0))
        self.vehicle = ResourceId(vehicle)
        settings = Settings(f"/{vehicle}", via=via)
        connection = Connection(self.vehicle, "ground")
        setup = DriverSetup(connection, settings, context, ros, cast("Any", None), self.events)
        self.driver = NodeDriver(setup)
        self.statuses = 0
        ros.subscribe(VehicleStatus, f"/{vehicle}/vehicle_status", self._count, qos.STATUS)

    def order(self, behavior: str, *, preempts: tuple[UUID, ...] = (), **parameters: Any) -> Order:
        """An order of a run of its own."""
        return self.order_of(uuid4(), 1, behavior, preempts=preempts, **parameters)

    def order_of(
        self,
        run: UUID,
        epoch: int,
        behavior: str,
        *,
        preempts: tuple[UUID, ...] = (),
        **parameters: Any,
    ) -> Order:
        goal = uuid5(run, f"{uuid4()}")
        request = BehaviorRequest(f"r1.{goal}", epoch, behavior, parameters, (self.vehicle,))
        return Order(request, goal, run, preempts)

    def begin(self, behavior: str, **parameters: Any) -> Order:
        order = self.order(behavior, **parameters)
        self.driver.begin(order)
        return order

    async def until(self, holds: Callable[[], object]) -> None:
        """Wait for a condition."""
        async with asyncio.timeout(AMPLE_S):
            while not holds():  # noqa: ASYNC110  # what is waited for has no event
                await asyncio.sleep(LOOK_S)

    async def alive(self) -> None:
        """Wait until the vehicle was heard."""
        await self.until(lambda: self.events.times_heard)

    async def later(self) -> None:
        """Wait until the vehicle has said some more of how it is, which it does after all that was
        heard of behaviors by now: `begun` is up to date then."""
        before = self.statuses
        await self.until(lambda: self.statuses >= before + 3)

    async def running(self, order: Order) -> None:
        """Wait until the vehicle does it."""
        await self.until(lambda: order.goal in self.events.begun)

    async def end_of(self, order: Order) -> Outcome:
        """How it ended."""
        await self.until(lambda: order.goal in [goal for goal, _ in self.events.ends])
        return next(outcome for goal, outcome in self.events.ends if goal == order.goal)

    def _count(self, _: object) -> None:
        self.statuses += 1

    @property
    def begun(self) -> int:
        """How often the vehicle has begun something, by its own count; 0 if it was not heard."""
        return int(self.driver.health.mode.removeprefix("begun ") or 0)


@asynccontextmanager
async def bench(
    domain: int, vehicle: str, via: Via = Via.TOPICS, speed: float = 1.0
) -> AsyncIterator[Bench]:
    """A driver that is open."""
    async with RosRuntime("tested", domain_id=domain) as ros:
        made = Bench(ros, vehicle, via, speed)
        await made.driver.open()
        try:
            yield made
        finally:
            await made.driver.close()


SUCCEEDED = BehaviorState.SUCCEEDED
CANCELLED = BehaviorState.CANCELLED
FAILED = BehaviorState.FAILED
REJECTED = BehaviorState.REJECTED
LOST = BehaviorState.LOST
RUNNING = BehaviorState.RUNNING
UNKNOWN = BehaviorState.UNKNOWN
