"""How a simulated vehicle moves: it turns on the spot, then drives straight to the next node."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from m2pem_plugin_vda5050.map_frame import MapPoint, wrapped

SHARP_RAD = 0.2
"""At corners sharper than this, the vehicle stops and turns."""

THERE_M = 0.1
STANDS_M_S = 0.01
AIMED_RAD = 0.02


@dataclass(frozen=True, slots=True)
class Chassis:
    """In SI units."""

    speed_m_s: float = 2.0
    acceleration_m_s2: float = 1.0
    yaw_rate_rad_s: float = 1.5


@dataclass(frozen=True, slots=True)
class Leg:
    """The way to a node. `limit_m_s`: of the edge; inf: none. `backwards`: it is driven so."""

    point: MapPoint
    limit_m_s: float = math.inf
    backwards: bool = False


class Motion:
    """The pose of a vehicle in the frame of its map, and its speed."""

    def __init__(self, chassis: Chassis, x: float, y: float, theta_rad: float) -> None:
        self.chassis = chassis
        self.x, self.y, self.theta_rad = x, y, theta_rad
        self.speed_m_s = 0.0
        self.yaw_rate_rad_s = 0.0
        self.stuck = False
        self._turns = False

    @property
    def moves(self) -> bool:
        return abs(self.speed_m_s) > STANDS_M_S or self._turns

    def distance_m(self, point: MapPoint) -> float:
        return math.hypot(point.x - self.x, point.y - self.y)

    def stop(self, dt_s: float) -> None:
        """Brake, and do not turn."""
        self._turn(0.0, dt_s)
        self._drive(0.0, dt_s)

    def turn_to(self, theta_rad: float, dt_s: float) -> bool:
        """Turn on the spot. Return whether the direction is reached."""
        error = wrapped(theta_rad - self.theta_rad)
        self._drive(0.0, dt_s)
        if abs(error) <= AIMED_RAD or self.stuck:
            self._turn(0.0, dt_s)
            return not self.stuck
        self._turn(error, dt_s)
        return False

    def drive(self, legs: Sequence[Leg], dt_s: float) -> bool:
        """Drive along legs. Return whether the first one is driven."""
        leg = legs[0]
        away_m = self.distance_m(leg.point)
        if away_m <= max(THERE_M, abs(self.speed_m_s) * dt_s):
            return True
        bearing = math.atan2(leg.point.y - self.y, leg.point.x - self.x)
        error = wrapped(bearing + (math.pi if leg.backwards else 0.0) - self.theta_rad)
        stands = abs(self.speed_m_s) <= STANDS_M_S
        if abs(error) > (AIMED_RAD if stands else SHARP_RAD):
            if stands:
                self.turn_to(self.theta_rad + error, dt_s)
            else:
                self.stop(dt_s)
            return False
        self._turn(error, dt_s)
        braking_m = max(0.0, self._stop_m(legs) - THERE_M / 2)
        top = min(self.chassis.speed_m_s, leg.limit_m_s)
        top = min(top, math.sqrt(2 * self.chassis.acceleration_m_s2 * braking_m) + STANDS_M_S)
        self._drive(-top if leg.backwards else top, dt_s)
        return False

    def _stop_m(self, legs: Sequence[Leg]) -> float:
        """Return the way to where the vehicle must stop: the end, or a sharp corner."""
        way_m, here, before = 0.0, MapPoint(self.x, self.y), None
        for leg in legs:
            step = math.dist(here, leg.point)
            bearing = math.atan2(leg.point.y - here.y, leg.point.x - here.x)
            if before is not None and abs(wrapped(bearing - before)) > SHARP_RAD and step > THERE_M:
                break
            way_m, here, before = way_m + step, leg.point, bearing
        return way_m

    def _turn(self, error_rad: float, dt_s: float) -> None:
        most = self.chassis.yaw_rate_rad_s * dt_s
        turn = 0.0 if self.stuck else max(-most, min(most, error_rad))
        self._turns = abs(turn) > 1e-9
        self.yaw_rate_rad_s = turn / dt_s
        self.theta_rad = wrapped(self.theta_rad + turn)

    def _drive(self, wanted_m_s: float, dt_s: float) -> None:
        wanted_m_s = 0.0 if self.stuck else wanted_m_s
        most = self.chassis.acceleration_m_s2 * dt_s
        change = max(-most, min(most, wanted_m_s - self.speed_m_s))
        self.speed_m_s += change
        if wanted_m_s == 0.0 and abs(self.speed_m_s) <= STANDS_M_S:
            self.speed_m_s = 0.0
        self.x += self.speed_m_s * dt_s * math.cos(self.theta_rad)
        self.y += self.speed_m_s * dt_s * math.sin(self.theta_rad)
