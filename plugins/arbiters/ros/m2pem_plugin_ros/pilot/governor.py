"""What a base can do of what is wished: its bounds hold for every command, whoever wished it."""

import math

from m2pem_plugin_ros.pilot.words import Wish
from m2pem_plugin_ros.pose import Twist
from m2pem_plugin_ros.settings import Bounds

STANDSTILL_M_S = 1e-6


class Governor:
    """Turns wishes into commands, each of which is near the one before."""

    def __init__(self, bounds: Bounds) -> None:
        self._bounds = bounds
        self._speed_m_s = 0.0

    @property
    def speed_m_s(self) -> float:
        """What was commanded last."""
        return self._speed_m_s

    def halt(self) -> Twist:
        """Zero, at once: what is not known must not be driven on."""
        self._speed_m_s = 0.0
        return Twist()

    def moved_by_others(self, speed_m_s: float) -> None:
        """Nobody here commands it: the next command begins at what it does now."""
        self._speed_m_s = self._within(speed_m_s)

    def command(self, wish: Wish, dt_s: float) -> Twist:
        """The command that is nearest to the wish, `dt_s` after the last one."""
        if not math.isfinite(wish.speed_m_s + wish.curvature_1_m + wish.yaw_rate_rad_s):
            return self.halt()
        bounds = self._bounds
        change = bounds.acceleration_m_s2 * dt_s
        wanted = self._within(wish.speed_m_s) - self._speed_m_s
        self._speed_m_s = speed = self._speed_m_s + max(-change, min(change, wanted))
        if abs(speed) < STANDSTILL_M_S and wish.speed_m_s == 0.0:
            self._speed_m_s = speed = 0.0
        return Twist(forward_m_s=speed, yaw_rad_s=self._yaw_rate(wish, speed))

    def _within(self, speed_m_s: float) -> float:
        return max(-self._bounds.reverse_m_s, min(self._bounds.speed_m_s, speed_m_s))

    def _yaw_rate(self, wish: Wish, speed_m_s: float) -> float:
        bounds = self._bounds
        bound = bounds.yaw_rate_rad_s
        yaw_rate = speed_m_s * wish.curvature_1_m
        if bounds.turn_radius_m > 0:
            bound = min(bound, abs(speed_m_s) / bounds.turn_radius_m)
        else:
            yaw_rate += wish.yaw_rate_rad_s
        if abs(speed_m_s) > STANDSTILL_M_S:
            bound = min(bound, bounds.lateral_m_s2 / abs(speed_m_s))
        return max(-bound, min(bound, yaw_rate))
