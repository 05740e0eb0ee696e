"""The actions and services of the face, for a client in plain rclpy."""

import array
import asyncio
import gc
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from m2pem_interfaces.action import ExecuteMission
from m2pem_interfaces.msg import Allocation, BehaviorStatus, KeyValue, RunStatus
from m2pem_interfaces.srv import GiveBackVehicle, TakeVehicle
from m2pem_plugin_ros.testing import Peer
from ros_face_client import behavior_goal, faced, point, until

from m2pem.api import RunId
from m2pem.api import records as r
from m2pem.errors import JournalError
from m2pem.executive.control import Control
from m2pem.testing import scenarios

ALL = {"commands": "all"}
UGV1 = "/ugv1/execute_behavior"
MISSION = "/face/execute_mission"
FAR = point(0.1)
MORTAL = Path(__file__).with_name("ros_face_mortal_client.py")


@pytest.mark.tried_with(
    "rclpy (ROS 2 Jazzy)",
    "a client sends goals to the actions of the ROS face",
    kind="ROS 2",
    result="each is a run",
    package="ros-jazzy-rclpy",
)
async def test_a_goal_is_a_run_of_its_own_and_ends_with_the_behavior(ros_domain: int) -> None:
    async with faced(ros_domain, ALL) as world:
        sent = await world.client.send(UGV1, behavior_goal("goto", target=point(0.0005)))
        status, result = await sent.end()
        (run,) = await world.control.runs()
        started = (await world.control.records(run.run))[0].record
    assert status == GoalStatus.STATUS_SUCCEEDED
    assert (result.status.state, result.status.id) == (BehaviorStatus.SUCCEEDED, "of the client")
    states = [each.status.state for each in sent.feedback]
    assert states[:1] == [BehaviorStatus.ACCEPTED]
    assert set(states) <= {BehaviorStatus.ACCEPTED, BehaviorStatus.RUNNING}
    numbers = [each.status.number for each in sent.feedback] + [result.status.number]
    assert numbers == sorted(set(numbers))
    assert isinstance(started, r.RunStarted)
    assert started.by.startswith("ros /face goal ")
    assert len(started.by) == len("ros /face goal ") + 8


async def test_a_cancelled_goal_stops_the_vehicle(ros_domain: int) -> None:
    async with faced(ros_domain, ALL) as world:
        sent = await world.client.send(UGV1, behavior_goal("goto", target=FAR))
        await until(lambda: sent.feedback)
        await sent.cancel()
        status, result = await sent.end()
        (run,) = await world.control.runs()
        assert (await world.control.holders())["ugv1"] == ""
    assert status == GoalStatus.STATUS_CANCELED
    assert result.status.state == BehaviorStatus.CANCELLED
    assert run.status.value == "stopped"


async def test_a_payload_has_an_action_of_its_own_and_angles_are_radians(ros_domain: int) -> None:
    async with faced(ros_domain, ALL) as world:
        goal = behavior_goal("ptz_point_at", bearing=1.0, elevation=-0.5)
        sent = await world.client.send("/ugv2/camera/execute_behavior", goal)
        status, result = await sent.end()
    assert status == GoalStatus.STATUS_SUCCEEDED, result


@pytest.mark.parametrize(
    ("settings", "goal", "code", "reason"),
    [
        ({}, behavior_goal("goto", target=FAR), "REFUSED",
         "write in the fleet file faces: {ros: {commands: [ugv1]}}, or commands: all"),
        ({"commands": ["ugv2"]}, behavior_goal("goto", target=FAR), "REFUSED",
         "the fleet does not let ROS command ugv1"),
        (ALL, behavior_goal("fly"), "REFUSED", "ugv1 has no behavior 'fly'; it has area_observe"),
        (ALL, behavior_goal("goto"), "NOT_WELL", "goto needs the parameter 'target'"),
        (ALL, behavior_goal("goto", target=FAR, speed="fast"), "NOT_WELL", "'fast'"),
        (ALL, behavior_goal("goto", target=FAR, colour="red"), "NOT_WELL",
         "goto has no parameter 'colour'"),
        (ALL, behavior_goal(""), "REFUSED", "behavior is empty"),
        (ALL, behavior_goal("g\0t\x1bo"), "REFUSED", "ugv1 has no behavior"),
        (ALL, behavior_goal("goto", **{"\x01": 1}), "REFUSED", ""),
    ],
)  # fmt: skip
async def test_a_refused_goal_says_why(
    ros_domain: int, settings: dict[str, Any], goal: Any, code: str, reason: str
) -> None:
    async with faced(ros_domain, settings) as world:
        sent = await world.client.send(UGV1, goal)
        status, result = await sent.end()
        assert await world.control.runs() == []
    assert status == GoalStatus.STATUS_ABORTED
    assert result.status.state == BehaviorStatus.REJECTED
    assert reason in result.status.reason
    assert result.status.code in (code, "NOT_WELL")


