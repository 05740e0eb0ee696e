"""A simulated Nav2 in a process of its own, on a base that moves in straight lines.

Arguments: a namespace, and where it stands, east and north in metres. Words on the topic `words` of
the namespace change it: "reject", "hang", "miss 1", "abort 208 there is a wall", "inactive",
"active", "fine".
"""

import asyncio
import math
import signal
import sys
from collections.abc import Mapping
from dataclasses import replace
from uuid import UUID

from m2pem_plugin_ros.loopback import keep_on_loopback

keep_on_loopback()

from m2pem_plugin_ros.drivers.driver import DriverEvents, Health, Order, Outcome  # noqa: E402
from m2pem_plugin_ros.frames import quaternion_of_yaw, to_local  # noqa: E402
from m2pem_plugin_ros.pose import Pose, Twist  # noqa: E402
from m2pem_plugin_ros.runtime import RosRuntime, qos  # noqa: E402
from m2pem_plugin_ros.simulator.nav2 import Nav2Server  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402
from std_msgs.msg import String, UInt32  # noqa: E402

from m2pem.api import (  # noqa: E402
    BehaviorRequest,
    BehaviorState,
    GeoPosition,
    Point,
    ResolvedValue,
    Route,
)

ORIGIN = (38.1075, -77.3192, 60.0)
STEP_S = 0.02
SPEED_M_S = 8.0
ACCELERATION_M_S2 = 20.0


class Base:
    """A driver, the base that it drives, and its odometry. It can turn on the spot, at once."""

    def __init__(self, east_m: float, north_m: float) -> None:
        self.pose = Pose(east_m, north_m, 0.0)
        self.motions = 0
        self._events: DriverEvents | None = None
        self._order: Order | None = None
        self._unresolved: list[Pose] = []
        self._backwards = False
        self._limit_m_s = SPEED_M_S
        self._speed_m_s = 0.0
        self._stopping = False

    def make_driver(self, events: DriverEvents) -> "Base":
        self._events = events
        return self

    # --- Localization ---------------------------------------------------------------------------

    age_s = 0.0
    wrong_frame = ""

    @property
    def twist(self) -> Twist:
        return Twist(-self._speed_m_s if self._backwards else self._speed_m_s)

    @property
    def position(self) -> GeoPosition | None:
        return None

    # --- Driver ---------------------------------------------------------------------------------

    health = Health()

    async def open(self) -> None:
        return

    def refusal(self, _: BehaviorRequest) -> str:
        return ""

    def begin(self, order: Order) -> None:
        wishes = order.request.parameters
        self._order, self._stopping = order, False
        self._backwards = order.request.behavior == "reverse"
        speed = wishes.get("speed", SPEED_M_S)
        self._limit_m_s = min(SPEED_M_S, speed if isinstance(speed, float) else SPEED_M_S)
        match wishes.get("route") or wishes.get("target") or wishes["distance"]:
            case Route(waypoints=waypoints):
                self._unresolved = [place(*waypoint[:2]) for waypoint in waypoints]
            case Point(position=position):
                self._unresolved = [place(*position[:2])]
            case float(distance_m):
                east_m = self.pose.east_m - distance_m * math.cos(self.pose.yaw_rad)
                north_m = self.pose.north_m - distance_m * math.sin(self.pose.yaw_rad)
                self._unresolved = [Pose(east_m, north_m, self.pose.yaw_rad)]

    def end(self, goal: UUID) -> None:
        if self._order is not None and self._order.goal == goal:
            self._stopping = True

    def adjust(self, _: UUID, parameters: Mapping[str, ResolvedValue]) -> None:
        speed = parameters["speed"]
        assert isinstance(speed, float)
        self._limit_m_s = min(SPEED_M_S, speed)

    def hold(self) -> None:
        self._stopping = True

    def resume(self) -> None:
        raise NotImplementedError

    async def query(self, order: Order) -> Outcome:
        raise NotImplementedError

    def abandon(self) -> None:
        raise NotImplementedError

    async def close(self) -> None:
        return

    # --- motion ---------------------------------------------------------------------------------

    def step(self) -> None:
        if self._order is None:
            return
        if not self._unresolved:
            self._over(BehaviorState.SUCCEEDED)
            return
        target = self._unresolved[0]
        away_m = math.dist((target.east_m, target.north_m), (self.pose.east_m, self.pose.north_m))
        change = ACCELERATION_M_S2 * STEP_S
        before_m_s = self._speed_m_s
        if self._stopping:
            self._speed_m_s = max(0.0, self._speed_m_s - change)
            if not self._speed_m_s:
                self._over(BehaviorState.CANCELLED)
                return
        else:
            self._speed_m_s = min(self._limit_m_s, self._speed_m_s + change)
            self.motions += before_m_s == 0.0
        way_m = min(away_m, self._speed_m_s * STEP_S)
        if away_m > 0:
            course = math.atan2(
                target.north_m - self.pose.north_m, target.east_m - self.pose.east_m
            )
            self.pose = Pose(
                self.pose.east_m + way_m * math.cos(course),
                self.pose.north_m + way_m * math.sin(course),
                self.pose.yaw_rad if self._backwards else course,
            )
        if way_m >= away_m:
            del self._unresolved[0]

    def _over(self, state: BehaviorState) -> None:
        order, self._order, self._speed_m_s = self._order, None, 0.0
        if state is BehaviorState.SUCCEEDED and order is not None:
            heading = order.request.parameters.get("heading")
            if isinstance(heading, float):
                self.pose = replace(self.pose, yaw_rad=math.pi / 2 - heading)
        if self._events is not None and order is not None:
            self._events.ended(order.goal, Outcome(state))


