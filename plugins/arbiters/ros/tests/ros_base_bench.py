"""A BaseDriver on a bench: the base is a peer in another process; who is told is here."""

import asyncio
import logging
import math
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

from m2pem_plugin_ros.drivers.base import BaseDriver
from m2pem_plugin_ros.drivers.driver import DriverSetup, Order, Outcome
from m2pem_plugin_ros.frames import to_geodetic, yaw_of_quaternion
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.settings import Bounds, Settings
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from m2pem.api import (
    ArbiterContext,
    BehaviorRequest,
    Clock,
    Connection,
    GeoPosition,
    Point,
    ResolvedValue,
    ResourceId,
    Route,
)
from m2pem.geo.fence import Fence
from m2pem.telemetry.bus import Bus

BASE = Path(__file__).with_name("ros_base_peer.py")
ORIGIN = (38.1075, -77.3192, 60.0)
RUN = UUID("7a4f3c52-6d0e-5c6d-9a3b-2d8a6d7e9f10")
AMPLE_S = 40.0


class PoseEstimator:
    """Implements `Localization`."""

    def __init__(self, ros: RosRuntime, namespace: str, clock: Clock) -> None:
        self._clock = clock
        self._heard_us: int | None = None
        self.pose: Pose | None = None
        self.twist: Twist | None = None
        self.position: GeoPosition | None = None
        ros.subscribe(Odometry, f"{namespace}/odom", self._on_message, qos.TELEMETRY)

    wrong_frame = ""

    @property
    def age_s(self) -> float:
        if self._heard_us is None:
            return math.inf
        return (self._clock.now_us() - self._heard_us) / 1e6

    def _on_message(self, message: Any) -> None:
        place = message.pose.pose.position
        self.pose = Pose(place.x, place.y, yaw_of_quaternion(message.pose.pose.orientation))
        self.twist = Twist(message.twist.twist.linear.x, message.twist.twist.angular.z)
        self._heard_us = self._clock.now_us()


class Bench:
    """Implements `DriverEvents`, and gives orders. `said`: the commands that the base has got."""

    def __init__(self, ros: RosRuntime, namespace: str, clock: Clock, **options: Any) -> None:
        area = options.pop("fence", None)
        self.clock = clock
        self.bus = Bus()
        self.heard_count = 0
        self.goals: list[UUID] = []
        self.outcomes: list[tuple[UUID, Outcome]] = []
        self.said: list[tuple[float, float]] = []
        self.where = PoseEstimator(ros, namespace, clock)
        self.ros = ros
        self._orders = ros.node.create_publisher(String, f"{namespace}/orders", 10)
        ros.subscribe(String, f"{namespace}/said", self._say, qos.EVENTS)
        settings = Settings(namespace, **{"bounds": Bounds(acceleration_m_s2=2.0), **options})
        context = ArbiterContext(clock, self.bus, logging.getLogger("m2pem.testing"), ORIGIN)
        connection = Connection(ResourceId("ugv1"), "ground", sitl=True, fence=area and Fence(area))
        self.driver = BaseDriver(DriverSetup(connection, settings, context, ros, self.where, self))

    def alive(self) -> None:
        self.heard_count += 1

    def progress(self, goal: UUID) -> None:
        self.goals.append(goal)

    def ended(self, goal: UUID, outcome: Outcome) -> None:
        self.outcomes.append((goal, outcome))

    def order(self, behavior: str, **parameters: ResolvedValue) -> Order:
        """An order with a goal of its own."""
        request = BehaviorRequest("r1.b1", 1, behavior, parameters, (ResourceId("ugv1"),))
        return Order(request, uuid4(), RUN)

    def begin(self, behavior: str, **parameters: ResolvedValue) -> Order:
        """Have it done."""
        order = self.order(behavior, **parameters)
        assert self.driver.refusal(order.request) == ""
        self.driver.begin(order)
        return order

    async def ending(self, order: Order) -> Outcome:
        """How the order ended; it ends once."""
        await until(lambda: order.goal in [goal for goal, _ in self.outcomes])
        [outcome] = [outcome for goal, outcome in self.outcomes if goal == order.goal]
        return outcome

    async def tell_base(self, order: str) -> None:
        """Change the peer."""
        await until(self._orders.get_subscription_count)
        self._orders.publish(String(data=order))

    @property
    def place(self) -> tuple[float, float]:
        assert self.where.pose is not None
        return self.where.pose.east_m, self.where.pose.north_m

    @property
    def speed_m_s(self) -> float:
        return self.where.twist.forward_m_s if self.where.twist is not None else math.nan

    def _say(self, message: String) -> None:
        forward, turning = message.data.split()
        self.said.append((float(forward), float(turning)))


@asynccontextmanager
async def bench(domain: int, namespace: str, clock: Clock, **options: Any) -> AsyncIterator[Bench]:
    """A driver that is open and knows where its base is."""
    async with RosRuntime("tested", domain_id=domain) as ros:
        made = Bench(ros, namespace, clock, **options)
        await made.driver.open()
        try:
            await made.tell_base("home")
            await until(lambda: made.where.pose is not None and made.place == (0.0, 0.0))
            await until(lambda: ros.node.count_subscribers(f"{namespace}/cmd_vel") > 0)
            yield made
        finally:
            await made.driver.close()


async def until(condition: Callable[[], object], within_s: float = AMPLE_S) -> None:
    """Wait for a condition, so many real seconds at most."""
    async with asyncio.timeout(within_s):
        while not condition():  # noqa: ASYNC110  # there is no event for all of them
            await asyncio.sleep(0.01)


def geo(east_m: float, north_m: float) -> tuple[float, float, None]:
    """The coordinate of a local place."""
    position = to_geodetic(east_m, north_m, 0.0, ORIGIN)
    return position.latitude_deg, position.longitude_deg, None


def point(east_m: float, north_m: float) -> Point:
    """The same as a point."""
    return Point(geo(east_m, north_m))


def route(*places: tuple[float, float]) -> Route:
    """A route through local places."""
    return Route(tuple(geo(*place) for place in places))
