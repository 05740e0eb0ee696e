"""Where a gimbal points, and where it is to point. Angles in radians; pitch up, yaw clockwise."""

import math
from dataclasses import dataclass

from m2pem_plugin_mavlink.sim.geometry import towards, wrapped_rad

PITCH_RAD = (math.radians(-90), math.radians(25))
YAW_RAD = (math.radians(-160), math.radians(160))
"""How far it turns, seen from the vehicle."""
FASTEST_RPS = math.radians(60)
NEUTRAL, RETRACTED = (0.0, 0.0), (math.radians(-90), 0.0)


@dataclass(slots=True)
class Pointing:
    """`yaw_rad` is seen from the vehicle; `wanted_yaw_rad` too, or (`locked`) from north.

    With rates it turns on until something else is asked for.
    """

    pitch_rad: float = 0.0
    yaw_rad: float = 0.0
    wanted_pitch_rad: float = 0.0
    wanted_yaw_rad: float = 0.0
    pitch_rps: float = 0.0
    yaw_rps: float = 0.0
    locked: bool = False
    turning: bool = False

    def point(self, pitch_rad: float, yaw_rad: float, locked: bool) -> None:
        """To angles."""
        self.wanted_pitch_rad, self.wanted_yaw_rad = pitch_rad, wrapped_rad(yaw_rad)
        self.locked, self.turning = locked, False

    def turn(self, pitch_rps: float, yaw_rps: float, locked: bool, heading_rad: float) -> None:
        """On and on."""
        self.wanted_pitch_rad = self.pitch_rad
        self.wanted_yaw_rad = wrapped_rad(self.yaw_rad + (heading_rad if locked else 0.0))
        self.pitch_rps, self.yaw_rps = pitch_rps, yaw_rps
        self.locked, self.turning = locked, True

    def step(self, dt_s: float, heading_rad: float) -> None:
        """Let time pass for a vehicle with that heading."""
        if self.turning:
            self.wanted_pitch_rad = _within(
                self.wanted_pitch_rad + self.pitch_rps * dt_s, PITCH_RAD
            )
            self.wanted_yaw_rad = wrapped_rad(self.wanted_yaw_rad + self.yaw_rps * dt_s)
        yaw_rad = self.wanted_yaw_rad - (heading_rad if self.locked else 0.0)
        most_rad = FASTEST_RPS * dt_s
        pitch_rad = _within(self.wanted_pitch_rad, PITCH_RAD)
        self.pitch_rad = towards(self.pitch_rad, pitch_rad, most_rad)
        self.yaw_rad = towards(self.yaw_rad, _within(wrapped_rad(yaw_rad), YAW_RAD), most_rad)

    def quaternion(self, heading_rad: float) -> list[float]:
        """Its attitude, level in roll; its yaw is from north if it is locked there."""
        yaw_rad = self.yaw_rad + (heading_rad if self.locked else 0.0)
        cp, sp = math.cos(self.pitch_rad / 2), math.sin(self.pitch_rad / 2)
        cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
        return [cp * cy, -sp * sy, sp * cy, cp * sy]


def _within(value: float, limits: tuple[float, float]) -> float:
    return max(limits[0], min(limits[1], value))


def pitch_and_yaw(q: list[float]) -> tuple[float, float]:
    """Of a quaternion (w, x, y, z)."""
    w, x, y, z = q
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    return pitch, math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
