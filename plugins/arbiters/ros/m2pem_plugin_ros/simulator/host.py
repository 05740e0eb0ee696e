"""One simulated vehicle with its nodes: it ends them and begins them again, as faults ask."""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any

from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.settings import DriverName
from m2pem_plugin_ros.simulator.clock import Pace, SimulatedClock
from m2pem_plugin_ros.simulator.faults import Troubles
from m2pem_plugin_ros.simulator.onboard_control import (
    NoWay,
    OnBoard,
    OwnLocalization,
    Way,
    make_way,
)
from m2pem_plugin_ros.simulator.topics import ODOMETRY_HZ, Ports
from m2pem_plugin_ros.simulator.traffic import Gate, GuardedRuntime, NodeGate
from m2pem_plugin_ros.simulator.vehicle import Vehicle

BASE_NODE = "base"
CLOSED_WITHIN_S = 5.0

logger = logging.getLogger(__name__)


class Host:
    """`vehicle`: what is true of it, which outlives its nodes. `troubles`: of its traffic.

    Two nodes, or sets of them: the base's own, with the sensors, and what steers on board.
    """

    def __init__(self, ros: RosRuntime, vehicle: Vehicle, clock: SimulatedClock) -> None:
        self.vehicle, self.troubles = vehicle, Troubles()
        self._ros, self._clock = ros, clock
        self._base: GuardedRuntime | None = None
        self._ports: Ports | None = None
        self._steering: GuardedRuntime | None = None
        self._gate: NodeGate | None = None
        self._way: Way = NoWay()
        self._localization = OwnLocalization(vehicle.spec, clock)
        self._pace = Pace(ODOMETRY_HZ)
        self._turn = asyncio.Lock()
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def driver(self) -> DriverName:
        """By what it is steered on board; BASE: by nothing."""
        return self.vehicle.spec.settings.driver

    @property
    def nav2(self) -> Any:
        """The simulated Nav2; None: there is none, or it is dead."""
        return self._way if self.driver is DriverName.NAV2 and self._steering else None

    async def open(self) -> None:
        """Begin its nodes."""
        await self._begin()

    async def close(self) -> None:
        """End its nodes in good order: it stands, and says what became of what it did."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        try:
            await self._end_steering(self._way.close)
        finally:
            self._end_base()

    def step(self, now_s: float, wall_dt_s: float) -> None:
        """Move on, and say what is due."""
        self.vehicle.pass_until(now_s)
        if not self.troubles.no_odometry and self._pace.is_due(now_s):
            self._localization.hear(self.vehicle.odometer.read(self._clock.now_us()))
        if self._ports is not None:
            self._ports.publish()
        if self._gate is not None:
            self._gate.step(now_s, wall_dt_s)

    # --- ending and beginning nodes ---------------------------------------------------------------

    def kill(self) -> None:
        """End all nodes, as a power failure would: they say nothing any more."""
        self._kill(base=True, steering=True)

    def kill_node(self) -> None:
        """End what steers on board, as a crash would; of a plain base, its only node."""
        alone = self.driver is DriverName.BASE
        self._kill(base=alone, steering=not alone)

    def start(self) -> None:
        """Begin those nodes that are not there. The vehicle is where it was."""
        self._do(self._start())

    def _kill(self, *, base: bool, steering: bool) -> None:
        if steering and self._steering is not None:
            self._steering.destroy()
        if base:
            self._end_base()
        if steering:
            self._do(self._bury())

    def _do(self, what: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(what)
        self._tasks.add(task)
        task.add_done_callback(self._done)

    def _done(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and (error := task.exception()) is not None:
            logger.error("%s: %s", self.vehicle.spec.name, error, exc_info=error)

    async def _bury(self) -> None:
        """End the tasks of a node that is dead."""
        async with self._turn:
            way = self._way
            # An m2pem node can be ended without a word. Whatever else wants to say something at
            # its end finds its entities gone.
            end = getattr(way, "drop", way.close)
            try:
                await self._end_steering(end)
            except Exception as error:
                logger.debug("%s: its node is gone: %r", self.vehicle.spec.name, error)

    async def _start(self) -> None:
        async with self._turn:
            await self._begin()

    async def _begin(self) -> None:
        spec = self.vehicle.spec
        namespace = spec.settings.namespace
        if self._base is None:
            self._base = GuardedRuntime(self._ros, Gate(self.troubles), BASE_NODE, namespace)
            self._ports = Ports(self._base, self.vehicle, self.troubles, self._clock)
        if self._steering is None and self.driver is not DriverName.BASE:
            gate = NodeGate(self.troubles)
            name = f"{self.driver}_node"
            self._steering, self._gate = GuardedRuntime(self._ros, gate, name, namespace), gate
            board = OnBoard(
                self.vehicle, self._steering, self._localization, self._clock, self.troubles
            )
            try:
                self._way = make_way(board)
                await self._way.open()
            except BaseException:  # nothing half open stays, so that it can be begun again
                self._steering.destroy()
                self._way, self._steering, self._gate = NoWay(), None, None
                raise

    async def _end_steering(self, end: Callable[[], Awaitable[None]]) -> None:
        steering = self._steering
        self._way, self._steering, self._gate = NoWay(), None, None
        try:
            async with asyncio.timeout(CLOSED_WITHIN_S):
                await end()
        except TimeoutError:
            logger.error("%s: what steers it on board does not end", self.vehicle.spec.name)
        finally:
            if steering is not None:
                steering.destroy()

    def _end_base(self) -> None:
        if self._base is not None:
            self._base.destroy()
        self._base = self._ports = None
