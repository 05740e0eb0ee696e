"""Many simulated vehicles in one process, and the ROS parameter `fault` of the node /m2pem_sim."""

import asyncio
import logging
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import TimeoutError as NoAnswerError
from dataclasses import replace
from functools import partial
from typing import Any, Self

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult

from m2pem.api import US_PER_S, SystemClock
from m2pem.api.faults import FaultError, FaultSchedule, PlannedFault
from m2pem.api.latest_task import cancel_and_wait
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.runtime.ros_clock import RosClock
from m2pem_plugin_ros.simulator.faults import GRAMMAR, FaultTarget, check
from m2pem_plugin_ros.simulator.host import SimulatedVehicle
from m2pem_plugin_ros.simulator.specification import VehicleSpec
from m2pem_plugin_ros.simulator.vehicle import Vehicle

TICK_S = 0.02
"""Period in which vehicles are advanced and publish, in real time: at most 50 Hz."""

LATE_S = 0.2
"""Real seconds. If the process was suspended for longer, the rest is not simulated, as no vehicle
could be controlled meanwhile."""

COMMANDS_WITHIN_S = 0.5
"""A base needs at least this time without commands to stop, in real seconds."""

NODE = "m2pem_sim"


class Simulation:
    """The simulated vehicles. `speed`: simulated seconds in a real second. `async with` opens and
    closes it.

    `domain_id`: for vehicles whose settings have none; None takes ROS_DOMAIN_ID. If the node has
    `use_sim_time`, simulated time is that of /clock: it stands until the first message.

    Raises:
        ValueError: there is none, or two have the same name or namespace.
        FaultError: a fault is for a vehicle that is not there, or cannot happen to it.
    """

    def __init__(
        self,
        specs: Sequence[VehicleSpec],
        *,
        speed: float = 1.0,
        domain_id: int | None = None,
        faults: Iterable[PlannedFault[FaultTarget]] = (),
        seed: int = 0,
    ) -> None:
        _check(specs)
        self.clock: SystemClock | RosClock = SystemClock(speed)
        self._start_us = self.clock.now_us()
        self._specs, self._domain_id, self._seed = specs, domain_id, seed
        self._hosts: dict[str, SimulatedVehicle] = {}
        self._runtimes: dict[int | None, RosRuntime] = {}
        self._schedule = FaultSchedule()
        self._planned = tuple(faults)
        for fault in self._planned:
            self.check(fault)
        self._now_s = 0.0
        self._left_out_s = 0.0
        self._task: asyncio.Task[None] | None = None

    def __getitem__(self, name: str) -> SimulatedVehicle:
        return self._hosts[name]

    def __iter__(self) -> Iterator[SimulatedVehicle]:
        return iter(self._hosts.values())

    async def __aenter__(self) -> Self:
        try:
            self._take_clock(self._runtime(self._specs[0]))
            for spec in self._specs:
                vehicle = Vehicle(_patient(spec, self.clock.speed), self._seed)
                simulated = SimulatedVehicle(self._runtime(spec), vehicle, self.clock)
                self._hosts[spec.name] = simulated
                await simulated.open()
        except BaseException:
            await self._close()
            raise
        self._now_s = self._elapsed_s
        for fault in self._planned:
            self.plan(fault)
        self._task = asyncio.create_task(self._run())
        return self

    async def __aexit__(self, *_: object) -> None:
        await cancel_and_wait(self._task)
        await self._close()

    async def stopped(self) -> None:
        """Wait for its end, which is always an error.

        Raises:
            Exception: whatever ended it.
        """
        if self._task is not None:
            await asyncio.shield(self._task)

    # --- faults -----------------------------------------------------------------------------------

    def check(self, fault: PlannedFault[FaultTarget]) -> None:
        """Check that a fault can happen.

        Raises:
            FaultError: one of its vehicles is not there, or it cannot happen to it.
        """
        specs = {spec.name: spec for spec in self._specs}
        for name in fault.targets_among(specs):
            check(fault, specs[name])

    def plan(self, fault: PlannedFault[FaultTarget]) -> None:
        """Plan a fault. Its time counts from now.

        Raises:
            FaultError: one of its vehicles is not there, or it cannot happen to it.
        """
        self.check(fault)
        for name in fault.targets_among(self._hosts):
            self._after(fault.at_s or 0.0, partial(fault.start, self[name], self._after))

    def _after(self, seconds: float, call: Callable[[], object]) -> None:
        if seconds <= 0:
            call()
        else:
            self._schedule.at(self._now_s + seconds, call)

    # --- time -------------------------------------------------------------------------------------

    @property
    def _elapsed_s(self) -> float:
        """Simulated seconds since the simulation was made."""
        return (self.clock.now_us() - self._start_us) / US_PER_S

    def _take_clock(self, ros: RosRuntime) -> None:
        """Let simulated time follow /clock, if the node is to."""
        if not ros.uses_sim_time:
            return
        if self.clock.speed != 1.0:
            raise ValueError(
                "with use_sim_time, the vehicles are as fast as /clock: leave --speed out"
            )
        self.clock = RosClock(ros)
        self._start_us = 0

    async def _run(self) -> None:
        if isinstance(self.clock, RosClock):
            await self.clock.wait_until_begun()
            self._start_us = self.clock.now_us()
        loop = asyncio.get_running_loop()
        last_s = due_s = loop.time()
        while True:
            due_s = max(due_s + TICK_S, loop.time())
            await asyncio.sleep(due_s - loop.time())
            wall_s = loop.time()
            late_s = max(0.0, wall_s - last_s - LATE_S)
            self._left_out_s += late_s * self.clock.speed
            self._now_s = self._elapsed_s - self._left_out_s
            for simulated in self:
                simulated.step(self._now_s, wall_s - last_s)
            last_s = wall_s
            self._schedule.run_until(self._now_s)

    # --- ROS --------------------------------------------------------------------------------------

    def _runtime(self, spec: VehicleSpec) -> RosRuntime:
        domain = spec.settings.domain_id
        domain = self._domain_id if domain is None else domain
        if domain not in self._runtimes:
            self._runtimes[domain] = RosRuntime(NODE, domain_id=domain)
            FaultParameter(self._runtimes[domain].node, self.plan)
        return self._runtimes[domain]

    async def _close(self) -> None:
        await asyncio.gather(*(simulated.close() for simulated in self), return_exceptions=True)
        await asyncio.gather(*(ros.close() for ros in self._runtimes.values()))


