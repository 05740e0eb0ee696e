"""Where a simulated vehicle's own software believes to be: what its odometry says, faults and all.

It does not go through DDS, so that many vehicles in one process stay cheap.
"""

import math

from m2pem.api import GeoPosition
from m2pem_plugin_ros.frames import to_geodetic
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.sim.body import wrapped_rad
from m2pem_plugin_ros.sim.clock import US_PER_S, SimulatedClock
from m2pem_plugin_ros.sim.odometer import Reading
from m2pem_plugin_ros.sim.specification import VehicleSpec


class OwnLocalization:
    """Keeps the promises of `m2pem_plugin_ros.localization.Localization`."""

    def __init__(self, spec: VehicleSpec, clock: SimulatedClock) -> None:
        self._spec, self._clock = spec, clock
        self._pose: Pose | None = None
        self._twist: Twist | None = None
        self._stamp_us = -1
        self._heard_us: int | None = None

    def hear(self, reading: Reading) -> None:
        """Take a reading; one that is old or no place at all is as good as none."""
        pose = reading.pose
        if reading.time_us <= self._stamp_us or not math.isfinite(pose.east_m + pose.yaw_rad):
            return
        self._pose = self._in_map(pose)
        self._twist = reading.twist
        self._stamp_us = reading.time_us
        self._heard_us = self._clock.now_us()

    @property
    def pose(self) -> Pose | None:
        """In the fleet's local frame."""
        return self._pose

    @property
    def twist(self) -> Twist | None:
        """In the vehicle's own frame."""
        return self._twist

    @property
    def position(self) -> GeoPosition | None:
        """WGS-84, altitude above mean sea level."""
        if self._pose is None:
            return None
        origin = self._spec.origin
        place = to_geodetic(self._pose.east_m, self._pose.north_m, 0.0, origin)
        return GeoPosition(place.latitude_deg, place.longitude_deg, origin[2])

    @property
    def age_s(self) -> float:
        """How long ago the pose was heard; infinite before the first."""
        if self._heard_us is None:
            return math.inf
        return (self._clock.now_us() - self._heard_us) / US_PER_S

    def _in_map(self, pose: Pose) -> Pose:
        """The vehicle knows where its odometry began."""
        if self._spec.settings.odom_frame == "map":
            return pose
        start = self._spec.start
        cosine, sine = math.cos(start.yaw_rad), math.sin(start.yaw_rad)
        return Pose(
            start.east_m + pose.east_m * cosine - pose.north_m * sine,
            start.north_m + pose.east_m * sine + pose.north_m * cosine,
            wrapped_rad(start.yaw_rad + pose.yaw_rad),
            start.up_m,
        )
