"""Where a vehicle is, made of what its odometry and its satellite receiver say. Pure."""

import math
from dataclasses import replace

from m2pem.api import GeoPosition
from m2pem_plugin_ros.frames import Origin, to_geodetic, to_local
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.settings import OdomFrame

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
