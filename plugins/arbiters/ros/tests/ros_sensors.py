"""A peer's sensors, as tests have them speak, and what an arbiter makes of it."""

import asyncio
import json
import math
from collections.abc import Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from uuid import uuid4

from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.runtime import RosRuntime, qos
from ros_double import ORIGIN, DoubleDriver, Dynamics
from std_msgs.msg import String

from m2pem.api import Connection, ResourceId
from m2pem.api.clock import SystemClock
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

PEER = Path(__file__).with_name("ros_sensors_peer.py")
AMPLE_S = 40.0
V, GPR = ResourceId("evsg1"), ResourceId("evsg1/gpr")
TOPICS = (
    "nav_msgs/Odometry@/evsg1/odom",
    "sensor_msgs/NavSatFix@/evsg1/fix",
    "sensor_msgs/BatteryState@/evsg1/battery_state",
    "diagnostic_msgs/DiagnosticArray@/diagnostics",
    "m2pem_interfaces/Detection@/evsg1/detections",
    "std_msgs/String@/evsg1/words",
    "tf2_msgs/TFMessage@/tf",
    "tf2_msgs/TFMessage@/tf_static",
)


async def until(true: Callable[[], object], what: str = "") -> None:
    try:
        async with asyncio.timeout(AMPLE_S):
            while not true():  # noqa: ASYNC110  # what is waited for has no event
                await asyncio.sleep(0.01)
    except TimeoutError:
        raise AssertionError(f"not within {AMPLE_S:g} s: {what}") from None


def odometry(
    east: float,
    north: float,
    yaw: float = 0.0,
    forward: float = 0.0,
    stamp: int = 0,
    frame: str = "map",
    child: str = "",
):
    fields = {
        "header": {"stamp": {"sec": stamp}, "frame_id": frame},
        "child_frame_id": child,
        "pose": {
            "pose": {
                "position": {"x": east, "y": north},
                "orientation": {"z": math.sin(yaw / 2), "w": math.cos(yaw / 2)},
            }
        },
        "twist": {"twist": {"linear": {"x": forward}, "angular": {"z": 0.0}}},
    }
    return ("/evsg1/odom", fields)


def transform(
    parent: str,
    child: str,
    east: float,
    north: float,
    yaw: float = 0.0,
    stamp: int = 0,
    topic: str = "/tf",
):
    fields = {
        "header": {"stamp": {"sec": stamp}, "frame_id": parent},
        "child_frame_id": child,
        "transform": {
            "translation": {"x": east, "y": north},
            "rotation": {"z": math.sin(yaw / 2), "w": math.cos(yaw / 2)},
        },
    }
    return (topic, {"transforms": [fields]})


def fix(latitude: float, longitude: float, altitude: float = 60.0, status: int = 0):
    fields = {"latitude": latitude, "longitude": longitude, "altitude": altitude}
    return ("/evsg1/fix", {**fields, "status": {"status": status}})


class Sensors:
    """Has the peer speak."""

    def __init__(self, ros: RosRuntime) -> None:
        self.ros = ros
        self._recent: asyncio.Queue[String] = asyncio.Queue()
        self._say = ros.node.create_publisher(String, "/say", qos.EVENTS)
        ros.subscribe(String, "/said", self._recent.put_nowait, qos.EVENTS)

    async def say(self, *messages: tuple[str, dict]) -> None:
        """All were published when this returns."""
        await until(self._say.get_subscription_count, "the peer listens")
        await until(lambda: self.ros.node.count_publishers("/said"), "the peer answers")
        self._say.publish(String(data=json.dumps(messages)))
        async with asyncio.timeout(AMPLE_S):
            await self._recent.get()

    async def repeat(
        self, until_true: Callable[[], object], what: str, *messages: tuple[str, dict]
    ) -> None:
        """Say it again and again, as sensors do, until something is so.

        What is said just when DDS has two find each other may be lost, and what is said to who
        is about to leave is not heard by who comes: only who was heard once is heard surely.
        """
        try:
            async with asyncio.timeout(AMPLE_S):
                while not until_true():
                    await self.say(*messages)
                    await asyncio.sleep(0.05)
        except TimeoutError:
            raise AssertionError(f"not within {AMPLE_S:g} s: {what}") from None


@asynccontextmanager
async def sensors(domain: int):
    async with RosRuntime("teller", domain_id=domain) as ros:
        yield Sensors(ros)


@asynccontextmanager
async def connected(domain: int, payloads: dict | None = None, **settings):
    """An arbiter over DDS, whose vehicle is heard always; only what it senses is from the peer."""
    own = {"namespace": "/evsg1", "domain_id": domain, **settings}
    connections = {V: Connection(V, "ground", own, sitl=True)}
    for name, said in (payloads or {}).items():
        connections[name] = Connection(name, "ground", {**own, **said}, detector=True, sitl=True)
    clock = SystemClock()
    lent = replace(context(clock), origin=ORIGIN, journal=uuid4())
    body = Dynamics()
    arbiter = RosArbiter(connections, lent, lambda setup: DoubleDriver(setup, body))
    async with ArbiterHarness(arbiter, clock) as bench:
        yield bench
