"""Reverse and deploy: what is done by commands that have no driver method of their own."""

import math

import pytest

from m2pem.api import BehaviorState, Point
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from mavlink_double import Body, at
from mavlink_play import after_a_restart, play

REVERSE, SERVO, RELAY, GRIPPER, ACTUATOR = 194, 183, 181, 211, 187


def test_a_rover_backs_up_over_the_distance_and_stands() -> None:
    async def main(bench) -> None:
        end = await bench.do("reverse", distance=6.0, speed=1.0)
        assert end.state is BehaviorState.SUCCEEDED
        assert bench.body.north == pytest.approx(-6.0, abs=0.5)
        assert bench.body.east == pytest.approx(0.0, abs=0.1)
        assert bench.told == ["set_mode", "arm", "command", "go_to", "stop"]
        assert bench.body.calls[2] == ("command", REVERSE, 1.0)

    play(Body("ground", yaw=math.pi / 2), main)


def test_a_reverse_that_was_held_goes_on_to_the_same_place() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "reverse", "v", distance=10.0, speed=1.0)
        await bench.until(lambda: bench.body.east < -3, 30)
        await bench.arbiter.hold("v")
        await bench.clock.sleep(5)
        await bench.arbiter.resume("v")
        assert (await bench.ended("r1.b1", 60)).state is BehaviorState.SUCCEEDED
        assert bench.body.east == pytest.approx(-10.0, abs=0.5)

    play(Body("ground"), main)


def test_what_takes_over_from_a_reverse_drives_forwards_again() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "reverse", "v", distance=10.0)
        await bench.running("r1.b1")
        target = Point((*at(50, 0), None))
        await bench.start("r1.b2", "goto", "v", target=target, preempts=("r1.b1",))
        await bench.running("r1.b2")
        assert bench.body.calls[-2] == ("command", REVERSE, 0.0)
        assert "stop" not in bench.told

    play(Body("ground"), main)


def test_a_reverse_is_found_again_after_a_restart() -> None:
    async def main(bench, reference: str) -> None:
        found = await bench.arbiter.query("r1.b1", reference)
        assert found.state is BehaviorState.RUNNING
        assert (await bench.ended("r1.b1", 60)).state is BehaviorState.SUCCEEDED
        assert bench.told == ["stop"]
        assert bench.body.east == pytest.approx(-10.0, abs=0.5)

    after_a_restart(Body("ground"), "reverse", main, distance=10.0, speed=1.0)


@pytest.mark.parametrize(
    ("asked", "sent"),
    [
        ({"actuator": "servo 9", "value": 1700.0}, (SERVO, 9.0, 1700.0)),
        ({"actuator": "9", "value": 1100.0}, (SERVO, 9.0, 1100.0)),
        ({"actuator": "relay 0"}, (RELAY, 0.0, 1.0)),
        ({"actuator": "relay:1", "value": 0.0}, (RELAY, 1.0, 0.0)),
        ({"actuator": "gripper"}, (GRIPPER, 1.0, 0.0)),
        ({"actuator": "gripper 2", "value": 1.0}, (GRIPPER, 2.0, 1.0)),
    ],
)
def test_an_actuator_is_worked_by_name_or_number(asked, sent) -> None:
    async def main(bench) -> None:
        assert (await bench.do("deploy", **asked)).state is BehaviorState.SUCCEEDED
        assert bench.body.calls == [("command", *sent)]

    play(Body(), main)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"actuator": "catapult"}, "no 'catapult'"),
        ({"actuator": "servo 9"}, "'value'"),
        ({"actuator": "servo 9", "value": 3.0}, "500 to 2500"),
        ({"actuator": "relay 0", "value": 7.0}, "0 to 1"),
        ({"actuator": "actuator 7"}, "no 'actuator 7'"),
    ],
)
def test_an_actuator_that_is_none_is_rejected(asked, said) -> None:
    async def main(bench) -> None:
        end = await bench.do("deploy", **asked)
        assert end.state is BehaviorState.REJECTED
        assert said in end.reason
        assert bench.told == []

    play(Body(), main)


def test_what_takes_over_without_steering_stops_the_vehicle_first() -> None:
    async def main(bench) -> None:
        target = Point((*at(500, 0), None))
        await bench.start("r1.b1", "goto", "v", target=target)
        await bench.running("r1.b1")
        await bench.start("r1.b2", "deploy", "v", actuator="gripper", preempts=("r1.b1",))
        assert (await bench.ended("r1.b2", 10)).state is BehaviorState.SUCCEEDED
        assert bench.told == ["go_to", "stop", "command"]
        assert bench.body.mode is FlightMode.HOLD

    play(Body().fly(), main)
