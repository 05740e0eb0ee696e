"""The node on board, by what comes and goes on its topics, whoever is at the other end."""

import asyncio
import json
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest
from m2pem_interfaces.action import ExecuteBehavior
from m2pem_interfaces.msg import (
    Allocation,
    BehaviorCommand,
    BehaviorStatus,
    CommandRefusal,
    GeoPoint,
    KeyValue,
    TargetState,
    VehicleStatus,
)
from m2pem_plugin_ros.drivers.driver import DriverEvents
from m2pem_plugin_ros.onboard.node import OnboardNode
from m2pem_plugin_ros.onboard.target_bus import TargetBus
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.testing import Peer, reserved_domain
from rclpy.action import ActionClient
from ros_scripted_driver import ScriptedDriver

from m2pem.api.clock import SystemClock

NODE = Path(__file__).with_name("ros_onboard_peer.py")
AMPLE_S = 40.0
S = BehaviorStatus
C = BehaviorCommand


class Console:
    """Commands evsg1 by hand, and writes down what it says."""

    def __init__(self, ros: RosRuntime, vehicle: str = "evsg1") -> None:
        self.ros = ros
        self.statuses: list[S] = []
        self.refusals: list[CommandRefusal] = []
        self.vehicle = VehicleStatus()
        self.heard = 0
        create = ros.node.create_publisher
        self.commands = create(C, f"/{vehicle}/command", qos.COMMANDS)
        self.targets = create(TargetState, f"/{vehicle}/target", qos.TELEMETRY)
        refused = f"/{vehicle}/command_refusal"
        ros.subscribe(CommandRefusal, refused, self.refusals.append, qos.COMMANDS)
        ros.subscribe(S, f"/{vehicle}/behavior_status", self.statuses.append, qos.BEHAVIOR_STATUS)
        ros.subscribe(VehicleStatus, f"/{vehicle}/vehicle_status", self._on_message, qos.STATUS)

    def _on_message(self, message: VehicleStatus) -> None:
        self.vehicle = message
        self.heard += 1

    async def until(self, holds: Any) -> None:
        async with asyncio.timeout(AMPLE_S):
            while not holds():  # noqa: ASYNC110  # what is waited for has no event
                await asyncio.sleep(0.005)

    async def later(self) -> None:
        """Until it has said some more of how it is, which it does after all that was heard of
        behaviors by now."""
        before = self.heard
        await self.until(lambda: self.heard >= before + 3)

    async def ready(self) -> None:
        """Until both sides know of each other."""
        await self.until(self.commands.get_subscription_count)
        await self.until(self.targets.get_subscription_count)
        await self.until(lambda: self.heard)
        refused = self.commands.topic_name.replace("command", "command_refusal")
        await self.until(lambda: self.ros.node.count_publishers(refused))

    def say(self, verb: int, id_: str = "", **fields: Any) -> str:
        fields.setdefault("run", f"run of {id_}")
        self.commands.publish(C(verb=verb, id=id_, **fields))
        return id_

    def start(self, behavior: str, id_: str = "", **fields: Any) -> str:
        return self.say(C.START, id_ or f"{uuid4()}", behavior=behavior, **fields)

    def of(self, id_: str) -> list[tuple[int, int]]:
        return [(said.number, said.state) for said in self.statuses if said.id == id_]

    async def last_of(self, id_: str, *states: int) -> S:
        """Wait for a status with one of the states."""
        found: list[S] = []

        def look() -> bool:
            found[:] = [s for s in self.statuses if s.id == id_ and s.state in states]
            return bool(found)

        await self.until(look)
        return found[0]


@asynccontextmanager
async def console(domain: int) -> AsyncIterator[Console]:
    async with RosRuntime("console", domain_id=domain) as ros:
        made = Console(ros)
        await made.ready()
        yield made


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with reserved_domain() as domain, Peer(NODE, domain, ["4", "evsg1"]):
        yield domain


@pytest.fixture
async def one(domain: int) -> AsyncIterator[Console]:
    async with console(domain) as one:
        yield one


async def test_a_start_that_comes_again_is_done_once_and_answered(one: Console) -> None:
    id_ = one.start("hold", parameters=[KeyValue(key="duration", value="4.0")])
    await one.last_of(id_, S.RUNNING)
    one.start("hold", id_, parameters=[KeyValue(key="duration", value="4.0")])
    await one.last_of(id_, S.SUCCEEDED)
    await one.later()
    begun = one.vehicle.mode
    one.start("hold", id_)
    await one.until(lambda: len(one.of(id_)) == 5)
    assert one.of(id_) == [(1, S.ACCEPTED), (2, S.RUNNING), (2, S.RUNNING)] + [(3, S.SUCCEEDED)] * 2
    await one.later()
    assert (one.vehicle.mode, one.vehicle.behavior) == (begun, "")


async def test_a_query_is_answered_with_the_last_status_and_its_number(one: Console) -> None:
    id_ = one.start("reverse")
    await one.last_of(id_, S.FAILED)
    one.say(C.QUERY, id_)
    await one.until(lambda: one.of(id_)[-2:] == [(3, S.FAILED)] * 2)
    assert one.statuses[-1].code == "ROUTE_BLOCKED"
    one.say(C.QUERY, "nobody's")
    assert (await one.last_of("nobody's", S.UNKNOWN)).number == 0


