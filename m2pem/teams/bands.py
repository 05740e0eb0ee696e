"""Cutting an area, and the passes over it, into one band a member."""

import math
from collections.abc import Sequence
from typing import TypeAlias

from m2pem.teams.split import owners

Place: TypeAlias = tuple[float, float]
"""East and north in metres."""

Pass: TypeAlias = Sequence[Place]
"""Its two ends; or the corners of a ring, the first of them again at the end."""


def bands(passes: Sequence[Pass], shares: Sequence[float]) -> list[list[Pass]]:
    """The passes in their order, cut so that the ways over the area are as the shares."""
    bands: list[list[Pass]] = [[] for _ in shares]
    lengths = [math.dist(*each) for each in passes]
    for each, index in zip(passes, owners(lengths, shares), strict=True):
        bands[index].append(each)
    return bands


def strips(
    rings: Sequence[Pass], passes: Sequence[Pass], yaw_rad: float, shares: Sequence[float]
) -> list[list[list[Place]]]:
    """The parts of an area between passes, as rings; nothing for whom there is no pass."""
    level = [[turned(corner, (0.0, 0.0), yaw_rad) for corner in ring] for ring in rings]
    low = min(y for _, y in level[0])
    high = max(y for _, y in level[0])
    lengths: dict[float, float] = {}
    for each in passes:
        y = round(turned(each[0], (0.0, 0.0), yaw_rad)[1], 6)
        lengths[y] = lengths.get(y, 0.0) + math.dist(*each)
    whose = owners(list(lengths.values()), shares)
    middles = list(lengths)
    parts: list[list[list[Place]]] = []
    for member in range(len(shares)):
        mine = [y for y, owner in zip(middles, whose, strict=True) if owner == member]
        if not mine:
            parts.append([])
            continue
        first, last = middles.index(mine[0]), middles.index(mine[-1])
        bottom = low if first == 0 else (middles[first - 1] + middles[first]) / 2
        top = high if last == len(middles) - 1 else (middles[last] + middles[last + 1]) / 2
        cut = [_between(ring, bottom, top) for ring in level]
        parts.append(
            [
                [turned(corner, (0.0, 0.0), -yaw_rad) for corner in [*ring, ring[0]]]
                for ring in cut
                if len(ring) > 2
            ]
        )
    return parts


def _between(ring: Pass, bottom: float, top: float) -> list[Place]:
    """What of a closed ring lies between two y, as corners."""
    kept = _above(list(ring[:-1]), bottom)
    over = _above([(x, -y) for x, y in kept], -top)
    return [(x, -y) for x, y in over]


def _above(corners: Sequence[Place], bottom: float) -> list[Place]:
    found: list[Place] = []
    for a, b in zip(corners, [*corners[1:], *corners[:1]], strict=True):
        if a[1] >= bottom:
            found.append(a)
        if (a[1] >= bottom) != (b[1] >= bottom):
            found.append((a[0] + (b[0] - a[0]) * (bottom - a[1]) / (b[1] - a[1]), bottom))
    return found


def turned(
    place: tuple[float, float], centre: tuple[float, float], angle_rad: float
) -> tuple[float, float]:
    """In a frame at the centre whose first axis points that way."""
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    east, north = place[0] - centre[0], place[1] - centre[1]
    return east * cos + north * sin, north * cos - east * sin
