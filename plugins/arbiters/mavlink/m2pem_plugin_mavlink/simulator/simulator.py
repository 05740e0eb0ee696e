"""Many simulated vehicles in one process, on real UDP sockets.

async with Simulator([VehicleSpec(), VehicleSpec(Kind.ROVER, system=2)], speed=10) as sim:
    sim[1].location, sim[1].armed, sim[1].mode, sim[1].takeoffs
"""

import asyncio
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Self

from m2pem.api.faults import PlannedFault
from m2pem_plugin_mavlink.simulator.autopilot import Autopilot
from m2pem_plugin_mavlink.simulator.faults import Faults, plan
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.server import Address, VehiclePort
from m2pem_plugin_mavlink.simulator.specification import VehicleSpec

TICK_S = 0.01
"""How often vehicles are moved on, in seconds of the wall clock."""
MOST_BEHIND_S = 0.25
"""If the computer does not keep up, simulated time is behind; it catches up no more than that."""
FAST = 20
"""From this speed on, a vehicle is moved on in bigger steps."""


class SimulatedVehicle:
    """The true state of a vehicle, whatever its telemetry says, and access to its autopilot."""

    def __init__(self, port: VehiclePort) -> None:
        self.port = port
        self.autopilot: Autopilot = port.autopilot
        self.faults = Faults(port)

    @property
    def address(self) -> Address:
        """Where it listens on UDP."""
        return self.port.address

    @property
    def location(self) -> Location:
        """Where it is (WGS-84)."""
        return self.autopilot.frame.to_location(self.autopilot.position)

    @property
    def up_m(self) -> float:
        """How high above its home."""
        return self.autopilot.body.up_m - self.autopilot.home.point.up_m

    @property
    def armed(self) -> bool:
        """Its motors may turn."""
        return self.autopilot.arming.armed

    @property
    def mode(self) -> str:
        """The name of its mode."""
        return self.autopilot.modes.mode.name

    @property
    def takeoffs(self) -> int:
        """How often a takeoff was begun."""
        return self.autopilot.log.counts["takeoff"]

    @property
    def motions(self) -> int:
        """How often a movement to another place, or by velocity, was begun in GUIDED."""
        return self.autopilot.log.counts["motion"]

    @property
    def missions_begun(self) -> int:
        """How often a mission was begun from its start."""
        return self.autopilot.log.counts["mission"]


class Simulator:
    """The vehicles; `speed`: simulated seconds per second.

    `to`: the ground station's UDP address, to which all vehicles send from sockets of their own;
    None: each waits to be spoken to. `listen`: the address of the first vehicle's socket, the next
    ones count up; by default the system chooses.

    Raises:
        ValueError: two vehicles have the same number.
    """

    def __init__(
        self,
        specs: Sequence[VehicleSpec],
        *,
        speed: float = 1.0,
        to: Address | None = ("127.0.0.1", 14550),
        listen: Address | None = None,
    ) -> None:
        self.speed = speed
        self._to, self._listen = to, listen
        step_s = 0.05 if speed >= FAST else 0.02
        self._vehicles: dict[int, SimulatedVehicle] = {}
        for spec in specs:
            if spec.system in self._vehicles:
                raise ValueError(f"two vehicles have the system id {spec.system}")
            autopilot = Autopilot(spec, step_s=step_s)
            self._vehicles[spec.system] = SimulatedVehicle(VehiclePort(autopilot))
        self.now_s = 0.0
        self._moved = asyncio.Event()
        self._task: asyncio.Task[None] | None = None

    def plan(self, faults: Iterable[PlannedFault[Faults]]) -> None:
        """Let faults happen to vehicles when their time comes.

        Raises:
            FaultError: it is for a vehicle that is not there, or cannot happen to it.
        """
        for fault in faults:
            for system in fault.targets_among([*map(str, self._vehicles)]):
                plan(fault, self._vehicles[int(system)].faults)

    def __getitem__(self, system: int) -> SimulatedVehicle:
        return self._vehicles[system]

    def __iter__(self) -> Iterator[SimulatedVehicle]:
        return iter(self._vehicles.values())

    def __len__(self) -> int:
        return len(self._vehicles)

    async def __aenter__(self) -> Self:
        loop = asyncio.get_running_loop()
        try:
            for number, vehicle in enumerate(self):
                near = self._to is None or self._to[0].startswith("127.")
                local = ("127.0.0.1" if near else "0.0.0.0", 0)  # asked for
                if self._listen is not None:
                    host, first = self._listen
                    local = (host, first + number if first else 0)
                port = vehicle.port
                await loop.create_datagram_endpoint(lambda port=port: port, local_addr=local)  # type: ignore[misc]
                if self._to is not None:
                    vehicle.autopilot.meet(self._to)
        except BaseException:
            self._close()
            raise
        self._task = asyncio.create_task(self._run())
        self._task.add_done_callback(lambda _: self._moved.set())
        return self

    async def __aexit__(self, *_: object) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        self._close()

    async def stopped(self) -> None:
        """Wait for its end, which comes only by an error.

        Raises:
            Exception: whatever ended it.
        """
        if self._task is not None:
            await asyncio.shield(self._task)

    async def until(self, condition: Callable[[], bool]) -> None:
        """Wait until something is so, looking whenever the vehicles have been moved on.

        Raises:
            Exception: whatever ended the simulation.
        """
        while not condition():
            if self._task is not None and self._task.done():
                self._task.result()
            self._moved.clear()
            await self._moved.wait()

    def _close(self) -> None:
        for vehicle in self:
            vehicle.port.close()

    async def _run(self) -> None:
        clock = asyncio.get_running_loop().time
        last_s = clock()
        while True:
            await asyncio.sleep(TICK_S)
            wall_s = clock()
            self.now_s += min(wall_s - last_s, MOST_BEHIND_S) * self.speed
            last_s = wall_s
            for vehicle in self:
                vehicle.port.step(self.now_s)
                vehicle.faults.step()
            self._moved.set()
