"""The fleet's fence: whether a way stays within it, and if not, where and how far it leaves it.

The fence is a polygon; its holes are keep-out areas. It has no ceiling.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

from m2pem.geo.local_frame import EastNorth, LatLon, LocalFrame
from m2pem.geo.polygon import Edge, edge_distance_m, edges_enclose
from m2pem.mission.geometry import Area

MARGIN_M = 0.1
"""A way may run along the fence."""

_LOOKS = 8
"""At so many places of a part that lies outside is measured how far outside it is."""


class Fence:
    """An area that may not be left."""

    def __init__(self, area: Area) -> None:
        self._frame = LocalFrame(area.rings[0][0][:2])
        self._edges: list[Edge] = []
        for ring in area.rings:
            self._edges += pairwise(self._frame.to_local(corner[:2]) for corner in ring)

    def outside_m(self, place: LatLon) -> float:
        """How far a place is from where one may be; 0 inside."""
        return self._outside_m(self._frame.to_local(place))

    def breach(
        self,
        way: Sequence[LatLon],
        start: LatLon | None = None,
        name: Callable[[int], str] = lambda index: f"waypoint {index + 1}",
    ) -> str:
        """Where a way of straight lines leaves the fence; "" if it does not.

        `start`: where the vehicle is. One that is outside already may come back. `name`: what
        people call a point of the way.
        """
        levels = [self._frame.to_local(place) for place in way]
        for index, (place, level) in enumerate(zip(way, levels, strict=True)):
            if (by_m := self._outside_m(level)) > MARGIN_M:
                return f"{name(index)}, {_text(place)}, is {_by(by_m)} outside the fleet's fence"
        ways = [
            (f"between {name(index)} and {name(index + 1)}", *ends)
            for index, ends in enumerate(pairwise(levels))
        ]
        if start is not None and levels and self.outside_m(start) <= MARGIN_M:
            ways.insert(0, (f"to {name(0)}", self._frame.to_local(start), levels[0]))
        for ends, a, b in ways:
            if out := self._worst(a, b):
                where = f"by {_by(out[1])} at {_text(self._frame.to_latlon(out[0]))}"
                return f"the way {ends} leaves the fleet's fence {where}"
        return ""

    def _outside_m(self, level: EastNorth) -> float:
        if edges_enclose(self._edges, level):
            return 0.0
        return min(edge_distance_m(level, edge) for edge in self._edges)

    def _worst(self, a: EastNorth, b: EastNorth) -> tuple[EastNorth, float] | None:
        """Of the parts of a line that lie outside, the point farthest out, and how far."""
        worst: tuple[EastNorth, float] | None = None
        cuts = sorted({0.0, 1.0, *self._cuts(a, b)})
        for low, high in pairwise(cuts):
            if edges_enclose(self._edges, _between(a, b, (low + high) / 2)):
                continue
            for look in range(_LOOKS + 1):
                level = _between(a, b, low + (high - low) * look / _LOOKS)
                by_m = self._outside_m(level)
                if by_m > MARGIN_M and (worst is None or by_m > worst[1]):
                    worst = (level, by_m)
        return worst

    def _cuts(self, a: EastNorth, b: EastNorth) -> Iterator[float]:
        """Where a line crosses edges, as parts of its length."""
        de, dn = b[0] - a[0], b[1] - a[1]
        for c, d in self._edges:
            ce, cn = d[0] - c[0], d[1] - c[1]
            cross = de * cn - dn * ce
            if cross == 0.0:
                continue
            along = ((c[0] - a[0]) * cn - (c[1] - a[1]) * ce) / cross
            across = ((c[0] - a[0]) * dn - (c[1] - a[1]) * de) / cross
            if 0.0 < along < 1.0 and 0.0 <= across <= 1.0:
                yield along


def _between(a: EastNorth, b: EastNorth, part: float) -> EastNorth:
    return a[0] + (b[0] - a[0]) * part, a[1] + (b[1] - a[1]) * part


def _by(metres: float) -> str:
    return f"{metres:.1f} m" if metres < 9.95 else f"{metres:.0f} m"


def _text(place: LatLon) -> str:
    return f"[{place[0]:.6f}, {place[1]:.6f}]"