async def test_garbage_in_a_goal_is_refused(ros_domain: int) -> None:
    goals = []
    for value in ("{", "NaN", "1" * 40, "[" * 100 + "]" * 100, '"' + "x" * 2_000_000 + '"'):
        goal = behavior_goal("goto")
        goal.command.parameters = [KeyValue(key="target", value=value)]
        goals.append(goal)
    twice = behavior_goal("goto")
    twice.command.parameters = [KeyValue(key="speed", value="1"), KeyValue(key="speed", value="2")]
    other = behavior_goal("goto", target=FAR)
    other.command.allocation = [Allocation(role="actor", resources=["ugv2"])]
    verb = behavior_goal("goto", target=FAR)
    verb.command.verb = 7
    goals += [twice, other, verb]
    async with faced(ros_domain, ALL) as world:
        for goal in goals:
            sent = await world.client.send(UGV1, goal)
            status, result = await sent.end()
            assert status == GoalStatus.STATUS_ABORTED
            assert result.status.state == BehaviorStatus.REJECTED
            assert 0 < len(result.status.reason) <= 4000
        assert await world.control.runs() == []


async def test_what_a_mission_has_is_refused_until_it_is_taken(ros_domain: int) -> None:
    north = f"[{scenarios.ORIGIN[0] + 0.1}, {scenarios.ORIGIN[1]}]"
    async with faced(ros_domain, ALL) as world:
        mission = scenarios.one_behavior("goto", "ugv1", target=north)
        run = await world.control.start(mission, by="anna")
        sent = await world.client.send(UGV1, behavior_goal("goto", target=FAR))
        status, result = await sent.end()
        assert (status, result.status.code) == (GoalStatus.STATUS_ABORTED, "BUSY")
        assert run in result.status.reason
        taken = await world.client.call(
            TakeVehicle, "/face/take_vehicle", vehicle="ugv1", by="ben@rviz"
        )
        assert taken.success, taken.message
        assert (await world.control.holders())["ugv1"] == "ros /face ben@rviz"
        ended = await world.control.wait(run)
        assert "TAKEN_OVER" in ended.detail
        sent = await world.client.send(UGV1, behavior_goal("goto", target=point(0.0005)))
        status, result = await sent.end()
        assert status == GoalStatus.STATUS_SUCCEEDED, result
        given = await world.client.call(
            GiveBackVehicle, "/face/give_back_vehicle", vehicle="ugv1", by="ben@rviz"
        )
        assert given.success, given.message
        assert (await world.control.holders())["ugv1"] == ""


async def test_what_another_operator_has_is_refused(ros_domain: int) -> None:
    async with faced(ros_domain, ALL) as world:
        await world.control.take("ugv1", by="anna")
        sent = await world.client.send(UGV1, behavior_goal("goto", target=FAR))
        status, result = await sent.end()
        assert (status, result.status.code) == (GoalStatus.STATUS_ABORTED, "BUSY")
        assert "anna" in result.status.reason
        taken = await world.client.call(TakeVehicle, "/face/take_vehicle", vehicle="ugv1")
        assert not taken.success
        given = await world.client.call(GiveBackVehicle, "/face/give_back_vehicle", vehicle="ugv1")
        assert (given.success, given.message) == (False, "ugv1 is with anna, who gives it back")


