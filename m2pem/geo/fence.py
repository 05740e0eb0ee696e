"""Where vehicles may be: within an inclusion polygon, and out of exclusion polygons.

The words are those of MAVLink's geofence. Holes of the inclusion are exclusions; there is no
ceiling. Ways have a width: all that is kept out grows by half of it. Distances are metres in the
plane of a local frame.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from m2pem.geo.lazy_imports import rustworkx, shapely
from m2pem.geo.local_frame import EastNorth, LatLon, LocalFrame
from m2pem.mission.geometry import Area, Coordinate

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

MARGIN_M = 0.1
"""A way may run along the fence."""

GRAZE_M = 0.01
"""A way that is planned may run along what is kept out, as near as rounding is."""

_AROUND_M = 0.05
"""How far from its corners a way leads around what is kept out, beside the clearance."""

_FAR_M = 1e7
_MAX_CORNERS = 1_000
"""Of what a way leads around; with more of them, it leads around at a greater distance."""

_LOOKS = 16
"""At so many places of a part that lies outside is measured how far outside it is, and again
around the farthest."""

_NEAR_M, _NEAR_FACTOR = 1.0, 3.0
"""A start in an exclusion may leave it by a way of this length, and this much for each metre that
it is inside."""


@dataclass(frozen=True, slots=True)
class Breach:
    """Where a way leaves a fence, in words; `place`: the farthest point of what lies outside."""

    text: str
    place: LatLon

    def __str__(self) -> str:
        return self.text


class Fence:
    """Where vehicles may be; public in `m2pem.api`.

    `inclusion`: may not be left; None: no limit. `exclusions`: may not be entered; their holes may;
    with names, messages say which is entered. `clearance_m`: half of the width that a vehicle
    needs. `frame`: of `is_free`, `way` and `closed`; None: one at the first corner. Rings that are
    not valid are made so.
    """

    def __init__(
        self,
        inclusion: Area | None,
        exclusions: Sequence[Area] | Mapping[str, Area] = (),
        clearance_m: float = 0.0,
        frame: LocalFrame | None = None,
    ) -> None:
        named = exclusions if isinstance(exclusions, Mapping) else {}
        areas = [*named.values()] if named else [*exclusions]
        if frame is None:
            first = inclusion or areas[0]
            frame = LocalFrame(first.rings[0][0][:2])
        self.frame = frame
        self._given = inclusion, exclusions
        inside = None
        kept_out = [area_in(each.rings, frame) for each in areas]
        self._named = dict(zip(named, kept_out, strict=False))
        if inclusion is not None:
            inside = area_in(inclusion.rings[:1], frame).buffer(-clearance_m, join_style="mitre")
            kept_out += [area_in([hole], frame) for hole in inclusion.rings[1:]]
        self._keep(inside, kept_out, clearance_m)

    @classmethod
    def around(cls, rings: Sequence[Sequence[EastNorth]]) -> "Fence":
        """Return the fence that keeps out what closed rings bound, in metres of any local frame: it
        has no `frame`, and is for `is_free`, `way` and `closed`."""
        return cls._of(None, [valid(ring) for ring in rings])

    @classmethod
    def _of(cls, inside: "BaseGeometry | None", kept_out: Sequence["BaseGeometry"]) -> "Fence":
        fence = cls.__new__(cls)
        fence._named = {}
        fence._keep(inside, kept_out, 0.0)
        return fence

    def apart_from(self, kept_out: Sequence["BaseGeometry"]) -> "Fence":
        """Return as `around` does the same one that also keeps out areas in metres of its frame."""
        return self._of(self._inside, [self.closed, *kept_out])

    def _keep(
        self, inside: "BaseGeometry | None", kept_out: Sequence["BaseGeometry"], clearance_m: float
    ) -> None:
        everywhere = shapely.box(-_FAR_M, -_FAR_M, _FAR_M, _FAR_M)
        self._inside = inside = everywhere if inside is None else inside
        self.closed: BaseGeometry = shapely.union_all(kept_out)
        """The exclusions with the clearance, in metres of the frame."""
        if clearance_m > 0:
            self.closed = self.closed.buffer(clearance_m, join_style="mitre")
        self._free = inside.difference(self.closed)
        self._out = self.closed.union(everywhere.difference(inside))
        self._deep, self._inner = (
            shapely.union_all([*_eroded(self._out, by_m)]) for by_m in (MARGIN_M, GRAZE_M)
        )
        for each in (self._free, self._deep, self._inner):
            shapely.prepare(each)

    def with_clearance(self, clearance_m: float) -> "Fence":
        """Return the same one for a vehicle that needs another width."""
        return Fence(*self._given, clearance_m, self.frame)

    def in_frame(self, frame: LocalFrame) -> "Fence":
        """Return the same one, without clearance, in another local frame."""
        return _in_frame(self, frame)

    def outside_m(self, place: LatLon) -> float:
        """How far a place is from where one may be; 0 inside."""
        return self._outside_m(self.frame.to_local(place))

    def breach(
        self,
        way: Sequence[LatLon],
        start: LatLon | None = None,
        name: Callable[[int], str] = lambda index: f"waypoint {index + 1}",
        loop: bool = False,
    ) -> str:
        """Where a way of straight lines leaves the fence, as `find_breach`; "" if it does not."""
        return str(self.find_breach(way, start, name, loop) or "")

    def find_breach(
        self,
        way: Sequence[LatLon],
        start: LatLon | None = None,
        name: Callable[[int], str] = lambda index: f"waypoint {index + 1}",
        loop: bool = False,
    ) -> Breach | None:
        """Return where a way of straight lines leaves the fence; None: it does not.

        `start`: where the vehicle is. One that is outside of the inclusion may come in by a way
        that is never farther out, one in an exclusion may leave it by a near way. `name`: what
        people call a point of the way. `loop`: the way leads back to its first point.
        """
        levels = [self.frame.to_local(place) for place in way]
        for index, (place, level) in enumerate(zip(way, levels, strict=True)):
            if (by_m := self._outside_m(level)) > MARGIN_M:
                closed = self._name_of(level)
                where = f"inside {closed}" if closed else "outside the fleet's fence"
                return Breach(f"{name(index)}, {_text(place)}, is {_by(by_m)} {where}", place)
        order = [*range(len(way)), *([0] if loop else [])]
        legs = [
            (f"the way between {name(a)} and {name(b)}", levels[a], levels[b])
            for a, b in pairwise(order)
        ]
        if start is not None and levels:
            entered = self._entered(self.frame.to_local(start), levels[0])
            legs.insert(0, (f"the way to {name(0)}", entered, levels[0]))
        return next(filter(None, (self._worst(leg, what) for what, *leg in legs)), None)

    def leaves(self, track: Sequence[EastNorth]) -> Breach | None:
        """As `find_breach`, of a track in the local frame from where the vehicle is. It may have
        many points: those of curves, too."""
        start = track[0]
        moves = (at for at, place in enumerate(track) if math.dist(start, place) > GRAZE_M)
        way = track[next(moves, len(track)) :]
        return self._worst([self._entered(start, way[0]), *way], "its way") if way else None

    def is_free(self, a: EastNorth, b: EastNorth) -> bool:
        """Whether the straight way between two places enters nothing that is kept out."""
        return self._are_free(a, [b])[0]

    def way(self, a: EastNorth, b: EastNorth) -> list[EastNorth] | None:
        """Return the places to pass between two places on the shortest way around what is kept out;
        None: there is no way.

        The way from, or to, a place that is kept out leads by the nearest one that is not.
        """
        if a == b or self.is_free(a, b):
            return []
        near = [self._nearest_free(each) for each in (a, b)]
        ends = [place or end for place, end in zip(near, (a, b), strict=True)]
        graph = self._corner_graph.copy()
        start, end = (self._add(graph, place) for place in ends)
        paths = rustworkx.dijkstra_shortest_paths(graph, start, target=end, weight_fn=float)
        if end not in paths:
            return None
        between = [graph[at] for at in paths[end][1:-1]]
        return [place for place in (near[0], *between, near[1]) if place is not None]

    def way_home(
        self, here: LatLon, home: LatLon, aside_m: float = 0.0
    ) -> tuple[list[LatLon], str]:
        """Return the places to pass on a return, which is never refused, and where it leaves the
        fence all the same; "": nowhere. `aside_m`: so far from what is kept out, if there is room.
        """
        ends = self.frame.to_local(here), self.frame.to_local(home)
        around = self.with_clearance(aside_m).way(*ends) if aside_m else None
        places = [*map(self.frame.to_latlon, around or self.way(*ends) or ())]
        names = [*["a corner of its way home"] * len(places), "its home"]
        return places, self.breach([*places, home], here, names.__getitem__)

    def _outside_m(self, level: EastNorth) -> float:
        distance_m = float(self._free.distance(shapely.Point(level)))
        return math.inf if math.isnan(distance_m) else distance_m  # nothing is left of it

    def _entered(self, a: EastNorth, b: EastNorth) -> EastNorth:
        """Where the way from a place that may be outside is inside; the place itself if it leads
        farther out, or through an exclusion."""
        start = shapely.Point(a)
        parts = _lines(shapely.LineString((a, b)).intersection(self._out))
        first = min(parts, key=start.distance, default=None)
        if first is None or start.distance(first) > MARGIN_M:
            return a
        length_m = max(math.dist(a, corner) for corner in first.coords)
        depth_m = self._outside_m(a)
        if self.closed.distance(start) <= MARGIN_M:
            leads = length_m <= _NEAR_FACTOR * depth_m + _NEAR_M
        else:
            _, deepest_m = self._deepest(first.coords[0], first.coords[-1])
            leads = deepest_m <= depth_m + MARGIN_M and not first.intersection(self.closed).length
        return _between(a, b, min(1.0, length_m / math.dist(a, b))) if leads else a

    def _worst(self, way: Sequence[EastNorth], what: str) -> Breach | None:
        """Of the parts of a way that lie outside, how far the farthest point is out, and where."""
        line = shapely.LineString(way) if len(way) > 1 else shapely.Point(way[0])
        parts = _lines(line.intersection(self._deep))
        legs = (self._deepest(*leg) for part in parts for leg in pairwise(part.coords))
        level, by_m = max(legs, key=lambda deepest: deepest[1], default=((0.0, 0.0), 0.0))
        if by_m <= 0:
            return None
        place, closed = self.frame.to_latlon(level), self._name_of(level)
        does = f"enters {closed}," if closed else "leaves the fleet's fence"
        return Breach(f"{what} {does} by {_by(by_m)} at {_text(place)}", place)

    def _name_of(self, level: EastNorth) -> str:
        """Return what has a place that is kept out by its name; "": nothing."""
        place = shapely.Point(level)
        names = (name for name, area in self._named.items() if area.covers(place))
        return next((f"'{name}', which is closed" for name in names), "")

    def _deepest(self, a: EastNorth, b: EastNorth) -> tuple[EastNorth, float]:
        """Return the point of a line that is farthest out, and how far."""
        low, step = 0.0, 1.0 / _LOOKS
        while True:
            places = [_between(a, b, low + look * step) for look in range(_LOOKS + 1)]
            depths = [self._outside_m(place) for place in places]
            look = depths.index(max(depths))
            if step * math.dist(a, b) < MARGIN_M:
                return places[look], depths[look]
            low += step * max(0, min(_LOOKS - 2, look - 1))
            step *= 2 / _LOOKS

    def _nearest_free(self, place: EastNorth) -> EastNorth | None:
        """Return the nearest place that is not kept out; None: this one is not, or all are."""
        point = shapely.Point(place)
        room = self._free.buffer(-_AROUND_M, join_style="mitre")
        if room.is_empty or not self._inner.intersects(point):
            return None
        nearest = shapely.shortest_line(room, point).coords[0]
        return nearest[0], nearest[1]

    def _are_free(self, place: EastNorth, others: Sequence[EastNorth]) -> list[bool]:
        lines = shapely.linestrings([(place, other) for other in others])
        return [not each for each in shapely.intersects(self._inner, lines)]

    @cached_property
    def _corner_graph(self) -> Any:
        """The corners to go around, and the lengths of the free straight ways between them."""
        around_m, corners = _AROUND_M, _corners(self._out.buffer(_AROUND_M, join_style="mitre"))
        while len(corners) > _MAX_CORNERS:
            around_m *= 2
            grown = self._out.buffer(around_m, join_style="mitre")
            corners = _corners(grown.simplify(around_m / 2))
        graph = rustworkx.PyGraph()
        for corner in corners:
            self._add(graph, corner)
        return graph

    def _add(self, graph: Any, place: EastNorth) -> int:
        """Add a place and the free straight ways from it; return its index."""
        others = graph.nodes()
        ways = [
            (at, math.dist(place, others[at]))
            for at, free in enumerate(self._are_free(place, others) if others else ())
            if free
        ]
        index: int = graph.add_node(place)
        graph.add_edges_from([(index, at, length_m) for at, length_m in ways])
        return index


@lru_cache(16)
def _in_frame(fence: Fence, frame: LocalFrame) -> Fence:
    return Fence(*fence._given, 0.0, frame)


def area_in(rings: Sequence[Sequence[Coordinate]], frame: LocalFrame) -> "BaseGeometry":
    """Return the area that rings bound, made valid."""
    return valid(*([frame.to_local(corner[:2]) for corner in ring] for ring in rings))


def valid(ring: Sequence[EastNorth], *holes: Sequence[EastNorth]) -> "BaseGeometry":
    """Return what a closed ring bounds beside its holes, made valid."""
    drawn = shapely.Polygon(ring, holes)
    return shapely.make_valid(drawn, method="structure", keep_collapsed=False)


def rings_of(area: "BaseGeometry") -> list[list[EastNorth]]:
    """Return the closed rings of an area; [] where it is not one polygon.

    The first ring is the outer one, counter-clockwise, the others are holes, clockwise.
    """
    parts = [part for part in polygons(area) if not part.buffer(-GRAZE_M).is_empty]
    if len(parts) != 1:
        return []
    part = shapely.orient_polygons(parts[0])
    return [[(x, y) for x, y, *_ in ring.coords] for ring in (part.exterior, *part.interiors)]


def polygons(geometry: "BaseGeometry") -> list[Any]:
    return [part for part in getattr(geometry, "geoms", [geometry]) if part.area > 0]


def _lines(geometry: "BaseGeometry") -> list[Any]:
    return [part for part in getattr(geometry, "geoms", [geometry]) if part.length > 0]


def _eroded(geometry: "BaseGeometry", by_m: float) -> Iterator["BaseGeometry"]:
    """Yield what is deeper inside than a distance; of a part that is too thin, than less."""
    for part in polygons(geometry):
        yield part.buffer(-by_m) or part.buffer(-by_m / 10) or part.buffer(-by_m / 100)


def _corners(kept_out: "BaseGeometry") -> list[EastNorth]:
    """Return the corners that a shortest way may pass: where what is kept out is convex."""
    corners = []
    for part in map(shapely.orient_polygons, polygons(kept_out)):  # what is kept out is to the left
        for ring in (part.exterior, *part.interiors):
            coords = ring.coords[:-1]
            for a, b, c in zip(coords[-1:] + coords, coords, coords[1:] + coords[:1], strict=False):
                turn = (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
                if turn > 0 and max(map(abs, b)) < _FAR_M / 2:
                    corners.append(b)
    return corners


def _between(a: EastNorth, b: EastNorth, part: float) -> EastNorth:
    return a[0] + (b[0] - a[0]) * part, a[1] + (b[1] - a[1]) * part


def _by(metres: float) -> str:
    return f"{metres:.1f} m" if metres < 9.95 else f"{metres:.0f} m"


def _text(place: LatLon) -> str:
    return f"[{place[0]:.6f}, {place[1]:.6f}]"
