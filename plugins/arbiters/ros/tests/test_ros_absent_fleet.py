"""Many vehicles that are not there hold nothing up, however much else is there."""

import asyncio
import logging
from collections import Counter
from typing import Any

import pytest
from m2pem_plugin_ros.connections import ConnectionsSetup, DdsConnections
from m2pem_plugin_ros.settings import read_settings
from nav_msgs.msg import Odometry
from rclpy.node import Node
from ros_face_client import Client, until

from m2pem.api import ArbiterContext, Connection, ResourceId
from m2pem.api.clock import SystemClock
from m2pem.telemetry.bus import Bus

MANY = 20
ORIGIN = (38.1075, -77.3192, 60.0)


def fleet(domain: int) -> DdsConnections:
    """Plain bases in /rover0, /rover1, ..."""
    known = {
        ResourceId(f"rover{number}"): Connection(
            ResourceId(f"rover{number}"),
            "ground",
            {"namespace": f"/rover{number}", "driver": "base", "domain_id": domain},
            sitl=True,
        )
        for number in range(MANY)
    }
    context = ArbiterContext(SystemClock(), Bus(), logging.getLogger("m2pem.arbiter"), ORIGIN)
    return DdsConnections(
        ConnectionsSetup(known, read_settings(known), {}, context, lambda _: None)
    )


async def test_vehicles_in_other_namespaces_are_looked_for_together(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks, info = Counter[str](), Node.get_publishers_info_by_topic

    def counted(self: Node, topic: str, *arguments: Any) -> Any:
        looks[self.get_name()] += 1
        return info(self, topic, *arguments)

    async with Client(ros_domain) as others:
        for number in range(MANY):
            others.node.create_publisher(Odometry, f"/robot{number}/odom", 10)
        connections = fleet(ros_domain)
        vehicles = await connections.open()
        try:
            node = vehicles[ResourceId("rover0")].ros.node

            def known() -> bool:
                found = [info(node, f"/robot{number}/odom") for number in range(MANY)]
                return all(each and each[0].node_name == "client" for each in found)

            await until(known)
            monkeypatch.setattr(Node, "get_publishers_info_by_topic", counted)
            said = [each.endpoints.absence for each in vehicles.values()]
        finally:
            await connections.close()
    assert all("the same topic is in the namespace /robot0, " in each for each in said)
    # Its own topic each, and those of the others once, or twice if that takes a second.
    assert looks.total() <= 4 * MANY


async def test_a_fleet_is_subscribed_to_in_steps(ros_domain: int) -> None:
    async def count() -> None:
        nonlocal rounds
        while True:
            rounds += 1
            await asyncio.sleep(0)

    rounds = 0
    counting = asyncio.create_task(count())
    connections = fleet(ros_domain)
    try:
        await connections.open()
        assert rounds >= MANY
    finally:
        counting.cancel()
        await connections.close()
