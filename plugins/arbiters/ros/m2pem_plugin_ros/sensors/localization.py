"""The pose of a vehicle from its odometry, its satellite receiver and tf, and whether it stands."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

from m2pem.api import ArbiterContext, Clock, GeoPosition, ResourceId, mean_sea_level_m
from m2pem_plugin_ros.frames import Origin, to_geodetic, to_local, yaw_of_quaternion
from m2pem_plugin_ros.log_throttle import LogThrottle
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.sensors.jumps import JumpMonitor
from m2pem_plugin_ros.sensors.tf_buffer import Transform, TransformError, transform_of
from m2pem_plugin_ros.sensors.tf_topics import MAP, TfTopics
from m2pem_plugin_ros.settings import FixAltitude, OdomFrame, Settings

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime


FASTEST_M_S = 1_000.0
FASTEST_RAD_S = 1_000.0
FIX_IS_OLD_S = 5.0
BASE_LINK = "base_link"
"""The frame of a vehicle (REP-105), if neither the fleet nor its odometry names another one."""

_NO_FIX = -1
_STATUS_NOT_SET = -2


class Localization(Protocol):
    """The latest pose, twist and position; None before the first."""

    @property
    def pose(self) -> Pose | None:
        """In the local frame of the fleet."""
        ...

    @property
    def twist(self) -> Twist | None:
        """In the frame of the vehicle."""
        ...

    @property
    def position(self) -> GeoPosition | None:
        """WGS-84, altitude above mean sea level."""
        ...

    @property
    def age_s(self) -> float:
        """Seconds of the arbiter's clock since the pose was received; infinite before the first."""
        ...

    @property
    def wrong_frame(self) -> str:
        """Why the pose cannot be known in the local frame of the fleet; "" if it can."""
        ...


