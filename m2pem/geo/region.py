"""Areas, and corridors along routes, in a local frame: what meets them."""

from dataclasses import dataclass
from itertools import pairwise

from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.polygon import (
    Edge,
    Hull,
    buffered_hull,
    hull_distance_m,
    hull_meets_edges,
    meeting_place,
    middle_of,
)
from m2pem.mission.geometry import Area, Geometry, Route


@dataclass(frozen=True, slots=True)
class Region:
    """An area by the `edges` of its rings, or a corridor by its `legs`."""

    edges: tuple[Edge, ...] = ()
    legs: tuple[Hull, ...] = ()

    def meets(self, hull: Hull | None) -> bool:
        """Whether it and a convex polygon have a place in common. None is everywhere."""
        if self.legs:
            return any(hull_distance_m(leg, hull) == 0.0 for leg in self.legs)
        return hull_meets_edges(hull, self.edges)

    def common_place(self, hull: Hull | None) -> EastNorth | None:
        """Return a place that it has in common with a convex polygon that meets it; None: any."""
        if hull is None:
            return None
        if self.legs:
            return meeting_place(min(self.legs, key=lambda leg: hull_distance_m(leg, hull)), hull)
        crossed = [edge for edge in self.edges if hull_distance_m(edge, hull) == 0.0]
        return middle_of([meeting_place(edge, hull) or edge[0] for edge in crossed] or [*hull])


def region_of(geometry: Geometry, width_m: float | None, frame: LocalFrame) -> Region:
    """Return an area, or the corridor of a width along a route."""
    if isinstance(geometry, Area):
        return Region(
            edges=tuple(
                edge
                for ring in geometry.rings
                for edge in pairwise(frame.to_local(corner[:2]) for corner in ring)
            )
        )
    if isinstance(geometry, Route):
        places = [frame.to_local(each[:2]) for each in geometry.waypoints]
        legs = pairwise(places) if len(places) > 1 else [(places[0],)]
        return Region(legs=tuple(buffered_hull(leg, (width_m or 0.0) / 2) for leg in legs))
    raise TypeError(f"{geometry!r} is neither an area nor a route")
