"""Searches other ROS domains for vehicles that are not in that of the fleet."""

import asyncio
import contextlib
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

from m2pem_plugin_ros.installation import RosError
from m2pem_plugin_ros.sensors.endpoints import Endpoints

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime

LOOK_EVERY_S = 0.1


async def search_domains(
    absent: Collection[Endpoints],
    domains: Collection[int],
    known: Mapping[int, "RosRuntime"],
    within_s: float,
) -> None:
    """Set `elsewhere` of the absent vehicles that are found in one of the domains within a time.

    Nothing is published or subscribed to there. `known` are connections that are open already.
    """
    from m2pem_plugin_ros.runtime import RosRuntime  # noqa: PLC0415  # it needs rclpy

    loop = asyncio.get_running_loop()
    until_s = loop.time() + within_s
    async with contextlib.AsyncExitStack() as opened:
        nodes = {}
        for domain in sorted(domains):
            runtime = known.get(domain)
            if runtime is None:
                try:
                    made = RosRuntime("m2pem_search", domain_id=domain)
                except RosError:
                    continue  # that domain cannot be looked into, such as for want of ports
                runtime = await opened.enter_async_context(made)
            nodes[domain] = runtime.node
        while loop.time() < until_s:
            for each in absent:
                topic = each.awaited.topic
                each.elsewhere = tuple(
                    domain
                    for domain, node in nodes.items()
                    if domain != each.domain and node.count_publishers(topic)
                )
            if all(each.elsewhere or each.is_listed for each in absent):
                return
            await asyncio.sleep(LOOK_EVERY_S)
