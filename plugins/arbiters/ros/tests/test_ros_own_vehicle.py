"""The street sweeper of the examples, a node in plain rclpy, keeps to docs/ros-nodes.md."""

import asyncio
import json
import math
import re
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus, KeyValue, VehicleStatus
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.testing import Peer
from nav_msgs.msg import Odometry

from m2pem import load_fleet

EXAMPLE = Path(__file__).parents[4] / "examples" / "t23_own_ros_vehicle"
HOME = (38.1075, -77.3192)
METRES_PER_DEGREE = 111_320.0
FASTER = 20.0
MISSION_SPEED = 5.0
"""Whoever is silent for 3 s of a clock that is faster is lost on a busy machine."""

PATIENCE_S = 120.0

ACCEPTED, RUNNING, SUCCEEDED = (
    BehaviorStatus.ACCEPTED,
    BehaviorStatus.RUNNING,
    BehaviorStatus.SUCCEEDED,
)
FAILED, CANCELLED, REJECTED = (
    BehaviorStatus.FAILED,
    BehaviorStatus.CANCELLED,
    BehaviorStatus.REJECTED,
)
START, CANCEL, QUERY = BehaviorCommand.START, BehaviorCommand.CANCEL, BehaviorCommand.QUERY
HOLD, RESUME, ADJUST = BehaviorCommand.HOLD, BehaviorCommand.RESUME, BehaviorCommand.ADJUST


def east(*metres: float) -> dict[str, Any]:
    """A Point, or a LineString, so far east of where the sweeper begins."""
    narrowed = METRES_PER_DEGREE * math.cos(math.radians(HOME[0]))
    positions = [[HOME[1] + each / narrowed, HOME[0]] for each in metres]
    geometry = (
        {"type": "Point", "coordinates": positions[0]}
        if len(positions) == 1
        else {"type": "LineString", "coordinates": positions}
    )
    properties = {"altitude_frame": "relative"}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


@dataclass
class Commander:
    """Says what an executive says, and keeps what it hears."""

    ros: RosRuntime
    commands: Any
    statuses: list[BehaviorStatus] = field(default_factory=list)
    states: list[VehicleStatus] = field(default_factory=list)
    odometry: list[Odometry] = field(default_factory=list)
    changed: asyncio.Event = field(default_factory=asyncio.Event)

    def heard(self, place: list[Any]) -> Callable[[Any], None]:
        def keep(message: Any) -> None:
            place.append(message)
            self.changed.set()

        return keep

    def say(self, verb: int, id_: str = "", behavior: str = "", **more: Any) -> None:
        command = BehaviorCommand(verb=verb, id=id_, behavior=behavior, run="run")
        command.epoch = more.pop("epoch", 1)
        command.preempts = more.pop("preempts", [])
        command.parameters = [
            KeyValue(key=key, value=value if isinstance(value, str) else json.dumps(value))
            for key, value in more.items()
        ]
        self.commands.publish(command)

    async def until(self, condition: Callable[[], bool]) -> None:
        async with asyncio.timeout(PATIENCE_S):
            while not condition():
                self.changed.clear()
                await self.changed.wait()

    def of(self, id_: str) -> list[tuple[int, int]]:
        """Numbers and states of what was said of a behavior."""
        return [(each.number, each.state) for each in self.statuses if each.id == id_]

    async def ended(self, id_: str) -> BehaviorStatus:
        def terminal() -> list[BehaviorStatus]:
            return [s for s in self.statuses if s.id == id_ and s.state not in (ACCEPTED, RUNNING)]

        await self.until(lambda: bool(terminal()))
        return terminal()[0]

    @property
    def speed_m_s(self) -> float:
        return float(self.odometry[-1].twist.twist.linear.x) if self.odometry else 0.0

    @property
    def east_m(self) -> float:
        return float(self.odometry[-1].pose.pose.position.x)

    async def fresh(self) -> None:
        """Wait for what the vehicle says from now on."""
        count, states = len(self.odometry), len(self.states)
        await self.until(lambda: len(self.odometry) > count + 1 and len(self.states) > states)


@asynccontextmanager
async def commanded(domain: int, *parameters: str) -> AsyncIterator[Commander]:
    options = [word for each in (f"faster:={FASTER}", *parameters) for word in ("-p", each)]
    arguments = ["--ros-args", "-r", "__ns:=/sweeper1", *options]
    with Peer(EXAMPLE / "street_sweeper.py", domain, arguments):
        async with RosRuntime("commander", namespace="/sweeper1", domain_id=domain) as ros:
            said = ros.node.create_publisher(BehaviorCommand, "command", qos.COMMANDS)
            commander = Commander(ros, said)
            hear = commander.heard
            ros.subscribe(
                BehaviorStatus, "behavior_status", hear(commander.statuses), qos.BEHAVIOR_STATUS
            )
            ros.subscribe(VehicleStatus, "vehicle_status", hear(commander.states), qos.STATUS)
            ros.subscribe(Odometry, "odom", hear(commander.odometry), qos.TELEMETRY)
            # With each message of the odometry, look whether our commands would arrive by now.
            await commander.until(lambda: bool(commander.states) and _is_heard(said))
            yield commander