class TopicLocalization:
    """Implements `Localization` with nav_msgs/Odometry, sensor_msgs/NavSatFix and tf.

    It is subscribed until the runtime is closed. Invalid messages (NaN, a latitude of 91 degrees, a
    repeated stamp) are dropped, and counted by their cause. `tf` is shared with other vehicles; it
    is read only if the pose comes from it, or odometry is in a frame other than the declared one.
    """

    def __init__(
        self,
        ros: "RosRuntime",
        resource: ResourceId,
        settings: Settings,
        context: ArbiterContext,
        tf: TfTopics | None = None,
    ) -> None:
        from nav_msgs.msg import Odometry  # noqa: PLC0415  # it is loaded where ROS is only
        from sensor_msgs.msg import NavSatFix  # noqa: PLC0415

        from m2pem_plugin_ros.runtime import qos  # noqa: PLC0415

        topics = settings.topics
        self.log_throttle = LogThrottle(context.logger, resource)
        self._clock = context.clock
        self._frame = settings.odom_frame
        self._fix_altitude = settings.fix_altitude
        self._where = PoseEstimator(settings.odom_frame, context.origin)
        self._origin, self._fastest_m_s = context.origin, settings.bounds.speed_m_s
        self._jumps = JumpMonitor()
        self._resource = resource
        self._odom = settings.topic(topics.odom)
        self._tf = tf or TfTopics(
            ros, settings.topic(topics.tf), settings.topic(topics.tf_static), context
        )
        self._base_frame = settings.base_frame
        self._changes = 0
        self._wrong_frame = ""
        self._seen: tuple[int, str] | None = None
        self._stamp = (0, 0)
        self._posed_us: int | None = None
        self._fixed_us: int | None = None
        if self._frame is OdomFrame.TF:
            self._tf.open()
        ros.subscribe(Odometry, self._odom, self._on_odometry, qos.TELEMETRY)
        ros.subscribe(NavSatFix, settings.topic(topics.fix), self._on_fix, qos.TELEMETRY)

    @property
    def changes(self) -> int:
        """A counter that changes with each message."""
        return self._changes + (self._tf.version if self._frame is OdomFrame.TF else 0)

    @property
    def wrong_frame(self) -> str:
        self._look_up()
        return self._wrong_frame

    @property
    def pose(self) -> Pose | None:
        self._look_up()
        return self._where.pose

    @property
    def twist(self) -> Twist | None:
        return self._where.twist

    @property
    def position(self) -> GeoPosition | None:
        """WGS-84: from the pose, or from the last fix if there is no pose."""
        self._look_up()
        return self._where.position

    @property
    def age_s(self) -> float:
        self._look_up()
        if self._posed_us is None or self._where.pose is None:
            return math.inf
        return (self._clock.now_us() - self._posed_us) / 1e6

    @property
    def problems(self) -> tuple[str, ...]:
        """Data that is missing, as text."""
        problems = []
        if self._frame is OdomFrame.TF and self._where.twist is None:
            problems.append(f"no odometry yet on {self._odom}, for the speed")
        elif self._posed_us is None and not self._wrong_frame:
            problems.append(f"no odometry yet on {self._odom}")
        if self._frame is OdomFrame.ODOM:
            if self._fixed_us is None:
                problems.append("no satellite fix yet")
            elif (self._clock.now_us() - self._fixed_us) / 1e6 > FIX_IS_OLD_S:
                problems.append("the last satellite fix is old")
        if jump := self._jumps.problem(self._clock.now_us() / 1e6):
            problems.append(jump)
        return tuple(problems)

    def _on_odometry(self, message: Any) -> None:
        stamp = (message.header.stamp.sec, message.header.stamp.nanosec)
        if stamp == self._stamp and stamp != (0, 0):
            detail = f"stamp {stamp[0]}.{stamp[1]:09}"
            self.log_throttle.log("odometry with a repeated stamp", detail)
            return
        place, turn = message.pose.pose.position, message.pose.pose.orientation
        linear, angular = message.twist.twist.linear, message.twist.twist.angular
        is_pose = self._frame is not OdomFrame.TF
        if is_pose and not _within(FARTHEST_M, place.x, place.y, place.z):
            cause = "odometry with an invalid position"
            self.log_throttle.log(cause, f"({place.x:g}, {place.y:g}, {place.z:g})")
            return
        speeds_are_sane = _within(FASTEST_M_S, linear.x, linear.y)
        if not speeds_are_sane or not _within(FASTEST_RAD_S, angular.z):
            cause = "odometry with an invalid speed"
            self.log_throttle.log(cause, f"({linear.x:g}, {linear.y:g}) m/s, {angular.z:g} rad/s")
            return
        twist = Twist(linear.x, angular.z, linear.y)
        if not is_pose:
            self._stamp = stamp
            self._base_frame = self._base_frame or message.child_frame_id
            self._where.twist = twist
            self._changes += 1
            return
        try:
            in_frame = transform_of(place, turn)
        except ValueError as error:
            self.log_throttle.log("odometry with an invalid orientation", str(error))
            return
        try:
            pose = self._in_declared(message.header.frame_id, stamp, in_frame)
        except TransformError as error:
            self._wrong_frame = str(error)
            cause = "odometry in a frame of which the pose is not known"
            self.log_throttle.log(cause, f"'{message.header.frame_id}'")
            self._changes += 1
            return
        self._wrong_frame = ""
        self._stamp = stamp
        self._posed_us = self._clock.now_us()
        self._changes += 1
        self._where.odometry(pose, twist)
        self._check_jump()

    def _in_declared(self, frame: str, stamp: tuple[int, int], in_frame: Transform) -> Pose:
        """Return the pose of odometry in the declared frame. Each of several robots may have its
        own `odom` (`ugv1/odom`, REP-105); `map` is that of the fleet.

        Raises:
            TransformError: it cannot be known there; the text says what would be right.
        """
        name = frame.removeprefix("/")
        if name == self._frame.value:
            return _pose(in_frame)
        is_odom = name.rpartition("/")[2] == OdomFrame.ODOM
        if self._frame is OdomFrame.ODOM:
            if is_odom:
                return _pose(in_frame)
            right = "write 'odom_frame: map' in its connection"
            raise TransformError(
                f"odometry of {self._resource} on {self._odom} is in '{frame}', declared is"
                f" 'odom': {right}"
            )
        try:
            if not name:
                raise TransformError("a frame without a name cannot be looked up on tf")
            stamp_ns = stamp[0] * 1_000_000_000 + stamp[1] or None
            pose = _pose(self._tf.find(name, stamp_ns).transform.of(in_frame))
        except TransformError as error:
            right = f"publish odometry in '{MAP}', or that transform"
            if is_odom:
                right += ", or write 'odom_frame: odom' in its connection, with satellite fixes"
            raise TransformError(
                f"odometry of {self._resource} on {self._odom} is in '{frame}'; {error}: {right}"
            ) from None
        if not _within(FARTHEST_M, pose.east_m, pose.north_m, pose.up_m):
            raise TransformError(
                f"odometry of {self._resource} on {self._odom} is in '{frame}', and farther than"
                f" {FARTHEST_M / 1000:g} km from '{MAP}'"
            )
        return pose

    def _look_up(self) -> None:
        """Take the pose from tf, if it is declared to come from there, and has changed."""
        if self._frame is not OdomFrame.TF:
            return
        frame = self._base_frame or BASE_LINK
        seen = (self._tf.version, frame)
        if seen == self._seen:
            return
        self._seen = seen
        try:
            found = self._tf.find(frame)
        except TransformError as error:
            self._wrong_frame = f"{self._resource}: its pose is not known: {error}"
            return
        self._wrong_frame = ""
        pose = _pose(found.transform)
        self._posed_us = self._clock.now_us() - round(found.age_s * 1e6)
        if _within(FARTHEST_M, pose.east_m, pose.north_m, pose.up_m):
            self._where.pose_in_map(pose)
            self._check_jump()

    def _check_jump(self) -> None:
        pose, twist, fix = self._where.pose, self._where.twist, self._where.position
        if pose is not None:
            place = pose.east_m, pose.north_m
        elif fix is not None:
            place = to_local(fix, self._origin)[:2]
        else:
            return
        speed_m_s = math.hypot(twist.forward_m_s, twist.left_m_s) if twist else 0.0
        fastest_m_s = max(speed_m_s, self._fastest_m_s)
        if jump := self._jumps.jump(*place, fastest_m_s, self._clock.now_us() / 1e6):
            self.log_throttle.log("a position to which it cannot have moved", jump)

    def _on_fix(self, message: Any) -> None:
        status = message.status.status
        if status == _NO_FIX:
            return  # the receiver reports no fix
        latitude, longitude = message.latitude, message.longitude
        is_unset = status == _STATUS_NOT_SET and latitude == longitude == 0.0
        if is_unset or not (_within(90.0, latitude) and _within(180.0, longitude)):
            self.log_throttle.log("an invalid satellite fix", f"({latitude:g}, {longitude:g})")
            return
        altitude = message.altitude if _within(FARTHEST_M, message.altitude) else math.nan
        if self._fix_altitude is FixAltitude.ELLIPSOID:
            altitude = mean_sea_level_m(latitude, longitude, altitude)
        self._fixed_us = self._clock.now_us()
        self._changes += 1
        self._where.fix(GeoPosition(latitude, longitude, altitude))
        self._check_jump()


