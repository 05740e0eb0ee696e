"""Ways around a place where a lost member is."""

from collections.abc import Sequence
from itertools import pairwise

from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polygon import Hull, buffered_hull, edge_distance_m
from m2pem.geo.polyline import EastNorthUp, Polyline

_INSIDE = 1e-9


def comes_near(places: Sequence[EastNorthUp], lost: Sequence[EastNorth], distance_m: float) -> bool:
    """Whether a way comes nearer than that to where a lost member may be."""
    hull = buffered_hull(lost, distance_m)
    return any(_inside(hull, a[:2], b[:2]) is not None for a, b in pairwise(places))


def around(
    places: Sequence[EastNorthUp], lost: Sequence[EastNorth], distance_m: float
) -> list[EastNorthUp]:
    """Return a way that keeps that distance from where a lost member may be, on the shorter side.

    A way that ends nearer than that ends before. One that begins there leads out first.
    """
    hull = buffered_hull(lost, distance_m)
    kept = [places[0]]
    entry: EastNorth | None = None
    for begin, end in pairwise(places):
        inside = _inside(hull, begin[:2], end[:2])
        if inside is not None:
            enters, leaves = (
                tuple(a + (b - a) * share for a, b in zip(begin[:2], end[:2], strict=True))
                for share in inside
            )
            if entry is None:
                entry = (enters[0], enters[1])
                kept.append((*entry, end[2]))
            if inside[1] > 1 - _INSIDE:
                continue
            exit_ = (leaves[0], leaves[1])
            kept += [(*corner, end[2]) for corner in (*_along(hull, entry, exit_), exit_)]
            entry = None
        kept.append(end)
    return kept


def _inside(hull: Hull, begin: EastNorth, end: EastNorth) -> tuple[float, float] | None:
    """Return from which to which share of a segment it is inside of a convex polygon."""
    low, high = 0.0, 1.0
    for (ae, an), (be, bn) in pairwise((*hull, hull[0])):
        at = (be - ae) * (begin[1] - an) - (bn - an) * (begin[0] - ae)
        then = (be - ae) * (end[1] - an) - (bn - an) * (end[0] - ae)
        if at <= _INSIDE and then <= _INSIDE:
            return None
        if at < 0:
            low = max(low, at / (at - then))
        elif then < 0:
            high = min(high, at / (at - then))
    return (low, high) if high - low > _INSIDE else None


def _along(hull: Hull, entry: EastNorth, exit_: EastNorth) -> list[EastNorth]:
    """Return the corners of a polygon from one place at its edge to another one."""
    edges = list(pairwise((*hull, hull[0])))
    first, last = (
        min(range(len(edges)), key=lambda index: edge_distance_m(place, edges[index]))
        for place in (entry, exit_)
    )
    size = len(hull)
    ways = (
        [hull[(first + step) % size] for step in range(1, (last - first) % size + 1)],
        [hull[(first - step) % size] for step in range((first - last) % size)],
    )
    return min(ways, key=lambda way: Polyline([entry, *way, exit_]).length_m)
