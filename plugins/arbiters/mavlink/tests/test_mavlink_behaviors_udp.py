"""Behaviors on simulated autopilots, over real UDP: judged by where the vehicles really are."""

import math

import pytest
from m2pem_plugin_mavlink.sim.specification import Kind
from mavlink_simulated import at, fly

from m2pem.api import BehaviorState, Point, VehiclePosition, VehicleState

COPTER, ROVER = Kind.COPTER, Kind.ROVER


def point(east: float, north: float, altitude: float | None = None, frame="relative") -> Point:
    return Point((*at(east, north), altitude), frame)


def test_a_copter_takes_off_goes_climbs_and_returns() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "takeoff", altitude=10.0)
        assert bench.truth().up_m == pytest.approx(10.0, abs=1.0)
        await bench.do("r1.b2", "goto", target=point(40, 30, 15.0), speed=6.0)
        assert bench.level() == pytest.approx((40, 30), abs=2.5)
        assert bench.truth().up_m == pytest.approx(15.0, abs=2.0)
        await bench.do("r1.b3", "change_altitude", altitude=513.0, altitude_frame="amsl")
        assert bench.truth().up_m == pytest.approx(25.0, abs=1.1)
        await bench.do("r1.b4", "return_to_launch")
        assert not bench.truth().armed
        assert bench.level() == pytest.approx((0, 0), abs=2.0)
        assert bench.truth().up_m == pytest.approx(0.0, abs=0.3)

    fly(main, COPTER)


def test_a_copter_lands_where_it_is() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "takeoff", altitude=6.0)
        await bench.do("r1.b2", "hold", duration=3.0)
        await bench.do("r1.b3", "land")
        assert not bench.truth().armed

    fly(main, COPTER)


def test_a_rover_drives_backs_up_stops_and_returns() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "goto", target=point(30, 0))
        before = bench.level()
        assert before == pytest.approx((30, 0), abs=2.6)
        await bench.do("r1.b2", "reverse", distance=8.0, speed=1.0)
        assert math.dist(bench.level(), before) == pytest.approx(8.0, abs=1.5)
        assert bench.level()[0] < before[0]
        await bench.do("r1.b3", "drive_stop")
        await bench.do("r1.b4", "return_to_launch")
        assert bench.level() == pytest.approx((0, 0), abs=5.0)

    fly(main, ROVER)


def test_a_copter_follows_a_rover() -> None:
    async def main(bench) -> None:
        def tell(state) -> None:
            if isinstance(state, VehicleState):
                bench.arbiter._context.bus.publish(state)

        await bench.do("r1.b1", "takeoff", altitude=8.0)
        await bench.start("r1.b2", "goto", "v2", target=point(120, 20), speed=3.0)
        await bench.running("r1.b2")
        begun = len(bench.states)

        async def hear() -> None:
            nonlocal begun
            for state in bench.states[begun:]:
                tell(state)
            begun = len(bench.states)
            await bench.clock.sleep(0.2)

        for _ in range(3):
            await hear()
        await bench.start(
            "r1.b3", "follow", "v1", target=VehiclePosition("v2"), offset=6.0, altitude=8.0
        )
        for _ in range(150):
            await hear()
        assert math.dist(bench.level(1), bench.level(2)) == pytest.approx(6.0, abs=4.0)
        assert bench.states_of("r1.b3")[-1] is BehaviorState.RUNNING
        end = await bench.ended("r1.b3", 20)
        assert "v2 has not been heard" in end.reason

    fly(main, COPTER, ROVER)


def test_an_actuator_is_worked() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "deploy", actuator="servo 9", value=1700.0)
        kinds = [event.kind for event in bench.truth().autopilot.chronicle.events]
        assert "servo" in kinds

    fly(main, COPTER)
