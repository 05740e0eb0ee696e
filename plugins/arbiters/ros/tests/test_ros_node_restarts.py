"""Nodes that are not there yet, are killed, restarted, or ended, while a behavior goes on."""

import asyncio
import re
import signal
from pathlib import Path

import pytest
from m2pem_plugin_ros.settings import Via
from m2pem_plugin_ros.testing import Peer
from ros_node_bench import CANCELLED, LOST, RUNNING, SUCCEEDED, UNKNOWN, bench

from m2pem.api import Route

NODE = Path(__file__).with_name("ros_onboard_peer.py")
SPEED = 2.0
"""Of time, for the vehicle and for who commands it. A node has a second of it to say its last."""

ROUTE = Route(((38.0, -77.0, None), (38.001, -77.0, None)))


@pytest.fixture(params=[Via.TOPICS, pytest.param(Via.ACTION, marks=pytest.mark.long)])
def via(request: pytest.FixtureRequest) -> Via:
    return Via(request.param)


async def start_peer(domain: int) -> Peer:
    """A node that is there; the loop goes on while it starts."""
    return await asyncio.to_thread(lambda: Peer(NODE, domain, [f"{SPEED:g}", "evsg1"]).__enter__())


async def end_peer(peer: Peer) -> None:
    await asyncio.to_thread(peer.__exit__, None, None, None)


async def test_a_start_before_the_node_is_there_is_done_once_it_is(
    ros_domain: int, via: Via
) -> None:
    async with bench(ros_domain, "evsg1", via, SPEED) as one:
        order = one.begin("single_vehicle_routing", route=ROUTE)
        peer = await start_peer(ros_domain)
        await one.running(order)
        await one.later()
        assert one.begun == 1
        await end_peer(peer)
        end = await one.end_of(order)
        assert (end.state, end.reason) == (CANCELLED, "the node on the vehicle was stopped")


@pytest.mark.parametrize("via", list(Via))
async def test_a_node_that_is_killed_and_restarted_has_lost_the_behavior(
    ros_domain: int, via: Via
) -> None:
    async with bench(ros_domain, "evsg1", via, SPEED) as one:
        peer = await start_peer(ros_domain)
        order = one.begin("single_vehicle_routing", route=ROUTE)
        await one.running(order)
        peer.kill()
        again = await start_peer(ros_domain)
        end = await one.end_of(order)
        assert (end.state, end.code) == (LOST, "LINK_LOST")
        assert end.reason == "the vehicle's node was restarted and does not have the behavior"
        assert (await one.end_of(one.begin("drive_stop"))).state is SUCCEEDED
        await one.later()
        assert one.begun == 1
        await end_peer(again)


@pytest.mark.long
async def test_both_sides_are_restarted_and_nothing_is_known(ros_domain: int, via: Via) -> None:
    async with bench(ros_domain, "evsg1", via, SPEED) as one:
        peer = await start_peer(ros_domain)
        order = one.begin("single_vehicle_routing", route=ROUTE)
        await one.running(order)
        peer.kill()
    again = await start_peer(ros_domain)
    async with bench(ros_domain, "evsg1", via, SPEED) as other:
        await other.later()
        assert (await other.driver.query(order)).state is UNKNOWN
        await end_peer(again)


async def test_nobody_is_there_to_be_looked_at(ros_domain: int) -> None:
    async with bench(ros_domain, "evsg1", speed=SPEED) as one:
        found = await one.driver.query(one.order("drive_stop"))
        assert (found.state, found.reason) == (
            UNKNOWN,
            "the vehicle's node did not answer within 3 s",
        )


async def test_what_ended_while_nobody_listened_is_found(ros_domain: int, via: Via) -> None:
    peer = await start_peer(ros_domain)
    async with bench(ros_domain, "evsg1", via, SPEED) as one:
        order = one.begin("hold", duration=2.5)
        await one.running(order)
    async with bench(ros_domain, "evsg1", via, SPEED) as other:
        await other.later()
        if (found := await other.driver.query(order)).state is RUNNING:
            found = await other.end_of(order)
        assert found.state is SUCCEEDED
    await end_peer(peer)


async def test_a_node_that_hears_no_vehicle_any_more_says_it_is_lost(ros_domain: int) -> None:
    peer = await start_peer(ros_domain)
    async with bench(ros_domain, "evsg1", speed=SPEED) as one:
        order = one.begin("single_vehicle_routing", route=ROUTE)
        await one.running(order)
        peer.process.send_signal(signal.SIGUSR1)
        end = await one.end_of(order)
        assert (end.state, end.code) == (LOST, "LINK_LOST")
        assert re.search(r"the vehicle has sent no message for \d+\.\d s", end.reason)
        await one.until(lambda: one.driver.health.ready is False)
        assert "no message for" in one.driver.health.not_ready_reasons[0]
        refused = await one.end_of(one.begin("drive_stop"))
        assert "no message for" in refused.reason
    await end_peer(peer)
