import math

import pytest
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.identity import Firmware
from mavlink_double import HOME_ALTITUDE_M, Body, at
from mavlink_play import after_a_restart, play

from m2pem.api import BehaviorState, GeoPosition, Point, ResourceId, VehiclePosition, VehicleState

SUCCEEDED = BehaviorState.SUCCEEDED


def point(east: float, north: float, altitude: float | None = None, frame="relative") -> Point:
    return Point((*at(east, north), altitude), frame)


@pytest.mark.parametrize("firmware", [Firmware.ARDUPILOT, Firmware.PX4])
def test_goto_ends_at_its_target(firmware) -> None:
    async def main(bench) -> None:
        end = await bench.do("goto", target=point(60.0, 30.0, 25.0), speed=3.0)
        assert end.state is SUCCEEDED
        assert math.dist((bench.body.east, bench.body.north), (60.0, 30.0)) <= 2.0
        assert bench.body.up == pytest.approx(25.0, abs=2.0)
        assert bench.body.calls[0][2] == 3.0

    play(Body(firmware=firmware).fly(), main)


@pytest.mark.parametrize(
    ("target", "asked", "told"),
    [
        (point(9, 9, 30.0), {}, (30.0, "relative")),
        (point(9, 9, 500.0, "amsl"), {}, (500.0, "amsl")),
        (point(9, 9, 30.0, "terrain"), {}, (30.0, "terrain")),
        (point(9, 9, 30.0), {"altitude": 12.0}, (12.0, "relative")),
        (point(9, 9), {"altitude": 510.0, "altitude_frame": "amsl"}, (510.0, "amsl")),
        (point(9, 9), {}, (None, "relative")),
    ],
)
def test_altitudes_are_told_in_the_frame_that_was_asked_for(target, asked, told) -> None:
    async def main(bench) -> None:
        await bench.do("goto", target=target, **asked)
        place = bench.body.calls[0][1]
        assert (place.altitude_m, place.altitude_frame) == told

    play(Body().fly(30.0), main)


def test_a_rover_is_told_no_altitude() -> None:
    async def main(bench) -> None:
        assert (await bench.do("goto", target=point(20.0, 0.0, 55.0))).state is SUCCEEDED
        assert bench.body.calls[0][1].altitude_m is None

    play(Body("ground"), main)


def test_a_heading_is_told_and_turned_to() -> None:
    async def main(bench) -> None:
        end = await bench.do("goto", target=point(20.0, 0.0), heading=math.radians(90.0))
        assert end.state is SUCCEEDED
        assert bench.body.yaw == pytest.approx(0.0)

    play(Body(yaw=2.0).fly(), main)


def test_who_stands_near_its_target_has_arrived_unless_a_tolerance_says_otherwise() -> None:
    def short_of_it(bench) -> None:
        bench.body.target = (bench.body.target[0] - 4.0, *bench.body.target[1:])

    async def usual(bench) -> None:
        await bench.start("r1.b1", "goto", "v", target=point(50.0, 0.0))
        await bench.running("r1.b1")
        short_of_it(bench)
        assert (await bench.ended("r1.b1", 60)).state is SUCCEEDED

    async def strict(bench) -> None:
        await bench.start("r1.b1", "goto", "v", target=point(50.0, 0.0), tolerance=1.0)
        await bench.running("r1.b1")
        short_of_it(bench)
        end = await bench.ended("r1.b1", 60)
        assert end.state is BehaviorState.FAILED
        assert "4.0 m from its target" in end.reason

    play(Body("ground"), usual)
    play(Body("ground"), strict)


def test_a_vehicle_that_moves_is_gone_after() -> None:
    async def main(bench) -> None:
        def place(east: float) -> None:
            position = GeoPosition(*at(east, 0.0), HOME_ALTITUDE_M)
            now_us = bench.clock.now_us()
            bench.bus.publish(VehicleState(ResourceId("w"), now_us, position))

        place(40.0)
        await bench.start("r1.b1", "goto", "v", target=VehiclePosition("w"))
        await bench.running("r1.b1")
        place(80.0)
        assert (await bench.ended("r1.b1", 60)).state is SUCCEEDED
        assert bench.body.east > 77.0
        assert bench.told == ["go_to", "go_to"]

    play(Body().fly(), main)


def test_going_to_a_vehicle_that_is_not_heard_is_a_failure() -> None:
    async def main(bench) -> None:
        end = await bench.do("goto", 6.0, target=VehiclePosition("w"))
        assert end.state is BehaviorState.FAILED
        assert "w has sent no position" in end.reason
        assert "go_to" not in bench.told

    play(Body().fly(), main)


def test_hold_without_a_duration_ends_when_the_vehicle_stands() -> None:
    async def main(bench) -> None:
        assert (await bench.do("hold")).state is SUCCEEDED
        assert bench.told == ["stop"]
        assert bench.body.mode is FlightMode.HOLD

    body = Body().fly()
    body.target = (500.0, 0.0, 20.0)
    play(body, main)


def test_a_pause_does_not_count_in_the_duration_of_a_hold() -> None:
    async def main(bench) -> None:
        began_us = bench.clock.now_us()
        await bench.start("r1.b1", "hold", "v", duration=20.0)
        await bench.clock.sleep(5)
        await bench.arbiter.hold("v")
        await bench.clock.sleep(30)
        await bench.arbiter.resume("v")
        assert (await bench.ended("r1.b1", 60)).state is SUCCEEDED
        assert (bench.clock.now_us() - began_us) / 1e6 == pytest.approx(50.0, abs=1.0)

    play(Body().fly(), main)


def test_hold_of_what_stands_on_the_ground_sends_nothing() -> None:
    async def main(bench) -> None:
        assert (await bench.do("hold", duration=3.0)).state is SUCCEEDED
        assert bench.told == []

    play(Body(), main)


def test_a_rover_stops() -> None:
    async def main(bench) -> None:
        assert (await bench.do("drive_stop")).state is SUCCEEDED
        assert bench.told == ["stop"]

    body = Body("ground").drive()
    body.target = (500.0, 0.0, 0.0)
    play(body, main)


def test_a_goto_is_found_again_after_a_restart() -> None:
    async def main(bench, reference: str) -> None:
        found = await bench.arbiter.query("r1.b1", reference)
        assert found.state is BehaviorState.RUNNING
        assert (await bench.ended("r1.b1", 300)).state is SUCCEEDED
        assert bench.told == []

    after_a_restart(Body().fly(), "goto", main, target=point(200.0, 0.0))


def test_a_goto_that_was_never_sent_is_not_found_again() -> None:
    def stands(body: Body) -> None:
        body.target, body.velocity = None, (0.0, 0.0, 0.0)

    async def main(bench, reference: str) -> None:
        found = await bench.arbiter.query("r1.b1", reference)
        assert found.state is BehaviorState.UNKNOWN
        assert bench.told == []

    after_a_restart(Body().fly(), "goto", main, meanwhile=stands, target=point(200.0, 0.0))


def test_a_hold_goes_on_after_a_restart_for_as_long_as_was_left() -> None:
    async def main(bench, reference: str) -> None:
        began_us = bench.clock.now_us()
        found = await bench.arbiter.query("r1.b1", reference)
        assert found.state is BehaviorState.RUNNING
        assert (await bench.ended("r1.b1", 60)).state is SUCCEEDED
        assert (bench.clock.now_us() - began_us) / 1e6 == pytest.approx(16.0, abs=1.5)

    after_a_restart(Body().fly(), "hold", main, duration=20.0)
