"""Where one vehicle is: from its odometry and its satellite receiver."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

from m2pem.api import ArbiterContext, Clock, GeoPosition, ResourceId
from m2pem_plugin_ros.frames import Origin, to_geodetic, to_local, yaw_of_quaternion
from m2pem_plugin_ros.log_throttle import Complaints
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.settings import OdomFrame, Settings

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime


FASTEST_M_S = 1_000.0
FASTEST_RAD_S = 1_000.0
FIX_IS_OLD_S = 5.0

_NO_FIX = -1
_STATUS_NOT_SET = -2


class Localization(Protocol):
    """The latest that is known; `None` before the first."""

    @property
    def pose(self) -> Pose | None:
        """In the fleet's local frame."""
        ...

    @property
    def twist(self) -> Twist | None:
        """In the vehicle's own frame."""
        ...

    @property
    def position(self) -> GeoPosition | None:
        """WGS-84, altitude above mean sea level."""
        ...

    @property
    def age_s(self) -> float:
        """How long ago, on the arbiter's clock, the pose was heard; infinite before the first."""
        ...


class TopicLocalization:
    """Implements `Localization` with nav_msgs/Odometry and sensor_msgs/NavSatFix.

    Subscribed from the beginning, until the runtime is closed. What cannot be true (NaN, a latitude
    of 91 degrees, a stamp that was there already) is ignored, and counted by its cause.
    """

    def __init__(
        self,
        ros: "RosRuntime",
        resource: ResourceId,
        settings: Settings,
        context: ArbiterContext,
    ) -> None:
        from nav_msgs.msg import Odometry  # noqa: PLC0415  # it is loaded where ROS is only
        from sensor_msgs.msg import NavSatFix  # noqa: PLC0415

        from m2pem_plugin_ros.runtime import qos  # noqa: PLC0415

        self.changes = 0
        self.complaints = Complaints(context.logger, resource)
        self._clock = context.clock
        self._frame = settings.odom_frame
        self._where = Whereabouts(settings.odom_frame, context.origin)
        self._resource = resource
        self._odom = settings.topic(settings.topics.odom)
        self.wrong_frame = ""
        self._stamp = (0, 0)
        self._posed_us: int | None = None
        self._fixed_us: int | None = None
        topics = settings.topics
        ros.subscribe(Odometry, settings.topic(topics.odom), self._hear_odometry, qos.TELEMETRY)
        ros.subscribe(NavSatFix, settings.topic(topics.fix), self._hear_fix, qos.TELEMETRY)

    @property
    def pose(self) -> Pose | None:
        """In the fleet's local frame."""
        return self._where.pose

    @property
    def twist(self) -> Twist | None:
        """In the vehicle's own frame."""
        return self._where.twist

    @property
    def position(self) -> GeoPosition | None:
        """WGS-84; from the pose, or without one from the last fix."""
        return self._where.position

    @property
    def age_s(self) -> float:
        """How long ago odometry was heard; infinite as long as there is no pose."""
        if self._posed_us is None or self._where.pose is None:
            return math.inf
        return (self._clock.now_us() - self._posed_us) / 1e6

    @property
    def troubles(self) -> tuple[str, ...]:
        """What is missing to know well where it is, for people."""
        troubles = []
        if self._posed_us is None and not self.wrong_frame:
            troubles.append(f"no odometry was heard yet on {self._odom}")
        if self._frame is OdomFrame.ODOM:
            if self._fixed_us is None:
                troubles.append("no satellite fix was heard yet")
            elif (self._clock.now_us() - self._fixed_us) / 1e6 > FIX_IS_OLD_S:
                troubles.append("the last satellite fix is old")
        return tuple(troubles)

    def _hear_odometry(self, message: Any) -> None:
        stamp = (message.header.stamp.sec, message.header.stamp.nanosec)
        if stamp == self._stamp and stamp != (0, 0):
            detail = f"stamp {stamp[0]}.{stamp[1]:09}"
            self.complaints.add("odometry that was there already", detail)
            return
        frame = message.header.frame_id
        self.wrong_frame = self._strange(frame)
        if self.wrong_frame:
            self.complaints.add("odometry in another frame than the declared one", f"'{frame}'")
            self.changes += 1
            return
        place, turn = message.pose.pose.position, message.pose.pose.orientation
        linear, angular = message.twist.twist.linear, message.twist.twist.angular
        if not _within(FARTHEST_M, place.x, place.y, place.z):
            cause = "odometry with a place that cannot be"
            self.complaints.add(cause, f"({place.x:g}, {place.y:g}, {place.z:g})")
            return
        speeds_are_sane = _within(FASTEST_M_S, linear.x, linear.y)
        if not speeds_are_sane or not _within(FASTEST_RAD_S, angular.z):
            cause = "odometry with a speed that cannot be"
            self.complaints.add(cause, f"({linear.x:g}, {linear.y:g}) m/s, {angular.z:g} rad/s")
            return
        try:
            yaw_rad = yaw_of_quaternion(turn)
        except ValueError as error:
            self.complaints.add("odometry with an orientation that cannot be", str(error))
            return
        self._stamp = stamp
        self._posed_us = self._clock.now_us()
        self.changes += 1
        self._where.odometry(
            Pose(place.x, place.y, yaw_rad, place.z), Twist(linear.x, angular.z, linear.y)
        )

    def _strange(self, frame: str) -> str:
        """Why odometry in a frame cannot be used; "" if it can. Of several robots each may have an
        `odom` of its own (`ugv1/odom`, REP-105); `map` is that of the fleet."""
        name = frame.removeprefix("/")
        declared = self._frame.value
        if name == declared:
            return ""
        if self._frame is OdomFrame.ODOM and name.rpartition("/")[2] == declared:
            return ""
        right = f"publish odometry in '{declared}', the fleet's local frame"
        if name.rpartition("/")[2] == OdomFrame.ODOM:
            right += ", or say 'odom_frame: odom' in its connection, with satellite fixes"
        elif self._frame is OdomFrame.ODOM and name == OdomFrame.MAP:
            right = "say 'odom_frame: map' in its connection"
        return (
            f"odometry on {self._odom} is in the frame '{frame}', declared is '{declared}', and tf"
            f" is not read: {right}"
        )

    def _hear_fix(self, message: Any) -> None:
        status = message.status.status
        if status == _NO_FIX:
            return  # the receiver says so itself
        latitude, longitude = message.latitude, message.longitude
        is_unset = status == _STATUS_NOT_SET and latitude == longitude == 0.0
        if is_unset or not (_within(90.0, latitude) and _within(180.0, longitude)):
            self.complaints.add("a fix that cannot be", f"({latitude:g}, {longitude:g})")
            return
        altitude = message.altitude if _within(FARTHEST_M, message.altitude) else math.nan
        self._fixed_us = self._clock.now_us()
        self.changes += 1
        self._where.fix(GeoPosition(latitude, longitude, altitude))


