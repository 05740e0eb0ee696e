"""How vehicles of each domain move, unless a fleet file says otherwise."""

import math
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Kinematics:
    """Bounds of a vehicle's motion, in m/s, m/s^2, rad/s, m and s.

    `turn_radius_m`: of corners on a route that are not so sharp that it must stop and turn on the
    spot. `climb_rate_m_s`: up and down; 0 for what stays on the surface. `endurance_s`: how long a
    full battery lasts while moving or hovering. `wind_m_s`: how the air moves, east and north.
    """

    max_speed_m_s: float
    cruise_speed_m_s: float
    acceleration_m_s2: float
    deceleration_m_s2: float
    turn_rate_rad_s: float
    turn_radius_m: float
    climb_rate_m_s: float
    endurance_s: float
    default_altitude_m: float = 0.0
    wind_m_s: tuple[float, float] = (0.0, 0.0)

    def ground_speed_m_s(self, east: float, north: float) -> float:
        """Return the greatest speed over ground in the direction of a vector: its airspeed is at
        most `max_speed_m_s`. 0: it cannot keep to that direction in this wind."""
        if self.wind_m_s == (0.0, 0.0):
            return self.max_speed_m_s
        length = math.hypot(east, north)
        east, north = east / length, north / length
        along = self.wind_m_s[0] * east + self.wind_m_s[1] * north
        across = self.wind_m_s[1] * east - self.wind_m_s[0] * north
        rest = self.max_speed_m_s**2 - across**2
        return max(0.0, along + math.sqrt(rest)) if rest > 0 else 0.0

    @property
    def upwind_m_s(self) -> float:
        """The greatest speed over ground against the wind; 0: it is blown away."""
        return max(0.0, self.max_speed_m_s - math.hypot(*self.wind_m_s))

    @property
    def stopping_s(self) -> float:
        """How long it takes to stop from full speed."""
        return self.max_speed_m_s / self.deceleration_m_s2


STANDING_LOAD = 0.02
"""Battery load of a vehicle that stands, as a part of that of one that moves."""

DEFAULTS: Mapping[str, Kinematics] = {
    "ground": Kinematics(15.0, 5.0, 1.5, 3.0, 0.5, 8.0, 0.0, 8 * 3600.0),
    "air": Kinematics(20.0, 10.0, 3.0, 3.0, 1.0, 8.0, 3.0, 3600.0, 30.0),
    "surface": Kinematics(10.0, 4.0, 0.5, 0.5, 0.3, 10.0, 0.0, 8 * 3600.0),
    "subsurface": Kinematics(3.0, 1.5, 0.3, 0.3, 0.3, 5.0, 0.5, 12 * 3600.0),
}
"""By domain: a wheeled vehicle off the road, a multirotor, a small boat, a survey submarine."""
