"""Vehicles of plain rclpy whose messages say one thing, and whose odometry shows another."""

import asyncio
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from m2pem_plugin_ros.testing import Peer
from ros_plain_peer import SPEED_M_S
from test_ros_plain_vehicles import PEER, UGV1, Truth, ahead, connected, drives, reasons, until

from m2pem.api import BehaviorReport, BehaviorState
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness

FAILED = BehaviorState.FAILED


@asynccontextmanager
async def driving(
    domain: int, kind: str, fault: str, **settings: Any
) -> AsyncIterator[tuple[ArbiterHarness, Truth]]:
    """A vehicle that drives to a place 500 m ahead."""
    driver = "m2pem" if kind == "node" else kind
    settings = {"driver": driver, "odom_frame": "map", **settings}
    peer = Peer(PEER, domain, ["/ugv1", kind, "map", "Twist", fault])
    await asyncio.to_thread(peer.__enter__)
    try:
        async with connected(domain, **settings) as (bench, truth):
            await until(lambda: bench.latest("ugv1") is not None)
            await drives(bench, truth)
            yield bench, truth
    finally:
        await asyncio.to_thread(peer.__exit__, None, None, None)


async def ended(bench: ArbiterHarness) -> tuple[BehaviorReport, float]:
    """The end, and after how many seconds from now it came."""
    since_us = bench.clock.now_us()
    end = await bench.ended("r1.b1", 40)
    return end, (bench.clock.now_us() - since_us) / 1e6


@pytest.mark.parametrize("kind", ["node", "nav2"])
async def test_a_goal_that_succeeded_far_from_its_target_has_failed(
    ros_domain: int, kind: str
) -> None:
    async with driving(ros_domain, kind, "early") as (bench, truth):
        end, _ = await ended(bench)
        assert (end.state, end.code) == (FAILED, "FAILED")
        away = re.search(r"odometry shows: it is (\d+\.\d) m from its target$", end.reason)
        assert away, end.reason
        assert 490 < float(away[1]) < 500
        assert truth.begun() == 1


async def test_a_cancel_that_a_node_confirms_while_it_drives_on_has_failed(
    ros_domain: int,
) -> None:
    async with driving(ros_domain, "node", "runaway") as (bench, truth):
        await bench.arbiter.cancel("r1.b1", 1)
        end, seconds = await ended(bench)
        assert (end.state, end.code) == (FAILED, "TIMEOUT")
        assert f"it moves at {SPEED_M_S:.1f} m/s" in end.reason
        assert truth.speed() == SPEED_M_S
        assert 6 < seconds < 12


async def test_a_cancel_that_nav2_confirms_while_the_vehicle_drives_on_has_failed(
    ros_domain: int,
) -> None:
    async with driving(ros_domain, "nav2", "runaway") as (bench, _):
        await bench.arbiter.cancel("r1.b1", 1)
        end, _ = await ended(bench)
        assert (end.state, end.code) == (FAILED, "TIMEOUT")
        assert f"the vehicle did not stop: it moves at {SPEED_M_S:.1f} m/s" in end.reason


@pytest.mark.parametrize("kind", ["node", "base"])
async def test_a_position_that_jumps_is_reported(ros_domain: int, kind: str) -> None:
    async with driving(ros_domain, kind, "jump") as (bench, _):
        await until(lambda: "its position has jumped 50 m within 0" in reasons(bench))


async def test_a_base_that_drives_the_other_way_is_stopped_within_metres(ros_domain: int) -> None:
    peer = Peer(PEER, ros_domain, ["/ugv1", "base", "map", "Twist", "backwards"])
    await asyncio.to_thread(peer.__enter__)
    try:
        async with connected(ros_domain, driver="base", odom_frame="map") as (bench, truth):
            await until(lambda: bench.latest("ugv1") is not None)
            await bench.start("r1.b1", "goto", UGV1, target=ahead())
            end, seconds = await ended(bench)
            assert (end.state, end.code) == (FAILED, "ROUTE_BLOCKED")
            assert "it was commanded ahead, and has moved 2 m elsewhere" in end.reason
            assert seconds < 15
            await until(lambda: truth.speed() == 0.0)
    finally:
        await asyncio.to_thread(peer.__exit__, None, None, None)


async def test_what_is_true_ends_as_reported(ros_domain: int) -> None:
    async with driving(ros_domain, "node", "") as (bench, _):
        await bench.arbiter.cancel("r1.b1", 1)
        end, seconds = await ended(bench)
        assert end.state is BehaviorState.CANCELLED
        assert seconds < 5
