"""Runs all simulated cameras of a process."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import replace

from m2pem_plugin_ros import OnboardNode, RosRuntime

from m2pem.api import Clock
from m2pem.api.latest_task import cancel_and_wait
from m2pem_plugin_ptz.onboard import camera_node
from m2pem_plugin_ptz.simulator.ros.camera import CameraSpec, NodeSpec, SimulatedCamera

TICK_S = 0.02
NODE = "m2pem_sim_cameras"


async def simulate(
    specs: Sequence[CameraSpec], clock: Clock, domain_id: int | None, ready: Callable[[], None]
) -> None:
    """Simulate until cancelled. `ready` is called when all cameras are subscribed. `domain_id`: for
    cameras whose fleet has none; None takes ROS_DOMAIN_ID."""
    runtimes: dict[int | None, RosRuntime] = {}
    nodes: list[OnboardNode] = []
    moving: asyncio.Task[None] | None = None
    try:
        cameras = []
        for spec in specs:
            domain = spec.settings.domain_id
            domain = domain_id if domain is None else domain
            if domain not in runtimes:
                runtimes[domain] = RosRuntime(NODE, domain_id=domain)
            ros = runtimes[domain]
            cameras.append(SimulatedCamera(ros, spec, clock))
            if spec.node is not None:
                nodes.append(_node(ros, spec.node, domain, clock))
        moving = asyncio.get_running_loop().create_task(_move(cameras))
        await asyncio.gather(*(node.open() for node in nodes))
        ready()
        await moving
    finally:
        await asyncio.gather(*(node.close() for node in nodes), return_exceptions=True)
        await cancel_and_wait(moving)
        for runtime in runtimes.values():
            await runtime.close()


def _node(ros: RosRuntime, spec: NodeSpec, domain: int | None, clock: Clock) -> OnboardNode:
    settings = dict(spec.connection.settings)
    if domain is not None:
        settings["domain_id"] = domain
    connection = replace(spec.connection, settings=settings)
    return camera_node(ros, connection, spec.namespace, clock, spec.origin)


async def _move(cameras: Sequence[SimulatedCamera]) -> None:
    while True:
        for camera in cameras:
            camera.step()
        await asyncio.sleep(TICK_S)
