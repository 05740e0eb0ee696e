"""A simulated vehicle with its nodes, which faults kill and start."""

import asyncio
import logging
from typing import Any

from m2pem.api.clock import Clock, RateTimer
from m2pem.api.latest_task import LatestTask
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.settings import DriverName
from m2pem_plugin_ros.simulator.faults import TrafficFaults
from m2pem_plugin_ros.simulator.onboard_control import (
    ControlContext,
    OnboardControl,
    SimulatedLocalization,
    make_onboard_control,
)
from m2pem_plugin_ros.simulator.topics import ODOMETRY_HZ, BaseTopics
from m2pem_plugin_ros.simulator.traffic import FilteredRuntime, NodeTrafficFilter, TrafficFilter
from m2pem_plugin_ros.simulator.vehicle import Vehicle

BASE_NODE = "base"
CLOSED_WITHIN_S = 5.0

logger = logging.getLogger(__name__)


class SimulatedVehicle:
    """Runs the nodes of a vehicle. `vehicle` is its physical state, which outlives the nodes.
    `traffic_faults` apply to their messages.

    There are two sets of nodes: those of the base and its sensors, and those of the onboard
    control.
    """

    def __init__(self, ros: RosRuntime, vehicle: Vehicle, clock: Clock) -> None:
        self.vehicle, self.traffic_faults = vehicle, TrafficFaults()
        self._ros, self._clock = ros, clock
        self._base: FilteredRuntime | None = None
        self._topics: BaseTopics | None = None
        self._steering: FilteredRuntime | None = None
        self._traffic_filter: NodeTrafficFilter | None = None
        self._onboard_control: OnboardControl | None = None
        self._localization = SimulatedLocalization(vehicle.spec, clock)
        self._rate_timer = RateTimer(ODOMETRY_HZ)
        self._turn = asyncio.Lock()
        self._tasks = LatestTask(
            lambda error: logger.error("%s: %s", vehicle.spec.name, error, exc_info=error)
        )

    @property
    def driver(self) -> DriverName:
        """The driver; BASE: there is no onboard control."""
        return self.vehicle.spec.settings.driver

    @property
    def nav2(self) -> Any:
        """The simulated Nav2; None if there is none, or it is killed."""
        return self._onboard_control if self.driver is DriverName.NAV2 and self._steering else None

    async def open(self) -> None:
        """Start the nodes."""
        await self._begin()

    async def close(self) -> None:
        """Stop the nodes in order: the vehicle stops, and the end of its behavior is published."""
        await self._tasks.close()
        try:
            await self._end_steering()
        finally:
            self._end_base()

    def step(self, now_s: float, wall_dt_s: float) -> None:
        """Advance the vehicle, and publish what is due."""
        self.vehicle.pass_until(now_s)
        if not self.traffic_faults.no_odometry and self._rate_timer.is_due(now_s):
            self._localization.hear(self.vehicle.odometer.read(self._clock.now_us()))
        if self._topics is not None:
            self._topics.publish()
        if self._traffic_filter is not None:
            self._traffic_filter.step(now_s, wall_dt_s)

    # --- ending and beginning nodes ---------------------------------------------------------------

    def kill(self) -> None:
        """Kill all nodes without a last message, as a power failure would."""
        self._kill(base=True, steering=True)

    def kill_node(self) -> None:
        """Kill the onboard control, as a crash would; of a plain base, its only node."""
        alone = self.driver is DriverName.BASE
        self._kill(base=alone, steering=not alone)

    def start(self) -> None:
        """Start the nodes that are missing. The vehicle is where it was."""
        self._tasks.add(self._start())

    def _kill(self, *, base: bool, steering: bool) -> None:
        if steering and self._steering is not None:
            self._steering.destroy()
        if base:
            self._end_base()
        if steering:
            self._tasks.add(self._end_dead_node())

    async def _end_dead_node(self) -> None:
        """End the tasks of a killed node."""
        async with self._turn:
            try:
                await self._end_steering(is_dead=True)
            except Exception as error:
                logger.debug("%s: its node is gone: %r", self.vehicle.spec.name, error)

    async def _start(self) -> None:
        async with self._turn:
            await self._begin()

    async def _begin(self) -> None:
        spec = self.vehicle.spec
        namespace = spec.settings.namespace
        if self._base is None:
            self._base = FilteredRuntime(
                self._ros, TrafficFilter(self.traffic_faults), BASE_NODE, namespace
            )
            self._topics = BaseTopics(self._base, self.vehicle, self.traffic_faults, self._clock)
        if self._steering is None and self.driver is not DriverName.BASE:
            traffic_filter = NodeTrafficFilter(self.traffic_faults)
            name = f"{self.driver}_node"
            self._steering = FilteredRuntime(self._ros, traffic_filter, name, namespace)
            self._traffic_filter = traffic_filter
            context = ControlContext(
                self.vehicle, self._steering, self._localization, self._clock, self.traffic_faults
            )
            try:
                self._onboard_control = make_onboard_control(context)
                await self._onboard_control.open()
            except BaseException:  # nothing half open stays, so that it can be begun again
                self._steering.destroy()
                self._onboard_control = self._steering = self._traffic_filter = None
                raise

    async def _end_steering(self, *, is_dead: bool = False) -> None:
        control, steering = self._onboard_control, self._steering
        self._onboard_control = self._steering = self._traffic_filter = None
        if control is None or steering is None:
            return
        # A dead m2pem node ends without a word. Whatever else wants to say something at its end
        # finds its entities gone.
        end = getattr(control, "drop", control.close) if is_dead else control.close
        try:
            async with asyncio.timeout(CLOSED_WITHIN_S):
                await end()
        except TimeoutError:
            logger.error("%s: what steers it on board does not end", self.vehicle.spec.name)
        finally:
            steering.destroy()

    def _end_base(self) -> None:
        if self._base is not None:
            self._base.destroy()
        self._base = self._topics = None
