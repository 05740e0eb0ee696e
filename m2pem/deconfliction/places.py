"""Says where something is: coordinates in the fleet's local frame, and the nearest named place."""

from functools import cached_property

from m2pem.fleet.fleet import Fleet
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.polygon import Region, region_of
from m2pem.geo.positions import NO_ORIGIN

NEAR_M = 1_000.0
"""A named place that is farther away says nothing."""


class PlaceNames:
    """The named routes, areas and points of a fleet file."""

    def __init__(self, fleet: Fleet) -> None:
        self._frame = None if fleet.origin == NO_ORIGIN else LocalFrame(fleet.origin)
        self._geometries = {} if self._frame is None else fleet.geometries

    @cached_property
    def _regions(self) -> dict[str, Region]:
        frame = self._frame or LocalFrame(NO_ORIGIN)
        return {name: region_of(each, None, frame) for name, each in self._geometries.items()}

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
        distances = ((each.distance_m((here,)), name) for name, each in self._regions.items())
        away_m, name = min(distances, default=(NEAR_M + 1.0, ""))
        if away_m > NEAR_M:
            return ""
        return f" (in '{name}')" if away_m == 0.0 else f" ({away_m:.0f} m from '{name}')"
