"""Nodes on vehicles that break the rules: the driver tells what is true, once, and goes on."""

import asyncio
import logging
from collections.abc import Iterator
from pathlib import Path

import pytest
from m2pem_plugin_ros.settings import Via
from m2pem_plugin_ros.testing import Peer, reserved_domain
from ros_node_bench import AMPLE_S, FAILED, REJECTED, SUCCEEDED, Bench, bench

LIARS = Path(__file__).with_name("ros_lying_peer.py")


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with reserved_domain() as domain, Peer(LIARS, domain):
        yield domain


def ticks(one: Bench) -> int:
    """How many vehicle statuses the liar had sent when its last was heard."""
    return int(one.driver.health.mode or 0)


async def listen(one: Bench) -> None:
    """Until all that the liar has said by now was heard."""
    now = ticks(one)
    await one.until(lambda: ticks(one) >= now + 3)


async def test_statuses_of_other_behaviors_and_none_are_ignored(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    async with bench(domain, "stranger") as one:
        order = one.begin("goto")
        await one.running(order)
        await listen(one)
        assert one.events.ends == []
        assert "a status of a behavior that was not sent: r1.b1" in caplog.text
        assert "a status without an id" in caplog.text


@pytest.mark.parametrize("lie", ["parrot", "flood"])
async def test_an_end_is_told_once_and_numbers_that_fall_are_ignored(
    domain: int, lie: str, caplog: pytest.LogCaptureFixture
) -> None:
    async with bench(domain, lie) as one:
        for _ in range(3):
            order = one.begin("drive_stop")
            assert (await one.end_of(order)).state is SUCCEEDED
        await listen(one)
        assert [outcome.state for _, outcome in one.events.ends] == [SUCCEEDED] * 3
    assert len(caplog.records) < 20, "complaints are bounded"


async def test_a_node_that_is_there_and_answers_no_start_has_failed(domain: int) -> None:
    async with bench(domain, "mute", speed=10.0) as one:
        end = await one.end_of(one.begin("goto"))
        assert (end.state, end.code) == (FAILED, "TIMEOUT")
        assert end.reason == "the vehicle's node answered no START for 10 s"


async def test_a_node_that_refuses_a_goal_has_rejected_it(domain: int) -> None:
    async with bench(domain, "refuser", Via.ACTION) as one:
        assert (await one.end_of(one.begin("goto"))).state is REJECTED


async def test_of_a_result_that_is_another_ones_the_goal_itself_is_believed(domain: int) -> None:
    async with bench(domain, "fool", Via.ACTION) as one:
        end = await one.end_of(one.begin("goto"))
        assert end.state is SUCCEEDED
        assert "is a status of another" in end.reason


async def test_holding_what_never_says_it_is_held_ends_some_time(domain: int) -> None:
    async with bench(domain, "parrot", speed=20.0) as one:
        commands = 0

        def count(_: object) -> None:
            nonlocal commands
            commands += 1

        from m2pem_interfaces.msg import BehaviorCommand
        from m2pem_plugin_ros.runtime import qos

        one.ros.subscribe(BehaviorCommand, "/parrot/command", count, qos.COMMANDS)
        await one.alive()
        one.driver.hold()
        await one.until(lambda: commands >= 15)
        before = 0
        async with asyncio.timeout(AMPLE_S):  # those while the node is silent do not count
            while before != commands:
                before = commands
                await one.clock.sleep(20.0)
