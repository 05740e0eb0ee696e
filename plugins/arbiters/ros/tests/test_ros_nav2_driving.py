"""Nav2Driver with a simulated Nav2 in another process, over DDS: what is asked is done."""

import asyncio
import math
from collections.abc import AsyncIterator, Iterator
from dataclasses import replace

import pytest
from m2pem_plugin_ros.settings import RouteAction
from m2pem_plugin_ros.testing import Peer, reserved_domain
from ros_nav2_bench import PEER, Bench, along, at, bench

from m2pem.api import (
    BehaviorState,
    GeoPosition,
    ResourceId,
    SystemClock,
    VehiclePosition,
    VehicleState,
)

NORTH_RAD = 0.0


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


def near(place: tuple[float, float], other: tuple[float, float], within_m: float = 0.5) -> bool:
    return math.dist(place, other) <= within_m


def elsewhere(here: tuple[float, float], east_m: float, north_m: float) -> tuple[float, float]:
    return here[0] + east_m, here[1] + north_m


async def test_goto_drives_there_and_turns_to_the_heading(ugv1: Bench) -> None:
    there = elsewhere(ugv1.place, 6.0, 2.0)
    goal = ugv1.begin("goto", target=at(*there), heading=NORTH_RAD)
    assert await ugv1.state(goal) is BehaviorState.SUCCEEDED
    assert goal in ugv1.events.begun
    await ugv1.until(lambda: near(ugv1.place, there))

    def looks_north() -> bool:
        pose = ugv1.localization.pose
        return pose is not None and math.isclose(pose.yaw_rad, math.pi / 2, abs_tol=0.01)

    await ugv1.until(looks_north)


@pytest.mark.tried_with(
    "Nav2's actions",
    "a route is sent to its actions, over DDS",
    kind="ROS 2",
    result="driven through all its places",
    version="Jazzy",
    note="a double of Nav2's servers, not Nav2",
)
async def test_a_route_is_driven_through_all_its_places(ugv1: Bench) -> None:
    start = ugv1.place
    places = [elsewhere(start, 5.0, 0.0), elsewhere(start, 5.0, 5.0), elsewhere(start, 0.0, 5.0)]
    goal = ugv1.begin("single_vehicle_routing", route=along(*places))
    assert await ugv1.state(goal) is BehaviorState.SUCCEEDED
    await ugv1.passed(*places)
    await ugv1.until(lambda: near(ugv1.place, places[-1]))


@pytest.mark.long
async def test_a_route_that_is_repeated_begins_again_and_ends_when_it_is_asked_to(
    ugv1: Bench,
) -> None:
    start = ugv1.place
    first, second = elsewhere(start, 3.0, 0.0), elsewhere(start, 3.0, 3.0)
    goal = ugv1.begin("single_vehicle_routing", route=along(first, second), loop=True)
    await ugv1.passed(first, second, first, second, first, within_m=0.7)
    ugv1.driver.end(goal)
    assert await ugv1.state(goal) is BehaviorState.CANCELLED
    assert ugv1.speed_m_s < 0.05


async def test_a_held_route_goes_on_with_the_places_that_remain(ugv1: Bench) -> None:
    start = ugv1.place
    first, last = elsewhere(start, 3.0, 0.0), elsewhere(start, 3.0, 11.0)
    goal = ugv1.begin("single_vehicle_routing", route=along(first, last), speed=4.0)
    await ugv1.until(lambda: ugv1.place[1] > start[1] + 3.0)
    ugv1.driver.hold()
    await ugv1.until(lambda: ugv1.speed_m_s < 0.05)
    await ugv1.until(lambda: not ugv1.driver.health.mode.startswith("navigate"))
    await ugv1.later()
    held, since = ugv1.place, len(ugv1.track)
    await ugv1.later()
    assert ugv1.place == held
    ugv1.driver.resume()
    assert await ugv1.state(goal) is BehaviorState.SUCCEEDED
    await ugv1.until(lambda: near(ugv1.place, last))
    lowest = min(north_m for _, _, north_m in ugv1.track[since:])
    assert lowest > held[1] - 0.5, "it must not go back to the place that it has passed"


