"""Whether the rings of an area bound one: which side of a crossed edge is inside cannot be known.

The plane of longitude and latitude is the one in which GeoJSON draws straight edges (RFC 7946,
3.1.1).
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TypeAlias

from m2pem.mission.geometry import Coordinate

MAX_CORNERS = 10_000

_Corner: TypeAlias = tuple[float, float]
_Edge: TypeAlias = tuple[_Corner, _Corner]


def ring_problem(rings: Sequence[Sequence[Coordinate]]) -> str:
    """What keeps closed rings from bounding an area, with its edges; "" if nothing does.

    No edge may cross another or the antimeridian (RFC 7946, 3.1.9), and each hole lies within the
    outer ring and in no other hole. Rings may touch in corners.
    """
    if sum(map(len, rings)) > MAX_CORNERS:
        return f"has more than {MAX_CORNERS:,} corners; simplify it"
    edges = [edge for ring in rings for edge in pairwise(c[:2] for c in ring) if edge[0] != edge[1]]
    for edge in edges:
        if abs(edge[1][1] - edge[0][1]) > 180.0:
            return (
                f"its edge {_text(edge)} crosses the antimeridian (longitude 180); "
                "use an area for each side of it"
            )
    for a, b in _overlapping(edges):
        if _crosses(a, b):
            return f"its edge {_text(a)} crosses its edge {_text(b)}; a ring may not cross itself"
    return _hole_problem(rings)


def _overlapping(edges: list[_Edge]) -> Iterator[tuple[_Edge, _Edge]]:
    """The pairs of edges whose bounding boxes overlap."""
    boxes = [(min(a[1], b[1]), max(a[1], b[1]), min(a[0], b[0]), max(a[0], b[0])) for a, b in edges]
    active: list[int] = []
    for index in sorted(range(len(edges)), key=boxes.__getitem__):
        west, _, south, north = boxes[index]
        active = [other for other in active if boxes[other][1] >= west]
        for other in active:
            if boxes[other][2] <= north and boxes[other][3] >= south:
                yield edges[min(index, other)], edges[max(index, other)]
        active.append(index)


def _crosses(a: _Edge, b: _Edge) -> bool:
    """Whether two edges have more in common than a corner of both."""
    sides = [_side(*a, b[0]), _side(*a, b[1]), _side(*b, a[0]), _side(*b, a[1])]
    if sides[0] * sides[1] < 0 and sides[2] * sides[3] < 0:
        return True
    if set(a) & set(b):
        return False
    touches = ((a, b[0]), (a, b[1]), (b, a[0]), (b, a[1]))
    return any(
        side == 0 and _within(corner, edge)
        for side, (edge, corner) in zip(sides, touches, strict=True)
    )


def _side(a: _Corner, b: _Corner, c: _Corner) -> int:
    """On which side of the line from a to b the corner c lies: 1, -1, or 0 when it is on it."""
    turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return (turn > 0) - (turn < 0)


def _within(corner: _Corner, edge: _Edge) -> bool:
    (lat_a, lon_a), (lat_b, lon_b) = edge
    return min(lat_a, lat_b) <= corner[0] <= max(lat_a, lat_b) and min(lon_a, lon_b) <= corner[
        1
    ] <= max(lon_a, lon_b)


def _hole_problem(rings: Sequence[Sequence[Coordinate]]) -> str:
    for index, hole in enumerate(rings[1:], 1):
        if not _any_inside(hole, rings[0]):
            return f"its hole {index} lies outside of its outer ring"
        for number, other in enumerate(rings[1:], 1):
            if number != index and _any_inside(hole, other):
                return f"its hole {index} lies in its hole {number}"
    return ""


def _any_inside(ring: Sequence[Coordinate], around: Sequence[Coordinate]) -> bool:
    """Whether a ring that does not cross another lies within it; corners may be common."""
    common = {corner[:2] for corner in around}
    own = [corner[:2] for corner in ring if corner[:2] not in common]
    return bool(own) and _inside(own[0], around)


def _inside(corner: _Corner, ring: Sequence[Coordinate]) -> bool:
    """By counting the edges that a ray to the east crosses."""
    latitude, longitude = corner
    odd = False
    for (lat_a, lon_a, _), (lat_b, lon_b, _) in pairwise(ring):
        if (lat_a > latitude) != (lat_b > latitude):
            odd ^= longitude < (lon_b - lon_a) * (latitude - lat_a) / (lat_b - lat_a) + lon_a
    return odd


def _text(edge: _Edge) -> str:
    (lat_a, lon_a), (lat_b, lon_b) = edge
    return f"from [{lat_a:.9g}, {lon_a:.9g}] to [{lat_b:.9g}, {lon_b:.9g}] (latitude, longitude)"
