"""Nav2Driver when Nav2 fails, is not there, is somebody else's, or was given a goal long ago."""

import math
import signal
import sys
from collections.abc import AsyncIterator, Iterator
from dataclasses import replace
from typing import Any
from uuid import UUID, uuid4

import pytest
from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from m2pem_plugin_ros.drivers.nav2.goal_client import number_of, numbered
from m2pem_plugin_ros.runtime import RosError, qos
from m2pem_plugin_ros.testing import Peer, reserved_domain
from nav2_msgs.action import NavigateToPose
from nav_msgs.msg import Odometry
from rclpy.action import ActionClient
from ros_nav2_bench import AMPLE_S, PEER, Bench, along, at, bench

from m2pem.api import BehaviorState

FAR_M = 120.0


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with reserved_domain() as domain:
        yield domain


@pytest.fixture(scope="module")
def nav2(domain: int) -> Iterator[Peer]:
    with Peer(PEER, domain, ["/ugv1", "0", "0"]) as peer:
        yield peer


@pytest.fixture
async def ugv1(domain: int, nav2: Peer) -> AsyncIterator[Bench]:
    async with bench(domain) as made:
        yield made
        await made.say("fine")
        await made.say("active")
        goal = made.begin_anyway("drive_stop")
        await made.until(lambda: goal in made.events.outcomes)
        await made.ready()


def away(ugv1: Bench, east_m: float = FAR_M) -> Any:
    """A target, so far from where it is."""
    return at(ugv1.place[0] + east_m, ugv1.place[1])


class Stranger:
    """Another client of the same Nav2, such as rviz."""

    def __init__(self, ugv1: Bench) -> None:
        self._ros = ugv1.ros
        self._ready = ugv1.until
        self._client = ActionClient(ugv1.ros.node, NavigateToPose, "/ugv1/navigate_to_pose")

    async def ready(self) -> "Stranger":
        """Once it knows of Nav2."""
        await self._ready(self._client.server_is_ready)
        return self

    async def send(self, east_m: float, north_m: float) -> Any:
        goal = NavigateToPose.Goal()
        goal.pose.header.frame_id = "map"
        goal.pose.pose.position.x, goal.pose.pose.position.y = east_m, north_m
        goal.pose.pose.orientation.w = 1.0
        return await self._ros.send_goal(self._client, goal, AMPLE_S, goal_id=uuid4())

    async def cancel_all(self) -> None:
        client = self._ros.client(CancelGoal, "/ugv1/navigate_to_pose/_action/cancel_goal")
        await self._ros.call(client, CancelGoal.Request(), AMPLE_S)


# --- what Nav2 says -------------------------------------------------------------------------------


async def test_a_goal_that_nav2_rejects_is_rejected(ugv1: Bench) -> None:
    await ugv1.say("reject")
    outcome = await ugv1.outcome(ugv1.begin("goto", target=away(ugv1)))
    assert (outcome.state, outcome.code) == (BehaviorState.REJECTED, "REJECTED")
    assert "Nav2 rejected the goal" in outcome.reason


@pytest.mark.parametrize(
    ("error_code", "code"),
    [
        (208, "ROUTE_BLOCKED"),
        pytest.param(107, "TIMEOUT", marks=pytest.mark.long),
        pytest.param(202, "FAILED", marks=pytest.mark.long),
    ],
)
async def test_why_nav2_gave_up_is_told_with_a_code_of_missions(
    ugv1: Bench, error_code: int, code: str
) -> None:
    await ugv1.say(f"abort {error_code} the gate is shut")
    outcome = await ugv1.outcome(ugv1.begin("goto", target=away(ugv1)))
    assert (outcome.state, outcome.code) == (BehaviorState.FAILED, code)
    assert f"error {error_code}" in outcome.reason
    assert "the gate is shut" in outcome.reason


async def test_an_order_that_is_ended_is_told_of_when_the_vehicle_stands(ugv1: Bench) -> None:
    goal = ugv1.begin("goto", target=away(ugv1))
    await ugv1.moving(goal)
    ugv1.driver.end(goal)
    assert await ugv1.state(goal) is BehaviorState.CANCELLED
    assert ugv1.speed_m_s < 0.05
    del ugv1.events.outcomes[goal]
    ugv1.driver.end(goal)
    assert await ugv1.state(goal) is BehaviorState.CANCELLED, "also if it had ended"


