"""The contract of arbiters, against simulated autopilots over real UDP."""

import asyncio
from typing import ClassVar

import pytest
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.link.routed_link import open_link
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle
from mavlink_simulated import at, connections, specs

from m2pem.api import Point, ResourceId, Route
from m2pem.testing import ArbiterCase, ArbiterContract
from m2pem.testing.loopback import run_on_loopback

A, B = ResourceId("v1"), ResourceId("v2")
NUMBERS = {A: 1, B: 2}
SPEED = 20.0


class _Simulated(ArbiterContract):
    """The vehicles are simulated in the same event loop, and outlive the arbiters."""

    kind = Kind.ROVER
    firmware = "ardupilot"
    speed = SPEED

    @pytest.fixture
    def simulator(self):
        pair = specs(self.kind, self.kind, firmware=self.firmware)
        return Simulator(pair, speed=self.speed, to=None)

    @pytest.fixture
    def run(self, simulator):
        def run(main) -> None:
            async def on_vehicles(clock) -> None:
                async with simulator:
                    await self.prepare(simulator, clock)
                    await main(clock)

            self.play(on_vehicles)

        return run

    def play(self, main) -> None:
        run_on_loopback(main, self.speed)

    async def prepare(self, simulator, clock) -> None:
        """Have the vehicles ready to move."""

    @pytest.fixture
    def make_arbiter(self, simulator):
        return lambda context: MavlinkArbiter(connections(simulator), context)

    @pytest.fixture
    def cut_link(self, simulator):
        def cut(_arbiter, vehicle) -> None:
            port = simulator[NUMBERS[vehicle]].port
            port.outward.carry = port.inward.carry = lambda *_: None

        return cut

    @pytest.fixture
    def effects(self, simulator):
        def count(_arbiter, vehicle) -> int:
            truth = simulator[NUMBERS[vehicle]]
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


class _Airborne(_Simulated):
    kind = Kind.COPTER

    async def prepare(self, simulator, clock) -> None:
        await asyncio.gather(*(take_off(simulator[number], number, clock) for number in (1, 2)))


class _OnARoute(_Simulated):
    @pytest.fixture
    def case(self):
        return on_a_route()


class TestSimulatedRovers(_Simulated):
    pass


class TestSimulatedCoptersOnARoute(_OnARoute, _Airborne):
    pass


class TestSimulatedPx4Copters(_Airborne):
    """`quick`: what depends on the autopilot; the other tests are of the arbiter alone."""

    firmware = "px4"
    quick: ClassVar = {
        "test_a_behavior_that_preempts_takes_the_vehicle_over",
        "test_a_cancelled_vehicle_can_be_commanded_again",
        "test_a_cut_link_is_lost_within_the_declared_bound",
        "test_a_lost_vehicle_whose_link_returns_stops_before_it_is_free",
        "test_a_second_start_has_one_physical_effect",
        "test_a_vehicle_that_another_arbiter_has_held_is_reported_as_held",
        "test_accepted_comes_before_running_and_one_terminal_report_last",
        "test_another_arbiter_finds_the_behavior_again",
        "test_cancel_ends_a_behavior_within_the_declared_bound",
        "test_hold_stops_the_vehicle_within_the_declared_bound",
        "test_resume_goes_on_with_the_behavior",
        "test_two_vehicles_do_not_mix",
    }


@pytest.mark.long
class TestSimulatedPx4Rovers(_Simulated):
    firmware = "px4"


@pytest.mark.long
class TestSimulatedPx4CoptersOnARoute(_OnARoute, _Airborne):
    firmware = "px4"


@pytest.mark.long
class TestSimulatedRoversOnARoute(_OnARoute):
    pass


@pytest.mark.long
class TestSimulatedCopters(_Airborne):
    pass


class _Winged(_Airborne):
    """What a hold and a resume are for planes: test_mavlink_planes.py."""

    kind = Kind.PLANE
    unsupported: ClassVar = {
        "hold": "a plane that is held circles: it never stands",
    }


@pytest.mark.long
class TestSimulatedPlanes(_Winged):
    @pytest.fixture
    def case(self):
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("goto", {"target": Point((*at(4000.0, 0.0), 40.0)), "speed": 20.0}),
            short=("goto", {"target": Point((*at(250.0, 0.0), 40.0)), "speed": 20.0}),
            bad=("speed", -1.0),
            short_s=50.0,
        )


@pytest.mark.long
class TestSimulatedPlanesOnARoute(_Winged):
    @pytest.fixture
    def case(self):
        def way(*easts: float) -> dict:
            return {"route": Route(tuple((*at(east, 0.0), 40.0) for east in easts)), "speed": 20.0}

        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("single_vehicle_routing", way(500.0, 4000.0)),
            short=("single_vehicle_routing", way(200.0, 300.0)),
            bad=("speed", -1.0),
            short_s=60.0,
        )


@pytest.mark.long
class TestSimulatedCoptersTakingOff(_Simulated):
    kind = Kind.COPTER

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


def on_a_route() -> ArbiterCase:
    def way(*places: tuple[float, float]) -> dict:
        return {"route": Route(tuple((*at(*place), 10.0) for place in places)), "speed": 4.0}

    return ArbiterCase(
        vehicle=A,
        other=B,
        long=("single_vehicle_routing", way((60.0, 0.0), (400.0, 0.0))),
        short=("single_vehicle_routing", way((15.0, 5.0), (20.0, 15.0))),
        bad=("speed", -1.0),
        short_s=30.0,
    )


async def take_off(truth, number: int, clock) -> None:
    host, port = truth.address
    link = await open_link(Address(number, 1), [f"udpout://{host}:{port}"], clock)
    vehicle = Vehicle(ResourceId("v"), "air", link, clock)
    vehicle.open()
    assert await vehicle.identified(20.0)
    await vehicle.driver.take_off(10.0)
    assert await vehicle.until(lambda: (vehicle.state.altitude_above_home_m or 0.0) > 9.5, 60.0)
    if truth.autopilot.spec.kind is Kind.PLANE:
        await vehicle.driver.stop()  # it took off by a mission, which would still go on
    await vehicle.close()
    await link.close()
