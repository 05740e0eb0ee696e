"""A vehicle with an m2pem node, over topics and as an action: driver and node over real DDS."""

import asyncio
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_ros.settings import Via
from m2pem_plugin_ros.testing import Peer, reserved_domain
from ros_node_bench import (
    CANCELLED,
    FAILED,
    REJECTED,
    RUNNING,
    SUCCEEDED,
    UNKNOWN,
    Bench,
    bench,
)
from ros_scripted_driver import REST

from m2pem.api import Point, Route

NODE = Path(__file__).with_name("ros_onboard_peer.py")
SPEED = 4.0
"""Of time, for the vehicle and for who commands it."""

ROUTE = Route(((38.0, -77.0, None), (38.001, -77.0, None)))


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with reserved_domain() as domain, Peer(NODE, domain, [f"{SPEED:g}", "evsg1"]):
        yield domain


@pytest.fixture(params=list(Via))
def via(request: pytest.FixtureRequest) -> Via:
    return Via(request.param)


@pytest.fixture
async def one(domain: int, via: Via) -> AsyncIterator[Bench]:
    async with bench(domain, "evsg1", via, SPEED) as one:
        await one.until(lambda: one.driver.health.mode)
        yield one


async def test_a_behavior_runs_and_succeeds(one: Bench) -> None:
    order = one.begin("hold", duration=0.2)
    await one.running(order)
    assert (await one.end_of(order)).state is SUCCEEDED


async def test_what_is_left_is_what_the_node_says(one: Bench) -> None:
    order = one.begin("single_vehicle_routing", route=ROUTE, loop=True)
    await one.until(lambda: one.events.left)
    assert one.events.left == [(order.goal, REST)]
    one.driver.end(order.goal)
    await one.end_of(order)


async def test_a_behavior_that_fails_says_with_which_code(one: Bench) -> None:
    end = await one.end_of(one.begin("reverse"))
    assert (end.state, end.code, end.reason) == (FAILED, "ROUTE_BLOCKED", "a wall")


IMPOSSIBLE: list[tuple[str, dict[str, Any], str]] = [
    ("fly", {}, "evsg1 has no behavior 'fly'; it has single_vehicle_routing, goto"),
    ("hold", {"duration": -1.0}, "parameter 'duration': -1 is below 0"),
    ("hold", {"colour": "red"}, "hold has no parameter 'colour'"),
    ("goto", {"target": Point((85.0, 0.0, None))}, "the pole is too far"),
]


async def test_what_cannot_be_done_is_rejected_with_a_reason(one: Bench) -> None:
    await one.later()
    before = one.begun
    for behavior, parameters, reason in IMPOSSIBLE:
        end = await one.end_of(one.begin(behavior, **parameters))
        assert end.state is REJECTED, behavior
        assert reason in end.reason
    await one.later()
    assert one.begun == before


async def test_what_cannot_be_sent_is_rejected_by_the_driver(one: Bench) -> None:
    order = one.order("hold", duration=float("nan"))
    assert one.driver.refusal(order.request) == "parameter 'duration': nan is not finite"
    one.driver.begin(order)
    assert (await one.end_of(order)).state is REJECTED


async def test_a_cancelled_behavior_ends_and_the_vehicle_is_free(one: Bench) -> None:
    order = one.begin("single_vehicle_routing", route=ROUTE)
    await one.running(order)
    one.driver.end(order.goal)
    assert (await one.end_of(order)).state is CANCELLED
    assert (await one.end_of(one.begin("drive_stop"))).state is SUCCEEDED


async def test_a_cancel_at_once_is_not_lost(one: Bench) -> None:
    order = one.begin("single_vehicle_routing", route=ROUTE)
    one.driver.end(order.goal)
    assert (await one.end_of(order)).state is CANCELLED


async def test_a_cancel_of_what_has_ended_tells_again_how(one: Bench) -> None:
    order = one.begin("drive_stop")
    await one.end_of(order)
    one.driver.end(order.goal)
    await one.until(lambda: len(one.events.ends) == 2)
    assert [outcome.state for _, outcome in one.events.ends] == [SUCCEEDED, SUCCEEDED]


async def test_a_cancel_of_what_the_vehicle_does_not_know_ends_it(one: Bench) -> None:
    order = one.order("drive_stop")
    one.driver.end(order.goal)
    assert (await one.end_of(order)).state is CANCELLED