async def test_a_nav2_that_does_not_cancel_is_told_of_in_time(ugv1: Bench) -> None:
    await ugv1.say("hang")
    goal = ugv1.begin("goto", target=away(ugv1))
    await ugv1.until(lambda: goal in ugv1.events.begun)
    ugv1.driver.end(goal)
    outcome = await ugv1.outcome(goal)
    assert (outcome.state, outcome.code) == (BehaviorState.FAILED, "TIMEOUT")
    assert "the vehicle did not stop" in outcome.reason
    await ugv1.say("inactive")  # this alone ends what hangs


async def test_a_nav2_that_is_not_active_takes_no_orders_but_to_stand(ugv1: Bench) -> None:
    await ugv1.say("inactive")
    await ugv1.until(lambda: ugv1.driver.health.ready is False)
    assert ugv1.driver.health.not_ready_reasons == ("Nav2 is not active: inactive",)
    refusal = ugv1.driver.refusal(ugv1.order("goto", target=away(ugv1)).request)
    assert refusal == "Nav2 is not active: inactive"
    assert await ugv1.state(ugv1.begin("drive_stop")) is BehaviorState.SUCCEEDED
    outcome = await ugv1.outcome(ugv1.begin_anyway("goto", target=away(ugv1)))
    assert (outcome.state, outcome.code) == (BehaviorState.REJECTED, "REJECTED")
    await ugv1.say("active")
    await ugv1.until(lambda: ugv1.driver.health.ready)
    assert ugv1.driver.health.not_ready_reasons == ()


async def test_a_nav2_that_is_deactivated_on_the_way_is_named_as_the_reason(ugv1: Bench) -> None:
    goal = ugv1.begin("goto", target=away(ugv1))
    await ugv1.moving(goal)
    await ugv1.say("inactive")
    outcome = await ugv1.outcome(goal)
    assert (outcome.state, outcome.code) == (BehaviorState.FAILED, "FAILED")
    assert outcome.reason == "Nav2 aborted the goal: Nav2 is not active: inactive"


# --- somebody else --------------------------------------------------------------------------------


async def test_a_foreign_goal_takes_the_vehicle_over_and_is_left_alone(ugv1: Bench) -> None:
    stranger = await Stranger(ugv1).ready()
    goal = ugv1.begin("goto", target=away(ugv1))
    await ugv1.moving(goal)
    there = ugv1.place[0] + 5.0, ugv1.place[1] + 5.0
    handle = await stranger.send(*there)
    outcome = await ugv1.outcome(goal)
    assert (outcome.state, outcome.code) == (BehaviorState.FAILED, "TAKEN_OVER")
    assert "/ugv1/navigate_to_pose" in outcome.reason
    await ugv1.ros.wait(handle.get_result_async(), AMPLE_S)
    await ugv1.until(lambda: math.dist(ugv1.place, there) < 0.5)


async def test_a_goal_that_somebody_else_cancels_is_a_takeover(ugv1: Bench) -> None:
    goal = ugv1.begin("goto", target=away(ugv1))
    await ugv1.moving(goal)
    await Stranger(ugv1).cancel_all()
    outcome = await ugv1.outcome(goal)
    assert (outcome.state, outcome.code) == (BehaviorState.FAILED, "TAKEN_OVER")


async def test_a_foreign_goal_takes_over_a_vehicle_that_is_held(ugv1: Bench) -> None:
    goal = ugv1.begin("single_vehicle_routing", route=along((FAR_M, 0.0), (FAR_M, FAR_M)))
    await ugv1.moving(goal)
    ugv1.driver.hold()
    await ugv1.until(lambda: ugv1.speed_m_s < 0.05)
    await Stranger(ugv1).send(ugv1.place[0] + 3.0, ugv1.place[1])
    outcome = await ugv1.outcome(goal)
    assert (outcome.state, outcome.code) == (BehaviorState.FAILED, "TAKEN_OVER")


@pytest.mark.long
async def test_a_goal_that_nav2_refuses_to_somebody_else_disturbs_nothing(ugv1: Bench) -> None:
    stranger = await Stranger(ugv1).ready()
    there = ugv1.place[0] + 24.0, ugv1.place[1]
    goal = ugv1.begin("single_vehicle_routing", route=along(there))
    await ugv1.moving(goal)
    handle = await stranger.send(0.0, FAR_M)
    refused = await ugv1.ros.wait(handle.get_result_async(), AMPLE_S)
    assert refused.status == GoalStatus.STATUS_ABORTED
    assert await ugv1.state(goal) is BehaviorState.SUCCEEDED
    await ugv1.until(lambda: math.dist(ugv1.place, there) < 0.5)