async def test_two_goals_do_not_fight_but_who_has_taken_a_vehicle_replaces_its_goal(
    ros_domain: int,
) -> None:
    async with faced(ros_domain, ALL) as world:
        first = await world.client.send(UGV1, behavior_goal("goto", target=FAR))
        await until(lambda: first.feedback)
        second = await world.client.send(UGV1, behavior_goal("goto", target=point(0.05)))
        status, result = await second.end()
        assert (status, result.status.code) == (GoalStatus.STATUS_ABORTED, "BUSY")
        assert "ros /face goal " in result.status.reason
        await world.client.call(TakeVehicle, "/face/take_vehicle", vehicle="ugv1", by="ben")
        status, result = await first.end()
        assert status == GoalStatus.STATUS_ABORTED
        assert (result.status.state, result.status.code) == (BehaviorStatus.FAILED, "STOPPED")
        assert result.status.reason == "ugv1 was taken by ros /face ben"
        third = await world.client.send(UGV1, behavior_goal("goto", target=FAR))
        await until(lambda: third.feedback)
        fourth = await world.client.send(UGV1, behavior_goal("goto", target=point(0.0005)))
        status, result = await third.end()
        assert status == GoalStatus.STATUS_ABORTED
        assert result.status.code == "STOPPED"
        status, result = await fourth.end()
        assert status == GoalStatus.STATUS_SUCCEEDED, result


async def test_a_flood_of_goals_is_refused_and_others_are_served(ros_domain: int) -> None:
    async with faced(ros_domain, ALL) as world:
        flood = await asyncio.gather(
            *(world.client.send(UGV1, behavior_goal("goto", target=FAR)) for _ in range(200))
        )
        other = await world.client.send(
            "/ugv2/execute_behavior", behavior_goal("goto", target=point(0.0005))
        )
        status, result = await other.end()
        assert status == GoalStatus.STATUS_SUCCEEDED, result
        ends = [await each.end() for each in flood if each.accepted and not each.feedback]
        assert {result.status.code for _, result in ends} <= {"BUSY", "REFUSED"}
        assert sum(bool(each.feedback) for each in flood) == 1
        assert len(await world.control.runs()) == 2


