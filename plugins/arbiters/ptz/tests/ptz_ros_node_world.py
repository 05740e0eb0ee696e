"""A payload with an m2pem node, in another process, and the arbiter `ros` that commands it."""

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.testing import Peer

from m2pem.api import (
    ArbiterContext,
    Connection,
    GeoPosition,
    LinkState,
    PayloadState,
    ResourceId,
    VehicleState,
)
from m2pem.api.clock import SystemClock
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

COMMAND = Path(__file__).with_name("ptz_ros_sim_command.py")
CAMERA, OTHER = ResourceId("ugv1/ptz"), ResourceId("ugv2/ptz")
PLACE = GeoPosition(38.1075, -77.3192, 60.0)
AMPLE_S = 40.0
LOST_AFTER_S = 4.0
"""On a machine that is busy, who is well may be silent for a second or two."""

FLEET = """
version: 1
name: cameras with nodes
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
vehicles:
  {vehicle}:
    domain: ground
    arbiter: mavlink
    sitl: true
    payloads:
      ptz:
        arbiter: ros
        connection:
          driver: m2pem
          namespace: /{vehicle}/ptz
          sim:
            reach:
              {{pan: [-160 deg, 160 deg], tilt: [-85 deg, 45 deg], rate: 2 rad/s, zoom_max: 10}}
            joints: {{zoom: zoom_joint}}
            pictures: {pictures}
"""


def peer(domain: int, camera: ResourceId, folder: Path) -> Peer:
    """The simulated payload, of a fleet file, in a process of its own."""
    vehicle = camera.partition("/")[0]
    file = folder / f"{vehicle}.yaml"
    file.write_text(FLEET.format(vehicle=vehicle, pictures=folder / "pictures"), "utf-8")
    return Peer(COMMAND, domain, ["ros-cameras", "--fleet", str(file)])


def connection(camera: ResourceId, domain: int, **settings: Any) -> Connection:
    """As an executive has it."""
    own = {
        "driver": "m2pem",
        "namespace": f"/{camera}",
        "domain_id": domain,
        **settings,
    }
    return Connection(camera, "ground", own, lost_after_s=LOST_AFTER_S, sitl=True)


def place_carriers(lent: ArbiterContext) -> None:
    """Both vehicles stand, and look north."""
    for camera in (CAMERA, OTHER):
        vehicle = ResourceId(camera.partition("/")[0])
        now_us = lent.clock.now_us()
        north = {"yaw_rad": math.pi / 2, "velocity_enu_m_s": (0.0, 0.0, 0.0)}
        lent.bus.publish(VehicleState(vehicle, now_us, PLACE, **north))


@dataclass
class World:
    """`lent`: what the arbiter was given."""

    bench: ArbiterHarness
    lent: ArbiterContext

    @property
    def state(self) -> PayloadState | None:
        state = self.bench.latest(CAMERA)
        return state if isinstance(state, PayloadState) else None

    async def heard(self) -> PayloadState:
        """Wait until the camera says where it looks."""

        def is_there() -> bool:
            state = self.state
            return state is not None and state.pan_rad is not None

        assert await self.bench.until(is_there, AMPLE_S)
        assert self.state is not None
        return self.state

    async def lost(self) -> PayloadState:
        def is_lost() -> bool:
            return self.state is not None and self.state.link is LinkState.LOST

        assert await self.bench.until(is_lost, AMPLE_S)
        assert self.state is not None
        return self.state


@asynccontextmanager
async def world(domain: int, folder: Path, **settings: Any) -> AsyncIterator[World]:
    """`settings`: of the connection."""
    clock = SystemClock()
    lent = context(clock)
    place_carriers(lent)
    camera = peer(domain, CAMERA, folder)
    await asyncio.to_thread(camera.__enter__)
    try:
        arbiter = RosArbiter({CAMERA: connection(CAMERA, domain, **settings)}, lent)
        async with ArbiterHarness(arbiter, clock) as bench:
            it = World(bench, lent)
            await it.heard()
            yield it
    finally:
        await asyncio.to_thread(camera.__exit__, None, None, None)
