"""From directions as a camera is mounted on a deck to those from the horizon, and back. Pure.

MAVLink's gimbals are level whatever the vehicle does, and are told so. `roll_rad` and `pitch_rad`
are those of a VehicleState (REP-103): roll is positive when the right side is down, pitch when the
nose is down.
"""

import math

Direction = tuple[float, float]
"""Pan from the bow, clockwise, and tilt upwards; radians."""


def from_deck(direction: Direction, roll_rad: float, pitch_rad: float) -> Direction:
    """The same direction, from the horizon."""
    x, y, z = _vector(direction)
    y, z = _turned(y, z, roll_rad)
    z, x = _turned(z, x, pitch_rad)
    return _direction(x, y, z)


def to_deck(direction: Direction, roll_rad: float, pitch_rad: float) -> Direction:
    """The inverse."""
    x, y, z = _vector(direction)
    z, x = _turned(z, x, -pitch_rad)
    y, z = _turned(y, z, -roll_rad)
    return _direction(x, y, z)


def _vector(direction: Direction) -> tuple[float, float, float]:
    """Forward, left, up."""
    pan, tilt = direction
    return math.cos(tilt) * math.cos(pan), -math.cos(tilt) * math.sin(pan), math.sin(tilt)


def _direction(x: float, y: float, z: float) -> Direction:
    return math.atan2(-y, x), math.asin(max(-1.0, min(1.0, z)))


def _turned(first: float, second: float, angle_rad: float) -> tuple[float, float]:
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return cos * first - sin * second, sin * first + cos * second