def _is_heard(publisher: Any) -> bool:
    return int(publisher.get_subscription_count()) > 0


async def test_a_vehicle_sweeps_and_says_so(ros_domain: int) -> None:
    async with commanded(ros_domain, "faster:=5.0") as sweeper:
        sweeper.say(START, "b1", "sweep_street", route=east(2, 12), passes=2, speed=3.0)
        await sweeper.until(lambda: any(each.behavior == "b1" for each in sweeper.states))
        assert (await sweeper.ended("b1")).state == SUCCEEDED
        assert sweeper.of("b1") == [(1, ACCEPTED), (2, RUNNING), (3, SUCCEEDED)]
        await sweeper.fresh()
        assert sweeper.east_m == pytest.approx(2, abs=1.0)
        assert max(each.pose.pose.position.x for each in sweeper.odometry) > 11
        assert sweeper.states[-1].behavior == ""


async def test_a_failure_has_the_code_that_missions_catch(ros_domain: int) -> None:
    async with commanded(ros_domain, "hopper:=0.9", "capacity:=40.0") as sweeper:
        street = {"route": east(1, 9), "speed": 3.0}
        sweeper.say(START, "b1", "sweep_street", **street)
        end = await sweeper.ended("b1")
        assert (end.state, end.code) == (FAILED, "HOPPER_FULL")
        sweeper.say(START, "b2", "empty_hopper")
        assert (await sweeper.ended("b2")).state == SUCCEEDED
        sweeper.say(START, "b3", "sweep_street", **street)
        assert (await sweeper.ended("b3")).state == SUCCEEDED


async def test_a_start_that_comes_again_is_done_once(ros_domain: int) -> None:
    async with commanded(ros_domain) as sweeper:
        for _ in range(3):
            sweeper.say(START, "b1", "hold", duration=2.0)
        assert (await sweeper.ended("b1")).state == SUCCEEDED
        sweeper.say(START, "b1", "hold", duration=2.0)
        await sweeper.until(lambda: sweeper.of("b1").count((3, SUCCEEDED)) >= 2)
        assert {number for number, _ in sweeper.of("b1")} == {1, 2, 3}
        assert sorted(set(sweeper.of("b1"))) == [(1, ACCEPTED), (2, RUNNING), (3, SUCCEEDED)]


REFUSALS = [
    ({"behavior": "fly"}, "no behavior 'fly'; known: goto,"),
    ({"behavior": "goto"}, "target: None is no GeoJSON Feature with a Point"),
    ({"behavior": "goto", "target": east(1, 2)}, "target: .* with a Point"),
    ({"behavior": "goto", "target": '{"vehicle": "evsg1"}'}, "target: .* with a Point"),
    ({"behavior": "goto", "target": east(5), "speed": "NaN"}, "speed: nan is not a number"),
    ({"behavior": "goto", "target": east(5), "speed": 9.0}, "speed: 9 m/s is not within 0 to 3"),
    ({"behavior": "goto", "target": east(5), "heading": 1.0}, "goto takes no heading"),
    ({"behavior": "goto", "target": '{"type"'}, "target: not JSON"),
    ({"behavior": "sweep_street", "route": east(math.nan, 1)}, "route: .* with a LineString"),
    ({"behavior": "goto", "target": east(5), "epoch": 1}, "epoch 1 of its run is past"),
]


async def test_what_it_cannot_do_is_refused_with_a_reason_and_moves_nothing(
    ros_domain: int,
) -> None:
    async with commanded(ros_domain) as sweeper:
        sweeper.say(QUERY, "b0", epoch=1)
        sweeper.say(START, "b0", "drive_stop", epoch=2)
        await sweeper.ended("b0")
        for number, (asked, reason) in enumerate(REFUSALS):
            sweeper.say(START, f"r{number}", **{"epoch": 2, **asked})
            end = await sweeper.ended(f"r{number}")
            code = "STALE_EPOCH" if "epoch" in reason else ""
            assert (end.number, end.state, end.code) == (1, REJECTED, code)
            assert re.search(reason, end.reason), end.reason
        sweeper.say(9, "b9", "goto", target=east(5), epoch=2)
        sweeper.say(START, "", "goto", target=east(5), epoch=2)
        await sweeper.fresh()
        assert [each.id for each in sweeper.statuses if each.id in ("", "b9")] == []
        assert sweeper.east_m == 0.0


