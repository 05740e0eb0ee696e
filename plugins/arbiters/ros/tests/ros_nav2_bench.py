"""A Nav2Driver in the test's process, told what the arbiter would tell it."""

import asyncio
import logging
import math
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

from m2pem_plugin_ros.drivers.driver import DriverSetup, Order, Outcome
from m2pem_plugin_ros.drivers.nav2 import Nav2Driver
from m2pem_plugin_ros.frames import to_geodetic, to_local
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.sensors.localization import TopicLocalization
from m2pem_plugin_ros.settings import DriverName, RouteAction, Settings
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import String, UInt32

from m2pem.api import (
    ArbiterContext,
    BehaviorRequest,
    BehaviorState,
    Connection,
    PayloadState,
    Point,
    ResolvedValue,
    ResourceId,
    Route,
    SystemClock,
    VehicleState,
)

PEER = Path(__file__).with_name("ros_nav2_peer.py")
ORIGIN = (38.1075, -77.3192, 60.0)
VEHICLE = ResourceId("ugv1")
AMPLE_S = 40.0

ALL = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For who looks only now and then, and must miss nothing."""


@dataclass
class Bus:
    """What the other vehicles say."""

    states: dict[ResourceId, VehicleState] = field(default_factory=dict)

    def latest(self, resource: ResourceId) -> VehicleState | PayloadState | None:
        return self.states.get(resource)

    def publish(self, state: VehicleState | PayloadState) -> None:
        assert isinstance(state, VehicleState)
        self.states[state.resource] = state

    def subscribe(self, size: int = 100) -> AsyncIterator[VehicleState | PayloadState]:
        raise NotImplementedError


def at(east_m: float, north_m: float) -> Point:
    """A target there."""
    position = to_geodetic(east_m, north_m, 0.0, ORIGIN)
    return Point((position.latitude_deg, position.longitude_deg, None))


def along(*places: tuple[float, float]) -> Route:
    """A route there."""
    return Route(tuple(at(*place).position for place in places))


class Diary:
    """What the driver has told."""

    def __init__(self) -> None:
        self.outcomes: dict[UUID, Outcome] = {}
        self.begun: list[UUID] = []
        self.heards = 0

    def alive(self) -> None:
        self.heards += 1

    def progress(self, goal: UUID) -> None:
        self.begun.append(goal)

    def ended(self, goal: UUID, outcome: Outcome) -> None:
        self.outcomes[goal] = outcome


class Bench:
    """The driver, and what it has told. `track`: speed, east and north in all odometry so far."""

    def __init__(self, ros: RosRuntime, route_action: RouteAction, name: ResourceId) -> None:
        self.ros = ros
        self.name = name
        self.events = Diary()
        self.bus = Bus()
        self.motions = -1
        self.track: list[tuple[float, float, float]] = []
        settings = Settings(f"/{name}", driver=DriverName.NAV2, route_action=route_action)
        context = ArbiterContext(SystemClock(), self.bus, logging.getLogger("bench"), ORIGIN)
        self.localization = TopicLocalization(ros, name, settings, context)
        connection = Connection(name, "ground", sitl=True)
        self.setup = DriverSetup(connection, settings, context, ros, self.localization, self.events)
        self.driver = Nav2Driver(self.setup)
        self._obeyed: list[str] = []
        self._words = ros.node.create_publisher(String, f"/{name}/words", qos.EVENTS)
        self._obeyed_topic = f"/{name}/obeyed"
        ros.subscribe(String, self._obeyed_topic, lambda m: self._obeyed.append(m.data), qos.EVENTS)
        ros.subscribe(UInt32, f"/{name}/motions", self._count, qos.STATUS)
        ros.subscribe(Odometry, f"/{name}/odom", self._follow, ALL)

    async def ready(self) -> None:
        await self.until(lambda: self.driver.health.ready and self.localization.pose is not None)
        await self.until(self._words.get_subscription_count)
        await self.until(lambda: self.ros.node.count_publishers(self._obeyed_topic))
        await self.until(lambda: self.motions >= 0)
        await self.until(lambda: self.ros.node.count_subscribers(f"/{self.name}/speed_limit"))

    def order(self, behavior: str, goal: UUID | None = None, **wishes: ResolvedValue) -> Order:
        request = BehaviorRequest("r1.b1", 1, behavior, wishes, (VEHICLE,))
        return Order(request, goal or uuid4(), uuid4())

    def begin(self, behavior: str, **wishes: ResolvedValue) -> UUID:
        order = self.order(behavior, **wishes)
        assert self.driver.refusal(order.request) == ""
        self.driver.begin(order)
        return order.goal

    def begin_anyway(self, behavior: str, **wishes: ResolvedValue) -> UUID:
        order = self.order(behavior, **wishes)
        self.driver.begin(order)
        return order.goal

    async def outcome(self, goal: UUID) -> Outcome:
        await self.until(lambda: goal in self.events.outcomes)
        return self.events.outcomes[goal]

    async def state(self, goal: UUID) -> BehaviorState:
        return (await self.outcome(goal)).state

    async def until(self, holds: Callable[[], object], within_s: float = AMPLE_S) -> None:
        async with asyncio.timeout(within_s):
            while not holds():  # noqa: ASYNC110  # what is looked at has no event
                await asyncio.sleep(0.01)

    async def later(self, count: int = 20) -> None:
        """Wait for so much odometry from now on: what was said before it was heard, too."""
        since = len(self.track)
        await self.until(lambda: len(self.track) >= since + count)

    async def passed(self, *places: tuple[float, float], within_m: float = 0.5) -> None:
        """Wait until it has come by these places, one after the other."""

        def all_passed() -> bool:
            left = list(places)
            for _, *here in self.track:
                if left and math.dist(here, left[0]) <= within_m:
                    del left[0]
            return not left

        await self.until(all_passed)

    async def moving(self, goal: UUID | None = None) -> None:
        if goal is not None:
            await self.until(lambda: goal in self.events.begun)
        await self.until(lambda: self.speed_m_s > 0.5)

    async def say(self, words: str) -> None:
        """Change the peer; returns when it has."""
        self._obeyed.clear()
        self._words.publish(String(data=words))
        await self.until(lambda: words in self._obeyed)

    @property
    def speed_m_s(self) -> float:
        twist = self.localization.twist
        return 0.0 if twist is None else abs(twist.forward_m_s)

    @property
    def place(self) -> tuple[float, float]:
        pose = self.localization.pose
        assert pose is not None
        return pose.east_m, pose.north_m

    def where(self, vehicle: str) -> tuple[float, float]:
        state = self.bus.latest(ResourceId(vehicle))
        assert isinstance(state, VehicleState)
        assert state.position is not None
        return to_local(state.position, ORIGIN)[:2]

    def _count(self, message: Any) -> None:
        self.motions = message.data

    def _follow(self, message: Any) -> None:
        place = message.pose.pose.position
        self.track.append((abs(message.twist.twist.linear.x), place.x, place.y))


@asynccontextmanager
async def bench(
    domain: int, route_action: RouteAction = RouteAction.THROUGH, name: ResourceId = VEHICLE
) -> AsyncIterator[Bench]:
    """A driver that is open and ready."""
    async with RosRuntime("bench", domain_id=domain) as ros:
        made = Bench(ros, route_action, name)
        await made.driver.open()
        try:
            await made.ready()
            yield made
        finally:
            await made.driver.close()