def _pose(transform: Transform) -> Pose:
    east_m, north_m, up_m = transform.place
    return Pose(east_m, north_m, yaw_of_quaternion(transform.turn), up_m)


def _within(bound: float, *numbers: float) -> bool:
    """Whether all numbers are finite and within the bound."""
    return all(-bound <= number <= bound for number in numbers)


FARTHEST_M = 1_000_000.0
"""Distance from the origin. Positions farther away are invalid."""


class PoseEstimator:
    """Combines odometry and satellite fixes.

    Odometry in the frame `map` is the pose, as that of tf is. In the frame `odom` it begins
    anywhere: each fix gives the position, and odometry the motion since then. Yaw is from east in
    both (REP-103), as robots with a compass report it.
    """

    def __init__(self, frame: OdomFrame, origin: Origin) -> None:
        self._frame = frame
        self._origin = origin
        self._odometry: Pose | None = None
        self._fix: GeoPosition | None = None
        self._anchor: tuple[float, float, float] | None = None
        self.twist: Twist | None = None

    def odometry(self, pose: Pose, twist: Twist) -> None:
        """Process odometry in its own frame. All numbers are finite."""
        self._odometry, self.twist = pose, twist
        if self._frame is OdomFrame.ODOM and self._anchor is None and self._fix is not None:
            self._drop_anchor(pose, self._fix)

    def pose_in_map(self, pose: Pose) -> None:
        """Process a pose from tf."""
        self._odometry = pose

    def fix(self, position: GeoPosition) -> None:
        """Process a satellite fix. Its altitude is above mean sea level, and may be NaN."""
        self._fix = position
        if self._frame is OdomFrame.ODOM and self._odometry is not None:
            self._drop_anchor(self._odometry, position)

    @property
    def pose(self) -> Pose | None:
        """The pose in the local frame; None if odometry is missing, or in the frame `odom` a
        fix."""
        pose = self._odometry
        if pose is None or self._frame is not OdomFrame.ODOM:
            return pose
        if self._anchor is None:
            return None
        east, north, up = self._anchor
        return replace(
            pose, east_m=pose.east_m + east, north_m=pose.north_m + north, up_m=pose.up_m + up
        )

    @property
    def position(self) -> GeoPosition | None:
        """The position of the pose; without a pose, that of the last fix."""
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
    """Return why the vehicle does not stand, or is not known to; "" if it stands."""
    twist = localization.twist
    if twist is None or localization.age_s > FRESH_TWIST_S:
        return "there is no odometry"
    speed_m_s = math.hypot(twist.forward_m_s, twist.left_m_s)
    if speed_m_s > STANDS_M_S:
        return f"it moves at {speed_m_s:.1f} m/s"
    return "it turns" if abs(twist.yaw_rad_s) > STANDS_RAD_S else ""


async def stands(localization: Localization, clock: Clock, within_s: float) -> str:
    """Wait until the vehicle stands in two checks in a row. Return "", or why it does not stand in
    time."""
    until_us = clock.now_us() + within_s * 1e6
    looks = 0
    while True:
        why = moves(localization)
        looks = 0 if why else looks + 1
        if looks > 1:
            return ""
        if clock.now_us() >= until_us:
            return why or "it has just stopped"
        await clock.sleep(CHECK_EVERY_S)
