"""The face leaves the frames of ROS vehicles to them: m2pem reads their odometry by tf."""

import asyncio
from pathlib import Path
from typing import Any

from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.testing import Peer
from ros_face_client import STATIC, faced, until
from tf2_msgs.msg import TFMessage

from m2pem.api import VehicleState
from m2pem.fleet.fleet import Fleet
from m2pem.testing import scenarios

PEER = Path(__file__).with_name("ros_plain_peer.py")


def fleet(domain: int) -> Fleet:
    base = {"domain_id": domain, "driver": "base"}
    vehicles = {
        "lost": {**base, "namespace": "/lost"},
        "ugv1": {**base, "namespace": "/ugv1"},
        "slam": {**base, "namespace": "/slam", "odom_frame": "tf"},
    }
    return scenarios.fleet("ros", vehicles)


async def test_odometry_that_nobody_places_is_not_placed_by_the_face(ros_domain: int) -> None:
    states: dict[str, VehicleState] = {}

    async def follow(control: Any) -> None:
        async for state in control.telemetry():
            if isinstance(state, VehicleState):
                states[state.resource] = state

    arbiters = {"ros": RosArbiter}
    with (
        Peer(PEER, ros_domain, ["/lost", "base", "lost/odom"]),
        Peer(PEER, ros_domain, ["/ugv1", "base", "map"]),
        Peer(PEER, ros_domain, ["/slam", "base", "slam/odom"]),
    ):
        async with faced(ros_domain, of=fleet(ros_domain), arbiters=arbiters, speed=1.0) as world:
            static = world.client.hear("/tf_static", TFMessage, STATIC)
            moving = world.client.hear("/tf", TFMessage)
            following = asyncio.create_task(follow(world.control))
            await until(lambda: static and moving)
            seen = len(moving)
            await until(lambda: len(moving) > seen + 10)
            await until(lambda: {"lost", "slam"} <= states.keys())
            following.cancel()
    told = [each for message in (*static, *moving) for each in message.transforms]
    frames = {(each.header.frame_id, each.child_frame_id) for each in told}
    assert frames == {("earth", "map"), ("map", "ugv1/base_link")}
    assert "no transform from 'map' to 'lost/odom'" in states["lost"].not_ready_reasons[0]
    assert "no transform from 'map' to 'base_link'" in states["slam"].not_ready_reasons[0]
