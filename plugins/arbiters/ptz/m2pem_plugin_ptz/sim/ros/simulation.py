"""All simulated cameras of a process: time passes for them."""

import asyncio
from collections.abc import Sequence

from m2pem_plugin_ros.runtime import RosRuntime

from m2pem.api import Clock
from m2pem_plugin_ptz.sim.ros.camera import CameraSpec, SimulatedCamera

TICK_S = 0.02
NODE = "m2pem_sim_cameras"


async def simulate(
    specs: Sequence[CameraSpec], clock: Clock, domain_id: int | None, ready: asyncio.Event
) -> None:
    """Simulate them until it is cancelled. `ready` is set when they listen. `domain_id`: of those
    whose fleet does not say; None takes ROS_DOMAIN_ID."""
    runtimes: dict[int | None, RosRuntime] = {}
    try:
        cameras = []
        for spec in specs:
            domain = spec.settings.domain_id
            domain = domain_id if domain is None else domain
            if domain not in runtimes:
                runtimes[domain] = RosRuntime(NODE, domain_id=domain)
            cameras.append(SimulatedCamera(runtimes[domain], spec, clock))
        ready.set()
        while True:
            for camera in cameras:
                camera.step()
            await asyncio.sleep(TICK_S)
    finally:
        for runtime in runtimes.values():
            await runtime.close()
