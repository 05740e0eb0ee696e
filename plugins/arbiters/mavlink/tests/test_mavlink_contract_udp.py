"""The contract of arbiters, against simulated autopilots over real UDP."""

import asyncio
import threading

import pytest

from m2pem.api import Connection, Point, ResourceId
from m2pem.executive.clock import SystemClock
from m2pem.testing import ArbiterCase, ArbiterContract
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.link.routed_link import open_link
from m2pem_plugin_mavlink.plane import offset
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.sim.geometry import Location
from m2pem_plugin_mavlink.sim.simulator import Simulator
from m2pem_plugin_mavlink.sim.specification import Kind, VehicleSpec
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

A, B = ResourceId("a"), ResourceId("b")
HOME = (47.397742, 8.545594)
SPEED = 20.0


def at(east: float, north: float) -> tuple[float, float]:
    return offset(HOME, east, north)


class _Simulated(ArbiterContract):
    unsupported = {"virtual clock": "vehicles are told over real sockets"}
    speed = SPEED
    kind = Kind.ROVER
    domain = "ground"
    firmware = "ardupilot"

    @pytest.fixture
    def simulator(self):
        """In a loop and thread of its own: it outlives the loop of the arbiter."""
        specs = [
            VehicleSpec(
                self.kind,
                system=number,
                home=Location(*at(0.0, 20.0 * number), 488.0),
                firmware=self.firmware,
                estimator_s=1.0,
            )
            for number in (1, 2)
        ]
        started, stop = threading.Event(), None
        simulator = Simulator(specs, speed=SPEED, to=None)
        loop = asyncio.new_event_loop()

        async def main() -> None:
            nonlocal stop
            stop = asyncio.Event()
            async with simulator:
                await self.prepare(simulator)
                started.set()
                await stop.wait()

        thread = threading.Thread(target=loop.run_until_complete, args=(main(),), name="asyncio_sim")
        thread.start()
        assert started.wait(20)
        yield simulator
        loop.call_soon_threadsafe(stop.set)
        thread.join()
        loop.close()

    async def prepare(self, simulator) -> None:
        """Have the vehicles ready to move."""

    @pytest.fixture
    def make_arbiter(self, simulator):
        def make(context):
            connections = {}
            for resource, number in ((A, 1), (B, 2)):
                host, port = simulator[number].address
                settings = {"url": f"udpout://{host}:{port}", "system_id": number}
                connections[resource] = Connection(resource, self.domain, settings)
            return MavlinkArbiter(connections, context)

        return make

    @pytest.fixture
    def cut_link(self, simulator):
        def cut(_arbiter, vehicle) -> None:
            port = simulator[1 if vehicle == A else 2].port
            port.outward.carry = port.inward.carry = lambda *_: None

        return cut

    @pytest.fixture
    def effects(self, simulator):
        def count(_arbiter, vehicle) -> int:
            truth = simulator[1 if vehicle == A else 2]
            return truth.motions + truth.missions_begun + truth.takeoffs

        return count

    @pytest.fixture
    def case(self):
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("goto", {"target": Point((*at(400.0, 0.0), None)), "speed": 4.0}),
            short=("goto", {"target": Point((*at(20.0, 20.0), None)), "speed": 4.0}),
            bad=("speed", -1.0),
            short_s=25.0,
        )


class TestSimulatedRovers(_Simulated):
    pass


class TestSimulatedCoptersTakingOff(_Simulated):
    kind = Kind.COPTER
    domain = "air"

    @pytest.fixture
    def case(self):
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("takeoff", {"altitude": 150.0}),
            short=("takeoff", {"altitude": 6.0}),
            bad=("altitude", "high"),
            short_s=25.0,
        )


class TestSimulatedCopters(_Simulated):
    kind = Kind.COPTER
    domain = "air"

    async def prepare(self, simulator) -> None:
        await asyncio.gather(*(take_off(simulator[number], number) for number in (1, 2)))


async def take_off(truth, number: int) -> None:
    host, port = truth.address
    clock = SystemClock(SPEED)
    link = await open_link(Address(number, 1), [f"udpout://{host}:{port}"], clock)
    vehicle = Vehicle(ResourceId("v"), "air", link, clock)
    vehicle.open()
    assert await vehicle.identified(20.0)
    await vehicle.driver.take_off(10.0)
    assert await vehicle.until(lambda: (vehicle.heard.altitude_above_home_m or 0.0) > 9.5, 60.0)
    await vehicle.close()
    await link.close()