async def test_an_order_to_stop_stops_also_what_somebody_else_does(ugv1: Bench) -> None:
    await Stranger(ugv1).send(ugv1.place[0] + FAR_M, ugv1.place[1])
    await ugv1.moving()
    assert await ugv1.state(ugv1.begin("drive_stop")) is BehaviorState.SUCCEEDED
    assert ugv1.speed_m_s < 0.05


# --- restarts -------------------------------------------------------------------------------------


async def test_after_a_restart_the_vehicle_drives_on_and_its_end_is_told(
    domain: int, ugv1: Bench
) -> None:
    places = [(ugv1.place[0] + 20.0, ugv1.place[1]), (ugv1.place[0] + 20.0, ugv1.place[1] + 12.0)]
    order = ugv1.order("single_vehicle_routing", route=along(*places))
    ugv1.driver.begin(order)
    await ugv1.moving(order.goal)
    await ugv1.later()
    motions = ugv1.motions
    await ugv1.driver.close()
    async with bench(domain) as after:
        outcome = await after.driver.query(order)
        assert outcome.state is BehaviorState.RUNNING
        assert await after.state(order.goal) is BehaviorState.SUCCEEDED
        await after.until(lambda: math.dist(after.place, places[-1]) < 0.5)
        await after.later()
        assert after.motions == motions, "it has not stopped, nor been sent again"


async def test_what_was_found_after_a_restart_can_be_held_and_ended(
    domain: int, ugv1: Bench
) -> None:
    order = ugv1.order("goto", target=away(ugv1))
    ugv1.driver.begin(order)
    await ugv1.moving(order.goal)
    await ugv1.driver.close()
    async with bench(domain) as after:
        assert (await after.driver.query(order)).state is BehaviorState.RUNNING
        after.driver.hold()
        await after.until(lambda: after.speed_m_s < 0.05)
        after.driver.resume()
        await after.moving()
        after.driver.end(order.goal)
        assert await after.state(order.goal) is BehaviorState.CANCELLED


async def test_what_ended_unseen_is_found_and_what_was_held_is_begun_again(
    domain: int, ugv1: Bench
) -> None:
    done = ugv1.order("goto", target=away(ugv1, 1.0))
    ugv1.driver.begin(done)
    assert await ugv1.state(done.goal) is BehaviorState.SUCCEEDED
    await ugv1.say("abort 208 there is a wall")
    blocked = ugv1.order("goto", target=away(ugv1))
    ugv1.driver.begin(blocked)
    assert await ugv1.state(blocked.goal) is BehaviorState.FAILED
    await ugv1.say("fine")
    held = ugv1.order("goto", target=away(ugv1))
    ugv1.driver.begin(held)
    await ugv1.moving(held.goal)
    ugv1.driver.hold()
    await ugv1.until(lambda: ugv1.speed_m_s < 0.05)
    await ugv1.driver.close()
    async with bench(domain) as after:
        assert (await after.driver.query(done)).state is BehaviorState.SUCCEEDED
        found = await after.driver.query(blocked)
        assert (found.state, found.code) == (BehaviorState.FAILED, "ROUTE_BLOCKED")
        found = await after.driver.query(held)
        assert (found.state, found.reason) == (
            BehaviorState.UNKNOWN,
            "its goal was cancelled at Nav2",
        )
        request = replace(held.request, behavior="", parameters={})  # as without a checkpoint
        assert (await after.driver.query(replace(held, request=request))).known
        request = replace(done.request, behavior="", parameters={})
        assert not (await after.driver.query(replace(done, request=request))).known
        found = await after.driver.query(after.order("goto", target=at(1.0, 1.0)))
        assert (found.state, found.reason) == (
            BehaviorState.UNKNOWN,
            "Nav2 does not have the goal",
        )
        after.driver.begin(held)  # by a goal that Nav2 does not have yet
        await after.moving(held.goal)