async def test_who_joins_late_gets_the_last_statuses(one: Console, domain: int) -> None:
    id_ = one.start("drive_stop")
    await one.last_of(id_, S.SUCCEEDED)
    async with console(domain) as late:
        await late.last_of(id_, S.SUCCEEDED)


@pytest.mark.parametrize(
    ("parameter", "reason"),
    [
        (KeyValue(key="duration", value="soon"), "parameter 'duration': soon is not JSON"),
        (KeyValue(key="duration", value="NaN"), "NaN is not a number of JSON"),
        (KeyValue(key="duration", value='"5 s"'), "'5 s' is not a finite number"),
        (KeyValue(key="", value="5"), "a parameter has no name"),
    ],
)
async def test_a_start_that_cannot_be_understood_is_rejected(
    one: Console, parameter: KeyValue, reason: str
) -> None:
    id_ = one.start("hold", parameters=[parameter])
    assert reason in (await one.last_of(id_, S.REJECTED)).reason
    assert one.of(id_) == [(1, S.REJECTED)]


async def test_a_start_for_another_vehicle_is_rejected(one: Console) -> None:
    id_ = one.start("hold", allocation=[Allocation(role="driver", resources=["evsg2"])])
    reason = (await one.last_of(id_, S.REJECTED)).reason
    assert reason == "the command is for evsg2, but this is evsg1"


async def test_commands_that_are_none_are_answered_with_nothing(one: Console) -> None:
    one.start("drive_stop", "goes well")
    await one.last_of("goes well", S.SUCCEEDED)
    said = len(one.statuses)
    one.say(0, "a")
    one.say(99, "a")
    one.say(C.START, "")
    one.say(C.CANCEL, "")
    one.say(C.CANCEL, "unknown")
    one.say(C.ADJUST, "unknown")
    id_ = one.start("drive_stop")
    await one.last_of(id_, S.SUCCEEDED)
    assert {status.id for status in one.statuses[said:]} == {id_}


async def test_commands_of_a_past_epoch_change_nothing(one: Console) -> None:
    id_ = one.start("single_vehicle_routing", parameters=[route()], run="r", epoch=5)
    await one.last_of(id_, S.RUNNING)
    one.say(C.CANCEL, id_, run="r", epoch=4)
    one.say(C.ADJUST, id_, run="r", epoch=4, parameters=[KeyValue(key="speed", value="9")])
    old = one.start("drive_stop", run="r", epoch=4)
    rejected = await one.last_of(old, S.REJECTED)
    assert (rejected.code, "epoch 4 is past" in rejected.reason) == ("STALE_EPOCH", True)
    one.say(C.QUERY, id_, run="r", epoch=4)
    await one.until(lambda: one.of(id_)[-2:] == [(2, S.RUNNING)] * 2)
    await one.until(lambda: len(one.refusals) == 4)
    assert [each.verb for each in one.refusals] == [C.CANCEL, C.ADJUST, C.START, C.QUERY]
    assert {(r.run, r.epoch, r.newest, r.code) for r in one.refusals} == {
        ("r", 4, 5, "STALE_EPOCH")
    }
    assert (
        one.refusals[0].reason == "epoch 4 is past: another executive drives the run with epoch 5"
    )
    one.say(C.CANCEL, id_, run="r", epoch=6)
    await one.last_of(id_, S.CANCELLED)


async def test_a_past_executive_may_hold_a_vehicle_but_not_let_it_go(one: Console) -> None:
    id_ = one.start("single_vehicle_routing", parameters=[route()], run="h", epoch=1)
    await one.last_of(id_, S.RUNNING)
    one.say(C.CLAIM, run="h", epoch=2)
    one.say(C.HOLD, run="h", epoch=1)
    await one.until(lambda: one.vehicle.held)
    one.say(C.RESUME, run="h", epoch=1)
    await one.until(lambda: any(each.verb == C.RESUME for each in one.refusals))
    await one.later()
    assert one.vehicle.held
    one.say(C.RESUME, run="h", epoch=2)
    await one.until(lambda: not one.vehicle.held)
    one.say(C.HOLD, run="", epoch=0)
    await one.until(lambda: one.vehicle.held)
    one.say(C.RESUME, run="", epoch=0)  # an executive of before there were epochs in RESUME
    await one.until(lambda: not one.vehicle.held)
    one.say(C.CANCEL, id_, run="h", epoch=2)
    await one.last_of(id_, S.CANCELLED)


def route() -> KeyValue:
    geometry = {"type": "LineString", "coordinates": [[-77.0, 38.0], [-77.0, 38.001]]}
    value = json.dumps({"type": "Feature", "geometry": geometry, "properties": {}})
    return KeyValue(key="route", value=value)