def _within(bound: float, *numbers: float) -> bool:
    """All are finite, and none is beyond the bound."""
    return all(-bound <= number <= bound for number in numbers)


FARTHEST_M = 1_000_000.0
"""From the origin. What claims to be farther away is wrong."""


class Whereabouts:
    """Odometry in the frame `map` is where the vehicle is. One in the frame `odom` begins anywhere,
    so that each fix says where the vehicle is, and odometry how it went on from there; its yaw is
    from east all the same (REP-103), as robots with a compass say it.
    """

    def __init__(self, frame: OdomFrame, origin: Origin) -> None:
        self._frame = frame
        self._origin = origin
        self._odometry: Pose | None = None
        self._fix: GeoPosition | None = None
        self._anchor: tuple[float, float, float] | None = None
        self.twist: Twist | None = None

    def odometry(self, pose: Pose, twist: Twist) -> None:
        """What odometry says, in its own frame. All numbers are finite."""
        self._odometry, self.twist = pose, twist
        if self._frame is OdomFrame.ODOM and self._anchor is None and self._fix is not None:
            self._drop_anchor(pose, self._fix)

    def fix(self, position: GeoPosition) -> None:
        """What the satellite receiver says; its altitude may be NaN."""
        self._fix = position
        if self._frame is OdomFrame.ODOM and self._odometry is not None:
            self._drop_anchor(self._odometry, position)

    @property
    def pose(self) -> Pose | None:
        """In the fleet's local frame; None: odometry, or in the frame `odom` a fix, is missing."""
        pose = self._odometry
        if pose is None or self._frame is OdomFrame.MAP:
            return pose
        if self._anchor is None:
            return None
        east, north, up = self._anchor
        return replace(
            pose, east_m=pose.east_m + east, north_m=pose.north_m + north, up_m=pose.up_m + up
        )

    @property
    def position(self) -> GeoPosition | None:
        """The pose as a position on Earth; without one, that of the last fix."""
        pose = self.pose
        if pose is not None:
            return to_geodetic(pose.east_m, pose.north_m, pose.up_m, self._origin)
        if self._fix is None:
            return None
        return self._with_altitude(self._fix)

    def _drop_anchor(self, odometry: Pose, position: GeoPosition) -> None:
        east, north, up = to_local(self._with_altitude(position), self._origin)
        self._anchor = (east - odometry.east_m, north - odometry.north_m, up - odometry.up_m)

    def _with_altitude(self, position: GeoPosition) -> GeoPosition:
        if math.isnan(position.altitude_m):
            return replace(position, altitude_m=self._origin[2])
        return position


STANDS_M_S = 0.05
STANDS_RAD_S = 0.05
FRESH_TWIST_S = 1.0
CHECK_EVERY_S = 0.1


def moves(localization: Localization) -> str:
    """Why the vehicle does not stand, as far as is known; "" if it does."""
    twist = localization.twist
    if twist is None or localization.age_s > FRESH_TWIST_S:
        return "its odometry is not heard"
    speed_m_s = math.hypot(twist.forward_m_s, twist.left_m_s)
    if speed_m_s > STANDS_M_S:
        return f"it moves at {speed_m_s:.1f} m/s"
    return "it turns" if abs(twist.yaw_rad_s) > STANDS_RAD_S else ""


async def stands(localization: Localization, clock: Clock, within_s: float) -> str:
    """Wait until it stands in two looks on end; returns "", or why it does not in time."""
    until_us = clock.now_us() + within_s * 1e6
    looks = 0
    while True:
        why = moves(localization)
        looks = 0 if why else looks + 1
        if looks > 1:
            return ""
        if clock.now_us() >= until_us:
            return why or "it has just come to a stand"
        await clock.sleep(CHECK_EVERY_S)