@pytest.mark.long
async def test_waypoints_are_followed_if_the_fleet_says_so(domain: int, nav2: Peer) -> None:
    async with bench(domain, RouteAction.WAYPOINTS) as ugv1:
        start = ugv1.place
        places = [elsewhere(start, 4.0, 0.0), elsewhere(start, 4.0, 12.0)]
        goal = ugv1.begin("single_vehicle_routing", route=along(*places), speed=4.0)
        await ugv1.until(lambda: ugv1.place[1] > start[1] + 1.0)
        ugv1.driver.hold()
        await ugv1.until(lambda: ugv1.speed_m_s < 0.05)
        assert goal not in ugv1.events.outcomes, "its own goals of navigation are no takeover"
        ugv1.driver.resume()
        assert await ugv1.state(goal) is BehaviorState.SUCCEEDED
        await ugv1.until(lambda: near(ugv1.place, places[-1]))


async def test_waypoints_that_nav2_leaves_out_are_a_blocked_route(domain: int, nav2: Peer) -> None:
    async with bench(domain, RouteAction.WAYPOINTS) as ugv1:
        await ugv1.say("miss 1")
        places = [elsewhere(ugv1.place, 1.0 * n, 0.0) for n in (1, 2, 3)]
        outcome = await ugv1.outcome(ugv1.begin("single_vehicle_routing", route=along(*places)))
        await ugv1.say("fine")
    assert (outcome.state, outcome.code) == (BehaviorState.FAILED, "ROUTE_BLOCKED")
    assert "waypoint 2" in outcome.reason


async def test_speed_is_a_limit_that_can_change_and_ends_with_the_order(ugv1: Bench) -> None:
    goal = ugv1.begin("goto", target=at(*elsewhere(ugv1.place, 60.0, 0.0)), speed=1.0)
    await ugv1.until(lambda: 0.9 < ugv1.speed_m_s < 1.1)
    await ugv1.later()
    since = len(ugv1.track)
    await ugv1.later()
    assert all(0.9 < speed_m_s < 1.1 for speed_m_s, *_ in ugv1.track[since:])
    ugv1.driver.adjust(goal, {"speed": 3.0})
    await ugv1.until(lambda: 2.9 < ugv1.speed_m_s < 3.1)
    ugv1.driver.end(goal)
    assert await ugv1.state(goal) is BehaviorState.CANCELLED
    ugv1.begin("goto", target=at(*elsewhere(ugv1.place, -30.0, 0.0)))
    await ugv1.until(lambda: ugv1.speed_m_s > 3.5)


async def test_a_new_order_takes_over_without_a_stop(ugv1: Bench) -> None:
    first = ugv1.begin("goto", target=at(*elsewhere(ugv1.place, 120.0, 0.0)))
    await ugv1.moving()
    await ugv1.later()
    motions = ugv1.motions
    second = ugv1.begin("goto", target=at(*elsewhere(ugv1.place, 4.0, 2.0)))
    assert await ugv1.state(second) is BehaviorState.SUCCEEDED
    assert first not in ugv1.events.outcomes, "what is replaced is not told of"
    await ugv1.later()
    assert ugv1.motions == motions


async def test_another_action_is_begun_when_the_first_has_ended(ugv1: Bench) -> None:
    there = elsewhere(ugv1.place, 3.0, 3.0)
    ugv1.begin("goto", target=at(*elsewhere(ugv1.place, 40.0, 0.0)))
    await ugv1.moving()
    goal = ugv1.begin("single_vehicle_routing", route=along(there))
    assert await ugv1.state(goal) is BehaviorState.SUCCEEDED
    await ugv1.until(lambda: near(ugv1.place, there))


async def test_reverse_backs_up_and_after_a_hold_only_what_is_left(ugv1: Bench) -> None:
    pose = ugv1.localization.pose
    assert pose is not None
    goal = ugv1.begin("reverse", distance=3.0, speed=1.0)
    await ugv1.until(lambda: math.dist(ugv1.place, (pose.east_m, pose.north_m)) > 1.0)
    ugv1.driver.hold()
    await ugv1.until(lambda: ugv1.speed_m_s < 0.05)
    ugv1.driver.resume()
    assert await ugv1.state(goal) is BehaviorState.SUCCEEDED
    there = (
        pose.east_m - 3.0 * math.cos(pose.yaw_rad),
        pose.north_m - 3.0 * math.sin(pose.yaw_rad),
    )
    await ugv1.until(lambda: near(ugv1.place, there, 0.3))