async def test_a_vehicle_that_was_lost_drives_on_until_it_is_told_something_else(
    ugv1: Bench,
) -> None:
    goal = ugv1.begin("goto", target=away(ugv1))
    await ugv1.moving(goal)
    ugv1.driver.abandon()
    heards = ugv1.events.heards
    await ugv1.until(lambda: ugv1.events.heards > heards + 20)
    assert ugv1.speed_m_s > 0.5
    assert goal not in ugv1.events.outcomes
    assert await ugv1.state(ugv1.begin("drive_stop")) is BehaviorState.SUCCEEDED
    assert await ugv1.state(ugv1.begin("hold", duration=0.3)) is BehaviorState.SUCCEEDED


@pytest.mark.long
async def test_a_nav2_that_was_started_anew_knows_nothing_of_its_goal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("m2pem_plugin_ros.drivers.nav2.driver.GONE_S", 60.0)
    with reserved_domain() as domain, Peer(PEER, domain, ["/ugv1", "0", "0"]) as peer:
        async with bench(domain) as ugv1:
            goal = ugv1.begin("goto", target=away(ugv1))
            await ugv1.moving(goal)
            peer.kill()
            with Peer(PEER, domain, ["/ugv1", "3", "0"]):
                outcome = await ugv1.outcome(goal)
                assert outcome.state is BehaviorState.FAILED
                assert "it was restarted" in outcome.reason
                await ugv1.ready()
                await ugv1.until(lambda: not ugv1.driver.refusal(ugv1.order("reverse").request))
                again = ugv1.begin("goto", target=at(5.0, 0.0))
                assert await ugv1.state(again) is BehaviorState.SUCCEEDED


@pytest.mark.long
async def test_a_nav2_that_has_ended_lets_its_order_fail(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("m2pem_plugin_ros.drivers.nav2.driver.GONE_S", 3.0)
    monkeypatch.setattr("m2pem_plugin_ros.drivers.nav2.goal_client.ANSWER_S", 1.5)
    with reserved_domain() as domain, Peer(PEER, domain, ["/ugv1", "0", "0"]) as peer:
        async with bench(domain) as ugv1:
            goal = ugv1.begin("goto", target=away(ugv1))
            await ugv1.moving(goal)
            peer.kill()
            odometry = ugv1.ros.node.create_publisher(Odometry, "/ugv1/odom", qos.TELEMETRY)
            message = Odometry()
            message.header.frame_id = "map"

            def ended() -> bool:
                message.header.stamp.sec += 1_000_000
                odometry.publish(message)
                return goal in ugv1.events.outcomes

            await ugv1.until(ended)
            outcome = await ugv1.outcome(goal)
            assert (outcome.state, outcome.code) == (BehaviorState.FAILED, "FAILED")
            assert outcome.reason == "Nav2 has sent no message for 3 s"
            assert ugv1.driver.health.not_ready_reasons == ("Nav2 does not answer",)


@pytest.mark.long
async def test_a_vehicle_that_is_silent_with_its_nav2_is_lost_and_does_not_fail(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("m2pem_plugin_ros.drivers.nav2.driver.GONE_S", 2.0)
    with reserved_domain() as domain, Peer(PEER, domain, ["/ugv1", "0", "0"]) as peer:
        async with bench(domain) as ugv1:
            order = ugv1.order("goto", target=away(ugv1))
            ugv1.driver.begin(order)
            await ugv1.moving(order.goal)
            peer.process.send_signal(signal.SIGSTOP)
            await ugv1.until(lambda: ugv1.localization.age_s > 5.0)
            assert ugv1.driver.health.not_ready_reasons == ("Nav2 does not answer",)
            peer.process.send_signal(signal.SIGCONT)
            assert await ugv1.state(order.goal) is BehaviorState.SUCCEEDED


async def test_without_nav2_msgs_the_driver_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, ugv1: Bench
) -> None:
    monkeypatch.setitem(sys.modules, "nav2_msgs", None)
    with pytest.raises(RosError, match="apt-get install ros-jazzy-nav2-msgs"):
        await type(ugv1.driver)(ugv1.setup).open()


def test_goals_of_an_order_are_known_by_their_ids() -> None:
    order = UUID("7a4f3c52-6d0e-5c6d-9a3b-2d8a6d7e9f10")
    ids = [numbered(order, number) for number in (0, 1, 2, 70_000)]
    assert ids[0] == order
    assert [number_of(order, goal) for goal in ids] == [0, 1, 2, 70_000]
    assert number_of(order, uuid4()) is None
