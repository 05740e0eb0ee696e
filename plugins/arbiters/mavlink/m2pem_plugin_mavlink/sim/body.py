"""Where a vehicle really is and how it moves: what its sensors would measure."""

import math
from dataclasses import dataclass

from m2pem_plugin_mavlink.sim.geometry import Point


@dataclass(slots=True)
class Body:
    """The physical truth, in metres from home (north, east, up), m/s and radians.

    Attitude as aircraft count it: yaw from north clockwise, pitch nose up, roll right.
    """

    north_m: float = 0.0
    east_m: float = 0.0
    up_m: float = 0.0
    north_mps: float = 0.0
    east_mps: float = 0.0
    up_mps: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0
    yaw_rps: float = 0.0
    on_ground: bool = True

    @property
    def point(self) -> Point:
        """Where it is."""
        return Point(self.north_m, self.east_m, self.up_m)

    @property
    def ground_speed_mps(self) -> float:
        """Over the ground, never negative."""
        return math.hypot(self.north_mps, self.east_mps)

    @property
    def moving(self) -> bool:
        """Faster than the noise of sensors."""
        return self.ground_speed_mps > 0.1 or abs(self.up_mps) > 0.1

    def stop(self) -> None:
        """Stand still where it is, level."""
        self.north_mps = self.east_mps = self.up_mps = self.yaw_rps = 0.0
        self.roll_rad = self.pitch_rad = 0.0