async def test_drive_stop_ends_when_the_vehicle_stands(ugv1: Bench) -> None:
    ugv1.begin("goto", target=at(*elsewhere(ugv1.place, -40.0, 0.0)))
    await ugv1.moving()
    goal = ugv1.begin("drive_stop")
    assert await ugv1.state(goal) is BehaviorState.SUCCEEDED
    assert ugv1.speed_m_s < 0.05


async def test_hold_stands_for_its_duration(ugv1: Bench) -> None:
    clock = SystemClock()
    began_us = clock.now_us()
    goal = ugv1.begin("hold", duration=1.0)
    assert await ugv1.state(goal) is BehaviorState.SUCCEEDED
    assert clock.now_us() - began_us >= 1e6


async def test_teleop_leaves_the_vehicle_alone_until_it_is_ended(ugv1: Bench) -> None:
    ugv1.begin("goto", target=at(*elsewhere(ugv1.place, 40.0, 0.0)))
    await ugv1.moving()
    goal = ugv1.begin("teleop")
    await ugv1.until(lambda: goal in ugv1.events.begun and ugv1.speed_m_s < 0.05)
    ugv1.driver.end(goal)
    assert await ugv1.state(goal) is BehaviorState.CANCELLED


def lead_at(ugv1: Bench, east_m: float, north_m: float) -> None:
    """Another vehicle is there, and its bow is in the east."""
    position = at(east_m, north_m).position
    ugv1.bus.publish(
        VehicleState(
            ResourceId("lead"),
            SystemClock().now_us(),
            GeoPosition(position[0], position[1], 60.0),
            yaw_rad=0.0,
        )
    )


async def leads(ugv1: Bench, start: tuple[float, float], way_m: float) -> None:
    """It drives east, at 4 m/s."""
    for step in range(int(way_m / 0.2) + 1):
        lead_at(ugv1, start[0] + 0.2 * step, start[1])
        await asyncio.sleep(0.05)
    while True:
        lead_at(ugv1, start[0] + way_m, start[1])
        await asyncio.sleep(0.1)


@pytest.mark.long
async def test_follow_keeps_its_station_behind_a_vehicle_that_moves(ugv1: Bench) -> None:
    start = elsewhere(ugv1.place, 8.0, 0.0)
    lead_at(ugv1, *start)
    lead = asyncio.create_task(leads(ugv1, start, 6.0))
    goal = ugv1.begin("follow", target=VehiclePosition("lead"), offset=5.0, bearing=math.pi)
    try:
        await ugv1.until(lambda: near(ugv1.place, elsewhere(start, 1.0, 0.0), 1.5))
        assert goal not in ugv1.events.outcomes
    finally:
        lead.cancel()
    outcome = await ugv1.outcome(goal)
    assert outcome.state is BehaviorState.FAILED
    assert "lead has sent no position" in outcome.reason
    await ugv1.until(lambda: ugv1.speed_m_s < 0.05)


async def test_goto_a_vehicle_goes_where_it_has_gone(ugv1: Bench) -> None:
    start = elsewhere(ugv1.place, 10.0, 0.0)
    lead_at(ugv1, *start)
    lead = asyncio.create_task(leads(ugv1, start, 8.0))
    try:
        goal = ugv1.begin("goto", target=VehiclePosition("lead"))
        assert await ugv1.state(goal) is BehaviorState.SUCCEEDED
        assert ugv1.place[0] > start[0] + 2.0
        assert near(ugv1.place, ugv1.where("lead"), 2.0)
    finally:
        lead.cancel()


async def test_what_cannot_be_is_refused_before_anything_is_sent(ugv1: Bench) -> None:
    def refusal(behavior: str, **wishes: object) -> str:
        request = ugv1.order(behavior).request
        return ugv1.driver.refusal(replace(request, parameters=wishes))  # type: ignore[arg-type]

    assert "has sent no position" in refusal("goto", target=VehiclePosition("nobody"))
    assert "another vehicle" in refusal("follow", target=VehiclePosition("ugv1"))
    assert "cannot be repeated" in refusal(
        "single_vehicle_routing", route=along((1.0, 1.0)), loop=True
    )
    assert "cannot do 'takeoff'" in refusal("takeoff", altitude=3.0)