def place(latitude_deg: float, longitude_deg: float) -> Pose:
    east_m, north_m, _ = to_local(GeoPosition(latitude_deg, longitude_deg, ORIGIN[2]), ORIGIN)
    return Pose(east_m, north_m, 0.0)


def odometry(base: Base) -> Odometry:
    message = Odometry()
    message.header.stamp.sec = odometry.count = getattr(odometry, "count", 0) + 1  # type: ignore[attr-defined]
    message.header.frame_id = "map"
    message.pose.pose.position.x = base.pose.east_m
    message.pose.pose.position.y = base.pose.north_m
    turned = quaternion_of_yaw(base.pose.yaw_rad)
    message.pose.pose.orientation.z, message.pose.pose.orientation.w = turned.z, turned.w
    message.twist.twist.linear.x = base.twist.forward_m_s
    return message


def obey(nav2: Nav2Server, words: str) -> None:
    match words.split(maxsplit=2):
        case ["reject"]:
            nav2.faults.reject = True
        case ["hang"]:
            nav2.faults.hang = True
        case ["miss", index]:
            nav2.faults.miss = frozenset({int(index)})
        case ["abort", code, message]:
            nav2.faults.error_code, nav2.faults.error_msg = int(code), message
        case ["fine"]:
            nav2.faults.reject = nav2.faults.hang = False
            nav2.faults.error_code, nav2.faults.miss = 0, frozenset()
        case [state]:
            nav2.enter(state)


async def main(namespace: str, east_m: float, north_m: float) -> None:
    base = Base(east_m, north_m)
    stop = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, stop.set)
    async with RosRuntime("nav2_peer") as ros:
        nav2 = Nav2Server(ros, namespace, base.make_driver, base, ORIGIN)
        await nav2.open()
        obeyed = ros.node.create_publisher(String, f"{namespace}/obeyed", qos.EVENTS)

        def hear(message: String) -> None:
            obey(nav2, message.data)
            obeyed.publish(message)

        ros.subscribe(String, f"{namespace}/words", hear, qos.EVENTS)
        odom = ros.node.create_publisher(Odometry, f"{namespace}/odom", qos.TELEMETRY)
        motions = ros.node.create_publisher(UInt32, f"{namespace}/motions", qos.STATUS)
        events = -1
        print("ready", flush=True)
        while not stop.is_set():
            base.step()
            odom.publish(odometry(base))
            if events != base.motions:
                events = base.motions
                motions.publish(UInt32(data=events))
            await asyncio.sleep(STEP_S)


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], float(sys.argv[2]), float(sys.argv[3])))