async def test_a_goal_that_is_cancelled_while_it_waits_commands_nothing(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, go_on = [], asyncio.Event()
    execute = Control.execute_behavior

    async def slow(self: Control, resource: str, *arguments: Any, **options: Any) -> RunId:
        asked.append(resource)
        await go_on.wait()
        return await execute(self, resource, *arguments, **options)

    monkeypatch.setattr(Control, "execute_behavior", slow)
    async with faced(ros_domain, ALL) as world:
        goals = [
            await world.client.send(UGV1, behavior_goal("goto", target=point(0.0005)))
            for _ in range(2)
        ]
        await until(lambda: len(asked) == 2)
        waiting = await world.client.send(
            "/ugv2/execute_behavior", behavior_goal("goto", target=FAR)
        )
        await waiting.cancel()
        # What is cancelled is known when a later request has its answer.
        await world.client.call(GiveBackVehicle, "/face/give_back_vehicle", vehicle="ugv2")
        go_on.set()
        status, result = await waiting.end()
        for each in goals:
            await each.end()
    assert status == GoalStatus.STATUS_CANCELED
    assert (result.status.state, result.status.code) == (BehaviorStatus.CANCELLED, "")
    assert "before it began" in result.status.reason
    assert asked == ["ugv1", "ugv1"]


async def test_a_goal_has_its_result_also_when_its_feedback_fails(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    read, failed = Control.records, []

    async def fails_once(self: Control, *arguments: Any, **options: Any) -> Any:
        if not failed:
            failed.append(arguments)
            raise JournalError("the disk is full")
        return await read(self, *arguments, **options)

    monkeypatch.setattr(Control, "records", fails_once)
    async with faced(ros_domain, ALL) as world:
        sent = await world.client.send(UGV1, behavior_goal("goto", target=point(0.0005)))
        status, result = await sent.end()
    assert status == GoalStatus.STATUS_SUCCEEDED
    assert result.status.state == BehaviorStatus.SUCCEEDED
    assert failed
    assert "the disk is full" in caplog.text


async def test_what_a_goal_asked_for_is_freed_when_it_is_over(ros_domain: int) -> None:
    large = 1_000_000

    def held() -> int:
        gc.collect()
        return sum(
            len(each.value) > large for each in gc.get_objects() if isinstance(each, KeyValue)
        )

    async with faced(ros_domain) as world:
        for _ in range(5):
            goal = behavior_goal("goto", target="x" * large)
            sent = await world.client.send(UGV1, goal)
            status, _ = await sent.end()
            assert status == GoalStatus.STATUS_ABORTED
            del goal, sent
        await until(lambda: held() <= 1, held)  # rclpy holds the last one for a moment


# --- missions -------------------------------------------------------------------------------------


def mission_goal(bpmn: bytes, **fields: Any) -> Any:
    return ExecuteMission.Goal(bpmn=array.array("B", bpmn), **fields)


async def test_a_mission_is_an_action_with_its_elements_and_prompts(ros_domain: int) -> None:
    async with faced(ros_domain, ALL) as world:
        sent = await world.client.send(MISSION, mission_goal(scenarios.question(), by="ben"))

        def asked() -> Any:
            return next((each for each in sent.feedback if each.prompts), None)

        asking = await until(asked)
        (prompt,) = asking.prompts
        assert [each.element for each in asking.elements] == ["Question"]
        assert (asking.completed, asking.total) == (0, 1)
        assert asking.status.status == RunStatus.RUNNING
        await world.control.answer(prompt.run, prompt.prompt, "continue", by="anna")
        status, result = await sent.end()
        started = (await world.control.records(result.run))[0].record
    assert status == GoalStatus.STATUS_SUCCEEDED
    assert (result.run, result.outcome, result.code) == (prompt.run, RunStatus.COMPLETED, "")
    assert isinstance(started, r.RunStarted)
    assert started.by == "ros /face ben"


async def test_a_cancelled_mission_is_stopped(ros_domain: int) -> None:
    async with faced(ros_domain, ALL) as world:
        sent = await world.client.send(MISSION, mission_goal(scenarios.question()))
        await until(lambda: sent.feedback)
        await sent.cancel()
        status, result = await sent.end()
    assert status == GoalStatus.STATUS_CANCELED
    assert result.outcome == RunStatus.STOPPED


async def test_a_mission_that_fails_says_its_error(ros_domain: int) -> None:
    mission = scenarios.one_behavior("goto", "ugv1", target="[38.2, -77.3192]")
    async with faced(ros_domain, ALL) as world:
        sent = await world.client.send(MISSION, mission_goal(mission))
        await until(lambda: sent.feedback)
        await world.control.take("ugv1", by="anna")
        status, result = await sent.end()
    assert status == GoalStatus.STATUS_ABORTED
    assert (result.outcome, result.code) == (RunStatus.FAILED, "TAKEN_OVER")


@pytest.mark.parametrize(
    ("settings", "goal", "code", "reason"),
    [
        ({"commands": ["ugv1", "ugv2"]}, mission_goal(scenarios.question()), "REFUSED",
         "faces: {ros: {commands: all}}"),
        (ALL, mission_goal(b""), "REFUSED", "not as neither"),
        (ALL, mission_goal(b"<x/>", url="x.bpmn"), "REFUSED", "not as both"),
        (ALL, mission_goal(b"no BPMN"), "NOT_WELL", ""),
        (ALL, mission_goal(scenarios.one_behavior("fly", "ugv1")), "NOT_WELL", "fly"),
    ],
)  # fmt: skip
async def test_a_refused_mission_says_why(
    ros_domain: int, settings: dict[str, Any], goal: Any, code: str, reason: str
) -> None:
    async with faced(ros_domain, settings) as world:
        sent = await world.client.send(MISSION, goal)
        status, result = await sent.end()
    assert status == GoalStatus.STATUS_ABORTED
    assert (result.run, result.outcome, result.code) == ("", 0, code)
    assert reason in result.reason
    assert bool(result.findings) == (code == "NOT_WELL")


async def test_the_goal_of_a_client_that_dies_goes_on(ros_domain: int) -> None:
    latitude, longitude, _ = scenarios.ORIGIN
    words = [UGV1, str(latitude + 0.0005), str(longitude)]
    async with faced(ros_domain, ALL, speed=1.0) as world:
        peer = Peer(MORTAL, ros_domain, words)
        await asyncio.to_thread(peer.__enter__)
        peer.kill()
        (going,) = await world.control.runs()
        assert not going.status.ended
        done = await world.control.wait(going.run)
    assert done.status.value == "completed"
