"""A person drives a vehicle that a mission has stopped, in a mode that the person chooses."""

import pytest
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from mavlink_body import Body
from mavlink_play import after_a_restart, play

from m2pem.api import BehaviorState

RUNNING, SUCCEEDED = BehaviorState.RUNNING, BehaviorState.SUCCEEDED
PERSONS = (FlightMode.MANUAL, FlightMode.GUIDED, FlightMode.HOLD, FlightMode.MANUAL)


def moving() -> Body:
    body = Body("ground").drive()
    body.target = (500.0, 0.0, 0.0)
    return body


def test_it_is_stopped_and_a_person_drives_it_until_the_mission_goes_on() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "teleop", "v")
        await bench.running("r1.b1")
        assert bench.body.mode is FlightMode.HOLD
        for mode in PERSONS:
            bench.body.mode = mode
            await bench.clock.sleep(20)
            assert bench.states_of("r1.b1")[-1] is RUNNING, mode
        assert bench.told == ["stop"]
        await bench.arbiter.cancel("r1.b1", 1)
        assert (await bench.ended("r1.b1", 10)).state is BehaviorState.CANCELLED
        assert bench.told == ["stop", "stop"]
        assert bench.body.mode is FlightMode.HOLD

    play(moving(), main)


def test_it_is_stopped_after_the_timeout_in_which_a_hold_does_not_count() -> None:
    async def main(bench) -> None:
        began_us = bench.clock.now_us()
        await bench.start("r1.b1", "teleop", "v", timeout=20.0)
        await bench.running("r1.b1")
        bench.body.mode = FlightMode.MANUAL
        await bench.clock.sleep(5)
        await bench.arbiter.hold("v")
        await bench.clock.sleep(30)
        await bench.arbiter.resume("v")
        await bench.clock.sleep(1)
        bench.body.mode = FlightMode.MANUAL
        assert (await bench.ended("r1.b1", 60)).state is SUCCEEDED
        assert (bench.clock.now_us() - began_us) / 1e6 == pytest.approx(50.0, abs=1.0)
        assert bench.body.mode is FlightMode.HOLD

    play(moving(), main)


def test_a_vehicle_that_returns_is_not_driven_any_more_and_is_not_stopped() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "teleop", "v")
        await bench.running("r1.b1")
        bench.body.mode = FlightMode.MANUAL
        await bench.clock.sleep(5)
        bench.body.mode = FlightMode.RETURN
        end = await bench.ended("r1.b1", 30)
        assert (end.state, end.code) == (BehaviorState.FAILED, "TAKEN_OVER")
        assert bench.told == ["stop"]

    play(moving(), main)


def test_after_a_restart_the_person_drives_on_for_the_rest_of_the_timeout() -> None:
    async def main(bench, reference: str) -> None:
        bench.body.mode = FlightMode.MANUAL
        assert (await bench.arbiter.query("r1.b1", reference)).state is RUNNING
        await bench.clock.sleep(10)
        assert bench.told == []
        assert (await bench.ended("r1.b1", 30)).state is SUCCEEDED
        assert bench.told == ["stop"]

    after_a_restart(moving(), "teleop", main, timeout=30.0)