async def test_a_behavior_takes_over_and_the_old_one_is_not_told_of(one: Bench) -> None:
    old = one.begin("single_vehicle_routing", route=ROUTE)
    await one.running(old)
    new = one.order("hold", duration=0.2, preempts=(old.goal,))
    one.driver.begin(new)
    assert (await one.end_of(new)).state is SUCCEEDED
    assert [goal for goal, _ in one.events.ends] == [new.goal]


async def test_a_held_vehicle_goes_on_when_it_is_resumed(one: Bench) -> None:
    order = one.begin("hold", duration=6.0)
    await one.running(order)
    one.driver.hold()
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(8.0 / SPEED):
            await one.end_of(order)
    one.driver.resume()
    assert (await one.end_of(order)).state is SUCCEEDED


async def test_an_adjusted_behavior_goes_on_with_the_new_value(one: Bench) -> None:
    order = one.begin("single_vehicle_routing", route=ROUTE, speed=1.0)
    await one.running(order)
    one.driver.adjust(order.goal, {"speed": -9.0})  # below the least: left as it was
    one.driver.adjust(order.goal, {"speed": 9.0})
    end = await one.end_of(order)
    assert (end.state, end.reason) == (SUCCEEDED, "at 9 m/s")


async def test_a_driver_on_board_that_raises_fails_the_behavior(one: Bench) -> None:
    end = await one.end_of(one.begin("teleop"))
    assert (end.state, end.reason) == (
        FAILED,
        "internal error of the driver: RuntimeError('no joystick')",
    )


async def test_health_is_what_the_node_says(one: Bench) -> None:
    health = one.driver.health
    assert (health.ready, health.not_ready_reasons, health.battery_fraction) == (True, (), 0.5)


async def test_a_past_epoch_is_rejected(one: Bench) -> None:
    now = one.order("drive_stop")
    new = one.order_of(now.run, 3, "drive_stop")
    one.driver.begin(new)
    await one.end_of(new)
    old = one.order_of(now.run, 2, "drive_stop")
    one.driver.begin(old)
    end = await one.end_of(old)
    assert (end.state, end.reason) == (
        REJECTED,
        "epoch 2 is past: another executive drives the run with epoch 3",
    )
    assert end.code == "STALE_EPOCH"
    await one.until(lambda: (str(now.run), 3) in one.events.newer)


async def test_a_claim_refuses_what_an_earlier_executive_commands(one: Bench) -> None:
    order = one.begin("single_vehicle_routing", route=ROUTE, loop=True)
    await one.running(order)
    one.driver.claim(order.run, 4)
    late = one.order_of(order.run, 3, "drive_stop")
    one.driver.begin(late)
    assert (await one.end_of(late)).code == "STALE_EPOCH"
    await one.until(lambda: (str(order.run), 4) in one.events.newer)


async def test_another_driver_finds_what_runs_and_what_has_ended(
    domain: int, one: Bench, via: Via
) -> None:
    ended = one.begin("reverse")
    await one.end_of(ended)
    order = one.begin("single_vehicle_routing", route=ROUTE, loop=True)
    await one.running(order)
    await one.later()
    begun = one.begun
    await one.driver.close()
    async with bench(domain, "evsg1", via, SPEED) as other:
        await other.later()
        running = await other.driver.query(order)
        assert running.state is RUNNING
        assert running.remaining == (REST if via is Via.TOPICS else None)
        found = await other.driver.query(ended)
        assert (found.state, found.code) == (FAILED, "ROUTE_BLOCKED")
        assert (await other.driver.query(other.order("drive_stop"))).state is UNKNOWN
        other.driver.end(order.goal)
        assert (await other.end_of(order)).state is CANCELLED
        await other.later()
        assert other.begun == begun


async def test_a_start_of_what_is_done_already_begins_nothing(
    domain: int, one: Bench, via: Via
) -> None:
    running = one.begin("single_vehicle_routing", route=ROUTE)
    await one.running(running)
    await one.later()
    begun = one.begun
    await one.driver.close()
    async with bench(domain, "evsg1", via, SPEED) as other:
        other.driver.begin(running)
        await other.running(running)
        other.driver.end(running.goal)
        await other.end_of(running)
        other.driver.begin(running)
        assert (await other.end_of(running)).state is CANCELLED
        await other.later()
        assert other.begun == begun


async def test_a_driver_that_has_forgotten_sends_nothing_more(one: Bench) -> None:
    order = one.begin("hold", duration=0.3)
    await one.running(order)
    one.driver.abandon()
    assert (await one.end_of(one.begin("drive_stop"))).state is SUCCEEDED
    assert order.goal not in [goal for goal, _ in one.events.ends]
