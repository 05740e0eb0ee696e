"""Says where something is: coordinates in the fleet's local frame, and the nearest named place."""

import math
from itertools import pairwise

from m2pem.fleet.fleet import Fleet
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.polygon import Edge, edge_distance_m, edges_enclose
from m2pem.geo.positions import NO_ORIGIN
from m2pem.mission.geometry import Area, Geometry, Point, Route

NEAR_M = 1_000.0
"""A named place that is farther away says nothing."""


class PlaceNames:
    """The named routes, areas and points of a fleet file."""

    def __init__(self, fleet: Fleet) -> None:
        self._frame = None if fleet.origin == NO_ORIGIN else LocalFrame(fleet.origin)
        self._edges: dict[str, tuple[Geometry, list[Edge]]] = {}
        if self._frame is not None:
            for name, geometry in fleet.geometries.items():
                self._edges[name] = geometry, _edges(geometry, self._frame)

    def at(self, place: EastNorth, frame: LocalFrame) -> str:
        """Return `at enu [12, -3] (5 m from 'gate')`, or latitude and longitude if the fleet has no
        origin. `frame`: of `place`."""
        latlon = frame.to_latlon(place)
        if self._frame is None:
            return f"at [{latlon[0]:.6f}, {latlon[1]:.6f}]"
        here = self._frame.to_local(latlon)
        east, north = (round(each) + 0 for each in here)
        return f"at enu [{east}, {north}]{self._near(here)}"

    def _near(self, here: EastNorth) -> str:
        found = min(
            ((self._distance_m(name, here), name) for name in self._edges),
            default=(math.inf, ""),
        )
        if found[0] > NEAR_M:
            return ""
        return (
            f" (in '{found[1]}')" if found[0] == 0.0 else f" ({found[0]:.0f} m from '{found[1]}')"
        )

    def _distance_m(self, name: str, here: EastNorth) -> float:
        geometry, edges = self._edges[name]
        if isinstance(geometry, Area) and edges_enclose(edges, here):
            return 0.0
        return min((edge_distance_m(here, edge) for edge in edges), default=math.inf)


def _edges(geometry: Geometry, frame: LocalFrame) -> list[Edge]:
    if isinstance(geometry, Point):
        place = frame.to_local(geometry.position[:2])
        return [(place, place)]
    lines = []
    if isinstance(geometry, Route):
        lines = [geometry.waypoints]
    elif isinstance(geometry, Area):
        lines = list(geometry.rings)
    return [edge for line in lines for edge in pairwise(frame.to_local(each[:2]) for each in line)]