def _patient(spec: VehicleSpec, speed: float) -> VehicleSpec:
    """Raise the command timeout for a fast clock, on which the time between two commands is
    long."""
    timeout_s = max(spec.chassis.command_timeout_s, COMMANDS_WITHIN_S * speed)
    return replace(spec, chassis=replace(spec.chassis, command_timeout_s=timeout_s))


def _check(specs: Sequence[VehicleSpec]) -> None:
    if not specs:
        raise ValueError("there are no vehicles")
    for number, spec in enumerate(specs):
        for other in specs[:number]:
            if spec.name == other.name:
                raise ValueError(f"two vehicles are called {spec.name}")
            mine, theirs = spec.settings, other.settings
            if (mine.namespace, mine.domain_id) == (theirs.namespace, theirs.domain_id):
                raise ValueError(
                    f"{other.name} and {spec.name} share the namespace {mine.namespace}"
                )


PARAMETER = "fault"
EXAMPLE = "evsg1: silent at 20 s for 5 s"
WITHIN_S = 2.0

logger = logging.getLogger(__name__)


class FaultParameter:
    """The ROS parameter `fault`. Setting it plans a fault, or fails with what is wrong."""

    def __init__(self, node: Any, plan: Callable[[PlannedFault[FaultTarget]], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._plan = plan
        said = f"What goes wrong, such as {EXAMPLE!r}; setting it plans it."
        node.declare_parameter(PARAMETER, "", ParameterDescriptor(description=said))
        node.add_on_set_parameters_callback(self._set)

    def _set(self, parameters: Any) -> Any:
        """Plan the fault on the loop, and wait for it. It is called in the thread of ROS."""
        for parameter in parameters:
            if parameter.name != PARAMETER or not parameter.value:
                continue
            done = asyncio.run_coroutine_threadsafe(self._begin(str(parameter.value)), self._loop)
            try:
                done.result(WITHIN_S)
            except FaultError as error:
                return SetParametersResult(successful=False, reason=str(error))
            except NoAnswerError:
                return SetParametersResult(successful=False, reason="the simulation is too slow")
        return SetParametersResult(successful=True)

    async def _begin(self, text: str) -> None:
        self._plan(GRAMMAR.parse(text))
        logger.info("fault: %s", text)
