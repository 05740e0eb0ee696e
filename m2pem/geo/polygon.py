"""Polygons: whether rings bound an area, what is inside, convex hulls and distances, and what meets
an area or the corridor along a route.

Rings of areas are in degrees: GeoJSON draws straight edges in the plane of longitude and latitude
(RFC 7946, 3.1.1). All else is in metres east and north of a local frame.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

from m2pem.geo.fence import valid
from m2pem.geo.lazy_imports import shapely
from m2pem.geo.local_frame import EastNorth, LatLon, LocalFrame
from m2pem.mission.geometry import Area, Coordinate, Geometry, Point, Route

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

Edge: TypeAlias = tuple[tuple[float, float], tuple[float, float]]
"""From a corner to the next: of degrees or metres, as the ring is."""

Hull: TypeAlias = tuple[EastNorth, ...]
"""The corners of a convex polygon, counter-clockwise. One is a place, two are a straight way."""

MAX_CORNERS = 10_000

_SAME_AREA = 1e-9
"""Of the area: rings that were made valid have lost no more."""

BUFFER_SIDES = 16
"""Sides of the polygon that stands for a circle, and lies around it."""

_OUTER = 1 / math.cos(math.pi / BUFFER_SIDES)
_ANGLES = tuple(math.tau * side / BUFFER_SIDES for side in range(BUFFER_SIDES))
_CIRCLE = tuple((_OUTER * math.cos(angle), _OUTER * math.sin(angle)) for angle in _ANGLES)


def edges_enclose(edges: Iterable[Edge], point: EastNorth) -> bool:
    """Whether edges of closed rings enclose a point: of an outer ring, and of holes in it.

    The edges that a ray to the east crosses are counted. Coordinates are (east, north), or
    (longitude, latitude).
    """
    east, north = point
    odd = False
    for (ae, an), (be, bn) in edges:
        if (an > north) != (bn > north) and east < (be - ae) * (north - an) / (bn - an) + ae:
            odd = not odd
    return odd


def turned(point: EastNorth, angle_rad: float) -> EastNorth:
    """Return a point in axes that are turned by an angle, counter-clockwise."""
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return point[0] * cos + point[1] * sin, point[1] * cos - point[0] * sin


def middle_of(corners: Sequence[EastNorth]) -> EastNorth:
    """Return the mean of the corners of a polygon, each given once."""
    return (
        sum(east for east, _ in corners) / len(corners),
        sum(north for _, north in corners) / len(corners),
    )


def convex_hull(points: Iterable[EastNorth]) -> Hull:
    """Return the smallest convex polygon around points; of none, one without corners."""
    places = [*points]
    corners = _corners(shapely.multipoints(places).convex_hull) if places else []
    return tuple(corners) if len(corners) < 3 else tuple(corners[:0:-1])


def buffered_hull(points: Iterable[EastNorth], distance_m: float) -> Hull:
    """Return a convex polygon around all that is within a distance of the hull of points."""
    if distance_m <= 0:
        return convex_hull(points)
    return convex_hull(
        (east + distance_m * cos, north + distance_m * sin)
        for east, north in points
        for cos, sin in _CIRCLE
    )


@lru_cache(4096)
def _shape(hull: Hull) -> "BaseGeometry":
    if len(hull) > 2:
        return shapely.Polygon(hull)
    return shapely.LineString(hull) if len(hull) == 2 else shapely.Point(hull)


def hull_distance_m(a: Hull | None, b: Hull | None) -> float:
    """Return the distance between two convex polygons; 0 if they touch. None is everywhere."""
    return 0.0 if a is None or b is None else float(_shape(a).distance(_shape(b)))


def near_stretch(
    way: tuple[EastNorth, EastNorth], hull: Hull, distance_m: float
) -> tuple[float, float] | None:
    """Return from which to which share of its length a straight way is nearer to a convex polygon
    than a distance; None: nowhere."""
    line = shapely.LineString(way)
    near = shapely.get_coordinates(line.intersection(_shape(hull).buffer(distance_m, 64)))
    shares = [line.project(shapely.Point(each), normalized=True) for each in near]
    return (min(shares), max(shares)) if shares else None


def meeting_place(a: Hull | None, b: Hull | None) -> EastNorth | None:
    """Return the middle of what two convex polygons have in common, or the middle between them if
    they are apart. None is everywhere; if both are, there is no middle."""
    if a is None or b is None:
        known = a or b
        return None if known is None else middle_of(known)
    return _middle_between(_shape(a), _shape(b))


def _middle_between(a: "BaseGeometry", b: "BaseGeometry") -> EastNorth:
    common = a.intersection(b) or shapely.shortest_line(a, b)
    return middle_of([*dict.fromkeys(_corners(common))])


def _corners(shape: "BaseGeometry") -> list[EastNorth]:
    return [(east, north) for east, north in shapely.get_coordinates(shape).tolist()]


# --- areas and corridors along routes, in a local frame -------------------------------------------


@dataclass(frozen=True, slots=True)
class Region:
    """A point, an area, or a corridor by its legs."""

    parts: "Sequence[BaseGeometry]"

    def distance_m(self, hull: Hull | None) -> float:
        """Return the distance to a convex polygon; 0 if they touch. None is everywhere."""
        return 0.0 if hull is None else float(min(shapely.distance(self.parts, _shape(hull))))

    def meets(self, hull: Hull | None) -> bool:
        """Whether it and a convex polygon have a place in common. None is everywhere."""
        return self.distance_m(hull) == 0.0

    def hulls(self) -> list[Hull]:
        return [convex_hull(_corners(each)) for each in self.parts]

    def common_place(self, hull: Hull | None) -> EastNorth | None:
        """Return a place that it has in common with a convex polygon that meets it; None: any."""
        if hull is None:
            return None
        return _middle_between(min(self.parts, key=_shape(hull).distance), _shape(hull))


def region_of(geometry: Geometry, width_m: float | None, frame: LocalFrame) -> Region:
    """Return a point, an area, or the corridor of a width along a route."""
    if isinstance(geometry, Point):
        return Region((_shape((frame.to_local(geometry.position[:2]),)),))
    if isinstance(geometry, Area):
        outer, *holes = ([frame.to_local(each[:2]) for each in ring] for ring in geometry.rings)
        return Region((shapely.Polygon(outer, holes),))
    if isinstance(geometry, Route):
        places = [frame.to_local(each[:2]) for each in geometry.waypoints]
        legs = pairwise(places) if len(places) > 1 else [(places[0],)]
        return Region([_shape(buffered_hull(leg, (width_m or 0.0) / 2)) for leg in legs])
    raise TypeError(f"{geometry!r} is not a point, an area or a route")


# --- rings of areas, in degrees -------------------------------------------------------------------

CIRCLE_CORNERS = 64


def circle_ring(center: LatLon, radius_m: float, *, is_around: bool) -> list[LatLon]:
    """Return the corners of a polygon around a circle, or within it; not closed."""
    frame, step = LocalFrame(center), math.tau / CIRCLE_CORNERS
    reach_m = radius_m / math.cos(step / 2) if is_around else radius_m
    return [
        frame.to_latlon((reach_m * math.sin(step * index), reach_m * math.cos(step * index)))
        for index in range(CIRCLE_CORNERS)
    ]


def ring_problem(rings: Sequence[Sequence[Coordinate]]) -> str:
    """What keeps closed rings from bounding an area, with its edges; "" if nothing does.

    No edge may cross another, go back along it, or cross the antimeridian (RFC 7946, 3.1.9), and
    each hole lies within the outer ring and in no other hole. Rings may touch in corners.
    """
    if problem := _limit_problem(rings):
        return problem
    if len(rings) == 1 and _is_convex(rings[0]):
        return ""  # most areas are, and Shapely loads slowly
    edges = _edges_of(rings)
    lines = shapely.linestrings(edges)
    one, other = shapely.STRtree(lines).query(lines, predicate="intersects")
    one, other = one[one < other], other[one < other]
    along = shapely.length(shapely.intersection(lines[one], lines[other])) > 0
    for is_apart, first, second in sorted(zip(~along, one, other, strict=True)):
        a, b = edges[first], edges[second]
        if not (is_apart and {*a} & {*b}):
            does = "crosses" if is_apart else "goes along"
            return f"its edge {_text(a)} {does} its edge {_text(b)}; a ring may not cross itself"
    level = [[corner[:2] for corner in ring] for ring in rings]
    return next(filter(None, map(_eight_problem, level)), "") or _hole_problem(level)


def _is_convex(ring: Sequence[Coordinate]) -> bool:
    """Whether a closed ring turns to one side at each corner, and once around as a whole."""
    steps = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(ring)]
    around = [*pairwise(steps), (steps[-1], steps[0])]
    turns = [a[0] * b[1] - a[1] * b[0] for a, b in around]
    backs = sum((a[0] >= 0) != (b[0] >= 0) for a, b in around)
    return backs <= 2 and (min(turns) > 0 or max(turns) < 0)


def _eight_problem(ring: Sequence[LatLon]) -> str:
    """Where a ring whose edges do not cross crosses itself: in a corner that it passes twice."""
    if valid(ring).area <= shapely.Polygon(ring).area * (1 + _SAME_AREA):
        return ""
    twice = next(corner for corner in ring[1:] if ring[1:].count(corner) > 1)
    return f"it crosses itself at its corner [{twice[0]:.9g}, {twice[1]:.9g}]"


def _hole_problem(rings: Sequence[Sequence[LatLon]]) -> str:
    outer, *holes = map(valid, rings)
    for index, hole in enumerate(holes, 1):
        if not outer.covers(hole):
            return f"its hole {index} lies outside of its outer ring"
        for number, other in enumerate(holes, 1):
            if number != index and other.covers(hole):
                return f"its hole {index} lies in its hole {number}"
    return ""


def mended(rings: Sequence[Sequence[Coordinate]]) -> tuple[tuple[Coordinate, ...], ...] | None:
    """Return closed rings without the parts that have no area, such as an edge that goes out and
    back; None: that is not all that is wrong with them."""
    if _limit_problem(rings):
        return None
    heights = {corner[:2]: corner[2] for ring in rings for corner in ring}
    outer, *holes = ([corner[:2] for corner in ring] for ring in rings)
    drawn, mend = shapely.Polygon(outer, holes), valid(outer, *holes)
    same = abs(mend.area - drawn.area) <= _SAME_AREA * drawn.area
    if not isinstance(mend, shapely.Polygon) or mend.is_empty or not same:
        return None
    return tuple(
        tuple((*at, heights[min(heights, key=partial(math.dist, at))]) for at in ring.coords)
        for ring in (mend.exterior, *mend.interiors)
    )


def _limit_problem(rings: Sequence[Sequence[Coordinate]]) -> str:
    if sum(map(len, rings)) > MAX_CORNERS:
        return f"has more than {MAX_CORNERS:,} corners; simplify it"
    for edge in _edges_of(rings):
        if abs(edge[1][1] - edge[0][1]) > 180.0:
            return (
                f"its edge {_text(edge)} crosses the antimeridian (longitude 180); "
                "use an area for each side of it"
            )
    return ""


def _edges_of(rings: Sequence[Sequence[Coordinate]]) -> list[Edge]:
    return [edge for ring in rings for edge in pairwise(c[:2] for c in ring) if edge[0] != edge[1]]


def _text(edge: Edge) -> str:
    (lat_a, lon_a), (lat_b, lon_b) = edge
    return f"from [{lat_a:.9g}, {lon_a:.9g}] to [{lat_b:.9g}, {lon_b:.9g}] (latitude, longitude)"
