"""Shapes of a fence, made from the items of the plan (MAV_CMD 5001 to 5004)."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from m2pem_plugin_mavlink.sim.geometry import LocalFrame, Location, Point
from m2pem_plugin_mavlink.sim.missions.plan import Item

POLYGON_IN, POLYGON_OUT, CIRCLE_IN, CIRCLE_OUT = 5001, 5002, 5003, 5004


@dataclass(frozen=True, slots=True)
class Polygon:
    """`keep_in`: it must not be left; else it must not be entered."""

    corners: tuple[Point, ...]
    keep_in: bool

    def breached(self, point: Point) -> bool:
        """Whether a point is on the wrong side."""
        return self.contains(point) != self.keep_in

    def contains(self, point: Point) -> bool:
        """Whether a point is inside: a ray to the north crosses an odd number of sides."""
        inside = False
        last = self.corners[-1]
        for corner in self.corners:
            if (corner.east_m > point.east_m) != (last.east_m > point.east_m):
                part = (point.east_m - corner.east_m) / (last.east_m - corner.east_m)
                north_m = corner.north_m + part * (last.north_m - corner.north_m)
                inside ^= point.north_m < north_m
            last = corner
        return inside


@dataclass(frozen=True, slots=True)
class Circle:
    """`keep_in`: it must not be left; else it must not be entered."""

    center: Point
    radius_m: float
    keep_in: bool

    def breached(self, point: Point) -> bool:
        """Whether a point is on the wrong side."""
        return (self.center.distance_m(point) <= self.radius_m) != self.keep_in


Zone = Polygon | Circle


def zones_of(items: Sequence[Item], frame: LocalFrame) -> tuple[Zone, ...]:
    """The shapes. A polygon that lacks corners (its upload was abandoned) is none."""
    return tuple(_zones(items, frame))


def is_whole(items: Sequence[Item]) -> bool:
    """Whether every polygon has as many corners as each of them says, three at least."""
    index = 0
    while index < len(items):
        first = items[index]
        count = 1
        if first.command in (POLYGON_IN, POLYGON_OUT):
            count = int(first.param1) if math.isfinite(first.param1) else 0
            corners = items[index : index + count]
            said = {(each.command, each.param1) for each in corners}
            if not len(corners) == count >= 3 or said != {(first.command, first.param1)}:
                return False
        index += count
    return True


def _zones(items: Sequence[Item], frame: LocalFrame) -> Iterator[Zone]:
    index = 0
    while index < len(items):
        item = items[index]
        if item.command in (CIRCLE_IN, CIRCLE_OUT):
            yield Circle(_point(item, frame), item.param1, item.command == CIRCLE_IN)
        if item.command not in (POLYGON_IN, POLYGON_OUT):
            index += 1
            continue
        count = max(1, int(item.param1)) if math.isfinite(item.param1) else 1
        corners = items[index : index + count]
        if len(corners) == count >= 3 and all(each.command == item.command for each in corners):
            points = tuple(_point(each, frame) for each in corners)
            yield Polygon(points, item.command == POLYGON_IN)
        index += count


def _point(item: Item, frame: LocalFrame) -> Point:
    return frame.to_point(
        Location(item.latitude_deg, item.longitude_deg, frame.origin.altitude_amsl_m)
    )