async def test_a_start_takes_over_whatever_goes_on_and_that_is_said(one: Console) -> None:
    old = one.start("single_vehicle_routing", parameters=[route()])
    await one.last_of(old, S.RUNNING)
    await one.until(lambda: one.vehicle.behavior == old)
    bad = one.start("fly")
    await one.last_of(bad, S.REJECTED)
    assert one.of(old)[-1] == (2, S.RUNNING), "what is rejected takes over from nothing"
    new = one.start("drive_stop")
    assert (await one.last_of(old, S.CANCELLED)).reason == f"{new} has replaced it"
    await one.last_of(new, S.SUCCEEDED)


async def test_an_idle_vehicle_is_held_until_it_is_resumed_or_started(one: Console) -> None:
    for end in (lambda: one.say(C.RESUME), lambda: one.start("drive_stop")):
        one.say(C.HOLD)
        one.say(C.HOLD)
        await one.until(lambda: one.vehicle.held)
        end()
        await one.until(lambda: not one.vehicle.held)


async def test_a_target_that_is_a_vehicle_is_known_by_what_is_told_of_it(one: Console) -> None:
    nowhere = GeoPoint(latitude_deg=float("nan"), longitude_deg=0.0, altitude_m=0.0)
    here = GeoPoint(latitude_deg=38.0, longitude_deg=-77.0, altitude_m=float("nan"))
    id_ = one.start("follow", parameters=[KeyValue(key="target", value='{"vehicle": "evsg2"}')])
    await one.last_of(id_, S.RUNNING)
    for name, position in (("evsg2", nowhere), ("evsg3", here), ("", here)):
        one.targets.publish(TargetState(vehicle=name, position=position))
    one.say(C.QUERY, id_)
    await one.until(lambda: one.of(id_)[-2:] == [(2, S.RUNNING)] * 2)
    async with asyncio.timeout(AMPLE_S):
        while one.of(id_)[-1] == (2, S.RUNNING):  # of telemetry, one may be lost
            told = TargetState(vehicle="evsg2", position=here, yaw_rad=float("nan"))
            one.targets.publish(told)
            await asyncio.sleep(0.05)
    assert (await one.last_of(id_, S.SUCCEEDED)).reason == "found evsg2"


# --- the action -----------------------------------------------------------------------------------


async def run_goal(one: Console, command: C) -> Any:
    client = ActionClient(one.ros.node, ExecuteBehavior, "/evsg1/execute_behavior")
    goal = ExecuteBehavior.Goal(command=command)
    handle = await one.ros.send_goal(client, goal, AMPLE_S, goal_id=uuid4())
    assert handle.accepted
    return (await one.ros.wait(handle.get_result_async(), AMPLE_S)).result.status


async def test_a_goal_is_the_behavior_of_its_id_whoever_started_it(one: Console) -> None:
    id_ = one.start("hold", parameters=[KeyValue(key="duration", value="4.0")])
    await one.last_of(id_, S.RUNNING)
    await one.later()
    begun = one.vehicle.mode
    status = await run_goal(one, C(verb=C.START, id=id_, behavior="hold"))
    assert (status.id, status.number, status.state) == (id_, 3, S.SUCCEEDED)
    again = await run_goal(one, C(verb=C.START, id=id_, behavior="hold"))
    assert again.state == S.SUCCEEDED
    await one.later()
    assert one.vehicle.mode == begun


@pytest.mark.parametrize("command", [C(verb=C.HOLD, id="a"), C(verb=C.START)])
async def test_a_goal_that_is_no_start_is_rejected(one: Console, command: C) -> None:
    status = await run_goal(one, command)
    assert (status.state, status.reason) == (
        S.REJECTED,
        "the command of a goal must be a START with an id",
    )


# --- its end --------------------------------------------------------------------------------------


async def test_a_node_can_be_let_go_and_made_again_in_one_process(ros_domain: int) -> None:
    clock, drivers = SystemClock(), []
    before = asyncio.all_tasks()

    def make_driver(events: DriverEvents) -> ScriptedDriver:
        drivers.append(ScriptedDriver(events, TargetBus(), clock))
        return drivers[-1]

    async with RosRuntime("host", domain_id=ros_domain) as ros:
        first = OnboardNode(ros, "evsg1", "/evsg1", make_driver, clock=clock)
        await first.open()
        async with console(ros_domain) as one:
            id_ = one.start("single_vehicle_routing", parameters=[route()])
            await one.last_of(id_, S.RUNNING)
            await first.drop()
            await one.until(lambda: not one.commands.get_subscription_count())
            assert one.of(id_) == [(1, S.ACCEPTED), (2, S.RUNNING)], "it went without a word"
            second = OnboardNode(ros, "evsg1", "/evsg1", make_driver, clock=clock)
            await second.open()
            await one.ready()
            one.say(C.QUERY, id_)
            await one.last_of(id_, S.UNKNOWN)
            id_ = one.start("single_vehicle_routing", parameters=[route()])
            await one.last_of(id_, S.RUNNING)
            await second.close()
            assert (
                await one.last_of(id_, S.CANCELLED)
            ).reason == "the node on the vehicle was stopped"
    async with asyncio.timeout(AMPLE_S):
        while asyncio.all_tasks() != before:  # noqa: ASYNC110  # tasks end some turns later
            await asyncio.sleep(0.01)
