"""A simulated vehicle with Nav2 on board: it is there, and fails on request."""

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import suppress
from typing import Any
from uuid import uuid4

import pytest
from action_msgs.msg import GoalStatus
from m2pem_plugin_ros.runtime import RosRuntime, RosTimeoutError
from m2pem_plugin_ros.testing import Peer, reserved_domain
from nav_msgs.msg import Odometry
from rclpy.action import ActionClient
from ros_sim_watch import AMPLE_S, COMMAND, Heard, switch, until

nav2_actions = pytest.importorskip("nav2_msgs.action")
pytest.importorskip("m2pem_plugin_ros.simulator.nav2")
pytest.importorskip("m2pem_plugin_ros.drivers.base")

ANSWERED_WITHIN_S = 10.0
SETTINGS = ["sim", "ros", "--driver", "nav2", "--ground", "1", "--speed", "5"]


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with reserved_domain() as domain, Peer(COMMAND, domain, SETTINGS):
        yield domain


@pytest.fixture
async def ros(domain: int) -> AsyncIterator[RosRuntime]:
    async with RosRuntime("navigating", domain_id=domain) as ros:
        yield ros


async def go(ros: RosRuntime, east_m: float, north_m: float) -> Any:
    """Have it go to a place in `map`; the handle of the goal.

    Where DDS is late to discover the client, rmw_fastrtps drops the server's answer after 0.1 s,
    and rclpy does not execute the goal. Then another one is sent.
    """
    client = ActionClient(ros.node, nav2_actions.NavigateToPose, "/ugv1/navigate_to_pose")
    goal = nav2_actions.NavigateToPose.Goal()
    goal.pose.header.frame_id = "map"
    goal.pose.pose.position.x, goal.pose.pose.position.y = east_m, north_m
    goal.pose.pose.orientation.w = 1.0
    async with asyncio.timeout(AMPLE_S):
        while True:
            with suppress(RosTimeoutError):
                return await ros.send_goal(client, goal, ANSWERED_WITHIN_S, goal_id=uuid4())


async def test_a_nav2_server_goes_where_it_is_sent(ros: RosRuntime) -> None:
    odometry = Heard(ros, Odometry, "/ugv1/odom")
    handle = await go(ros, 4.0, 3.0)
    assert handle.accepted
    answer = await ros.wait(handle.get_result_async(), AMPLE_S)
    assert answer.status == GoalStatus.STATUS_SUCCEEDED
    place = (await odometry.next()).pose.pose.position
    assert (place.x, place.y) == pytest.approx((4, 3), abs=1.5)


async def test_a_nav2_server_rejects_on_request(ros: RosRuntime) -> None:
    await switch(ros, "ugv1: nav2 reject")
    assert not (await go(ros, 0.0, 0.0)).accepted
    await switch(ros, "ugv1: kill node for 20 s")
    await until(lambda: ros.node.count_publishers("/ugv1/navigate_to_pose/_action/status") == 0)
    await until(lambda: ros.node.count_publishers("/ugv1/navigate_to_pose/_action/status") == 1)
    assert (await go(ros, 0.0, 0.0)).accepted  # a new one, and a good one


async def test_a_nav2_server_aborts_on_request(ros: RosRuntime) -> None:
    await switch(ros, "ugv1: nav2 abort 208 for 60 s")
    handle = await go(ros, 30.0, 0.0)
    answer = await ros.wait(handle.get_result_async(), AMPLE_S)
    assert answer.status == GoalStatus.STATUS_ABORTED
    assert answer.result.error_code == 208