async def test_a_busy_vehicle_takes_over_only_from_what_it_is_told_to(ros_domain: int) -> None:
    async with commanded(ros_domain) as sweeper:
        sweeper.say(START, "b1", "goto", target=east(500))
        sweeper.say(START, "b2", "goto", target=east(2))
        end = await sweeper.ended("b2")
        assert (end.state, end.reason) == (REJECTED, "busy with b1")
        sweeper.say(START, "b3", "drive_stop", preempts=["b1"])
        assert (await sweeper.ended("b1")).state == CANCELLED
        assert (await sweeper.ended("b3")).state == SUCCEEDED


async def test_a_vehicle_stands_while_it_is_held_and_then_goes_on(ros_domain: int) -> None:
    async with commanded(ros_domain) as sweeper:
        sweeper.say(START, "b1", "goto", target=east(100))
        await sweeper.until(lambda: sweeper.speed_m_s > 1.0)
        sweeper.say(HOLD)
        await sweeper.until(lambda: sweeper.states[-1].held)
        await sweeper.until(lambda: sweeper.speed_m_s == 0.0)
        stood_m = sweeper.east_m
        await sweeper.fresh()
        assert (sweeper.east_m, sweeper.states[-1].behavior) == (stood_m, "b1")
        sweeper.say(RESUME)
        assert (await sweeper.ended("b1")).state == SUCCEEDED
        await sweeper.fresh()
        assert not sweeper.states[-1].held
        assert sweeper.of("b1") == [(1, ACCEPTED), (2, RUNNING), (3, SUCCEEDED)]


async def test_cancelled_it_has_come_to_a_stand(ros_domain: int) -> None:
    async with commanded(ros_domain) as sweeper:
        sweeper.say(START, "b1", "goto", target=east(500))
        await sweeper.until(lambda: sweeper.speed_m_s > 1.0)
        sweeper.say(CANCEL, "b7")
        sweeper.say(CANCEL, "b1", epoch=0)
        await sweeper.fresh()
        assert sweeper.of("b1") == [(1, ACCEPTED), (2, RUNNING)]
        sweeper.say(CANCEL, "b1")
        assert (await sweeper.ended("b1")).state == CANCELLED
        await sweeper.fresh()
        assert sweeper.speed_m_s == 0.0


@pytest.mark.long
async def test_a_vehicle_goes_on_at_another_speed(ros_domain: int) -> None:
    async with commanded(ros_domain) as sweeper:
        sweeper.say(START, "b1", "goto", target=east(500), speed=1.0)
        await sweeper.until(lambda: sweeper.speed_m_s > 0.99)
        sweeper.say(ADJUST, "b1", speed=2.0)
        await sweeper.until(lambda: sweeper.speed_m_s > 1.99)
        assert sweeper.of("b1") == [(1, ACCEPTED), (2, RUNNING)]


async def test_who_asks_is_told_how_a_behavior_stands(ros_domain: int) -> None:
    async with commanded(ros_domain) as sweeper:
        sweeper.say(START, "b1", "goto", target=east(500))
        await sweeper.until(lambda: (2, RUNNING) in sweeper.of("b1"))
        sweeper.say(QUERY, "b1")
        await sweeper.until(lambda: sweeper.of("b1").count((2, RUNNING)) >= 2)
        sweeper.say(QUERY, "b7")
        await sweeper.until(lambda: sweeper.of("b7") == [(0, BehaviorStatus.UNKNOWN)])


async def test_missions_command_it_as_any_other_vehicle(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    arbiter = pytest.importorskip("m2pem_plugin_ros.arbiter", reason="there is no RosArbiter yet")
    from m2pem.testing.harness import run_executive, run_mission_on

    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros_domain))
    fleet = load_fleet(EXAMPLE / "fleet.yaml")
    mission = (EXAMPLE / "mission.bpmn").read_bytes()
    async with commanded(ros_domain, "hopper:=0.8", f"faster:={MISSION_SPEED}"):
        async with asyncio.timeout(PATIENCE_S):
            arbiters = {"ros": arbiter.RosArbiter}
            async with run_executive(fleet, speed=MISSION_SPEED, arbiters=arbiters) as control:
                played = await run_mission_on(control, mission)
    assert played.visited == [
        *("Start", "SweepStreet", "OnHopperFull", "DriveToDepot", "EmptyHopper"),
        *("SweepStreet", "DriveHome", "End"),
    ]
    assert [each.code for each in played.of("BehaviorEnded")][:1] == ["HOPPER_FULL"]
