import math

import pytest
from mavlink_double import HOME_ALTITUDE_M, Body, at
from mavlink_play import after_a_restart, play

from m2pem.api import (
    BehaviorState,
    GeoPosition,
    LinkState,
    ResourceId,
    VehiclePosition,
    VehicleState,
)

W = ResourceId("w")


def says(bench, east: float, north: float, *, yaw=0.0, velocity=(0.0, 0.0, 0.0), **more) -> None:
    position = GeoPosition(*at(east, north), HOME_ALTITUDE_M)
    bench.bus.publish(
        VehicleState(W, bench.clock.now_us(), position, None, velocity, yaw_rad=yaw, **more)
    )


async def drives(bench, seconds: float, speed: float = 2.0) -> float:
    """It drives east from 50 m, and says so five times a second."""
    east = 50.0
    for _ in range(round(seconds * 5)):
        says(bench, east, 0.0, velocity=(speed, 0.0, 0.0))
        await bench.clock.sleep(0.2)
        east += speed * 0.2
    return east


@pytest.mark.parametrize(
    ("asked", "station"),
    [
        ({}, (-15.0, 0.0)),
        ({"offset": 8.0}, (-8.0, 0.0)),
        ({"offset": 8.0, "bearing": math.radians(90)}, (0.0, -8.0)),
        ({"offset": 0.0}, (0.0, 0.0)),
    ],
)
def test_a_copter_keeps_its_station_at_a_vehicle_that_drives(asked, station) -> None:
    async def main(bench) -> None:
        says(bench, 50.0, 0.0)
        await bench.start("r1.b1", "follow", "v", target=VehiclePosition("w"), **asked)
        east = await drives(bench, 30.0)
        at_last = (bench.body.east - east, bench.body.north)
        assert at_last == pytest.approx(station, abs=4.0)
        assert 50 <= bench.told.count("go_to") <= 62, "told twice a second"
        assert bench.states_of("r1.b1")[-1] is BehaviorState.RUNNING

    play(Body().fly(), main)


def test_a_target_that_stands_is_told_once() -> None:
    async def main(bench) -> None:
        says(bench, 50.0, 0.0)
        await bench.start("r1.b1", "follow", "v", target=VehiclePosition("w"), altitude=30.0)
        await drives(bench, 10.0, speed=0.0)
        assert bench.told == ["go_to"]
        assert bench.body.up == pytest.approx(30.0, abs=0.5)

    play(Body().fly(), main)


def test_a_target_that_falls_silent_stops_it_and_is_a_failure() -> None:
    async def main(bench) -> None:
        says(bench, 50.0, 0.0)
        await bench.start("r1.b1", "follow", "v", target=VehiclePosition("w"))
        await drives(bench, 5.0)
        end = await bench.ended("r1.b1", 10)
        assert end.state is BehaviorState.FAILED
        assert "w has sent no position" in end.reason
        assert "stop" in bench.told

    play(Body().fly(), main)


def test_a_target_that_is_lost_or_never_heard_is_a_failure() -> None:
    async def never(bench) -> None:
        end = await bench.do("follow", 6.0, target=VehiclePosition("w"))
        assert end.state is BehaviorState.FAILED
        assert "w has sent no position" in end.reason
        assert "go_to" not in bench.told

    async def lost(bench) -> None:
        says(bench, 50.0, 0.0, link=LinkState.LOST)
        await never(bench)

    play(Body().fly(), never)
    play(Body().fly(), lost)


def test_a_target_that_is_heard_a_little_later_is_followed() -> None:
    """As the first task of a mission: another vehicle's telemetry is not there yet."""

    async def main(bench) -> None:
        await bench.start("r1.b1", "follow", "v", target=VehiclePosition("w"))
        await bench.clock.sleep(2)
        says(bench, 50.0, 0.0)
        await bench.running("r1.b1", 2.0)
        assert bench.told == ["go_to"]

    play(Body().fly(), main)


def test_a_copter_cannot_follow_itself() -> None:
    async def main(bench) -> None:
        end = await bench.do("follow", target=VehiclePosition("v"))
        assert end.state is BehaviorState.REJECTED
        assert "another vehicle" in end.reason

    play(Body().fly(), main)


def test_following_goes_on_after_a_hold() -> None:
    async def main(bench) -> None:
        says(bench, 50.0, 0.0)
        await bench.start("r1.b1", "follow", "v", target=VehiclePosition("w"))
        await drives(bench, 2.0)
        await bench.arbiter.hold("v")
        await drives(bench, 5.0)
        told = len(bench.told)
        await bench.arbiter.resume("v")
        await drives(bench, 3.0)
        assert bench.told[told:].count("go_to") >= 5
        assert "go_to" not in bench.told[bench.told.index("stop") : told]

    play(Body().fly(), main)


def test_following_ends_without_a_command_when_another_executive_drives_the_run() -> None:
    async def main(bench) -> None:
        says(bench, 50.0, 0.0)
        await bench.start("r1.b1", "follow", "v", target=VehiclePosition("w"))
        await drives(bench, 2.0)
        told = len(bench.told)
        await bench.arbiter.disown("r1")
        await drives(bench, 5.0)
        assert bench.told[told:] == []
        await bench.arbiter.hold("v")  # an operator's STOP still does that
        await bench.clock.sleep(2.0)
        assert bench.told[told:] == ["stop"]

    play(Body().fly(), main)


def test_following_is_found_again_after_a_restart() -> None:
    async def main(bench, reference: str) -> None:
        says(bench, 50.0, 0.0)
        found = await bench.arbiter.query("r1.b1", reference)
        assert found.state is BehaviorState.RUNNING
        await drives(bench, 4.0)
        assert "go_to" in bench.told

    after_a_restart(
        Body().fly(),
        "follow",
        main,
        before=lambda bench: says(bench, 50.0, 0.0),
        runs_for_s=2.0,
        target=VehiclePosition("w"),
    )
