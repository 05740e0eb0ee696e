"""A camera driver over real DDS; the camera is simulated in another process."""

import asyncio
import json
import logging
import math
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from m2pem_plugin_ptz.drivers.driver import DriverSetup
from m2pem_plugin_ptz.drivers.ros import RosDriver
from m2pem_plugin_ptz.settings import DriverName, Settings
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.testing import Peer
from ptz_ros_camera_peer import ENDLESS, REACH
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from m2pem.api import ArbiterContext, Connection, ResourceId
from m2pem.api.clock import SystemClock
from m2pem.telemetry.bus import Bus

CAMERA = ResourceId("evsg2/ptz")
PEER = Path(__file__).with_name("ptz_ros_camera_peer.py")
AMPLE_S = 40.0


async def until(true: Callable[[], Any]) -> None:
    """Wait until something is so, or fail."""
    async with asyncio.timeout(AMPLE_S):
        while not true():  # noqa: ASYNC110  # what is heard has no event
            await asyncio.sleep(0.01)


def make_driver(
    settings: dict[str, Any], folder: Path, heard: Callable[[], None], *, endless: bool = False
) -> RosDriver:
    context = ArbiterContext(SystemClock(), Bus(), logging.getLogger("test"), (38.1, -77.3, 60.0))
    reach = ENDLESS if endless else REACH
    own = Settings(DriverName.ROS, reach, pictures=folder, own=settings)
    return RosDriver(DriverSetup(Connection(CAMERA, "ground", settings), own, context, heard))


@dataclass
class World:
    """The driver, and what anybody hears of the camera. `joints`: positions by name, as told."""

    driver: RosDriver
    ros: RosRuntime
    folder: Path
    joints: dict[str, float] = field(default_factory=dict)
    history: list[dict[str, float]] = field(default_factory=list)
    heard: list[float] = field(default_factory=list)
    confirmed: list[str] = field(default_factory=list)

    def open(self) -> None:
        self.ros.subscribe(JointState, "/evsg2/joint_states", self._on_message, qos.TELEMETRY)
        self.ros.subscribe(String, "/evsg2/sim_fault_is", self._hear_fault, qos.STATUS)
        self._faults = self.ros.node.create_publisher(String, "/evsg2/sim_fault", qos.COMMANDS)

    def _on_message(self, message: Any) -> None:
        self.joints = dict(zip(message.name, message.position, strict=True))
        self.history.append(self.joints)

    def _hear_fault(self, message: Any) -> None:
        self.confirmed.append(message.data)

    async def ready(self) -> None:
        await until(lambda: self.driver.missing("ptz_point_at") == "" and self.joints)
        await until(lambda: self.driver.missing("take_picture") == "")

    async def stands(self, count: int = 10) -> None:
        """Wait until so many samples, heard from now on, say the same."""
        since = len(self.history)

        def alike() -> bool:
            last = self.history[since:][-count:]
            return len(last) == count and all(
                max(each[name] for each in last) - min(each[name] for each in last) < 1e-3
                for name in last[0]
            )

        await until(alike)

    async def send_fault(self, text: str) -> None:
        await until(self._faults.get_subscription_count)
        self._faults.publish(String(data=text))

    async def fault(self, text: str) -> None:
        await self.send_fault(text)
        await until(lambda: self.confirmed[-1:] == [text])

    def point(self, pan_deg: float, tilt_deg: float, rate_deg_s: float | None = None) -> None:
        rate = None if rate_deg_s is None else math.radians(rate_deg_s)
        self.driver.point(math.radians(pan_deg), math.radians(tilt_deg), rate)

    def joint_deg(self, name: str) -> float:
        return math.degrees(self.joints[name])

    def joints_are(self, within_deg: float = 0.5, **degrees: float) -> bool:
        return all(abs(self.joint_deg(n) - each) < within_deg for n, each in degrees.items())


@asynccontextmanager
async def world(
    domain: int, folder: Path, *, endless: bool = False, camera: bool = True, **own: Any
) -> AsyncIterator[World]:
    """`own`: of the connection."""
    settings = {"namespace": "/evsg2", "domain_id": domain, **own}
    arguments = [CAMERA, json.dumps(settings), "yes" if endless else "no"]
    heard: list[float] = []
    loop = asyncio.get_running_loop()
    driver = make_driver(settings, folder, lambda: heard.append(loop.time()), endless=endless)
    peer = Peer(PEER, domain, arguments) if camera else None
    try:
        if peer is not None:
            await asyncio.to_thread(peer.__enter__)
        async with RosRuntime("watching", domain_id=domain) as ros:
            await driver.open()
            it = World(driver, ros, folder, heard=heard)
            it.open()
            try:
                yield it
            finally:
                await driver.close()
    finally:
        if peer is not None:
            await asyncio.to_thread(peer.__exit__, None, None, None)
