"""The local frame in which simulated vehicles move.

The ground is flat: `up` is the difference of altitudes to the fleet's origin.
"""

import math

from m2pem.api.telemetry import GeoPosition
from m2pem.geo.local_frame import EastNorth, LatLon, LocalFrame
from m2pem.geo.positions import MAX_RANGE_M
from m2pem.simulation.segments import Vector


class FlatFrame(LocalFrame):
    """The local frame at the fleet's origin, over flat ground."""

    def to_place(self, latlon: LatLon) -> EastNorth:
        """Return east and north of a place that can be simulated.

        Raises:
            ValueError: it is no position, or too far from the origin.
        """
        if not all(map(math.isfinite, latlon)):
            raise ValueError(f"[{latlon[0]}, {latlon[1]}] is no position")
        east, north = self.to_local(latlon)
        distance_m = math.hypot(east, north)
        if distance_m > MAX_RANGE_M:
            raise ValueError(
                f"[{latlon[0]}, {latlon[1]}] is {distance_m / 1000:.0f} km from the fleet's "
                f"origin [{self.origin[0]}, {self.origin[1]}]; the simulation reaches "
                f"{MAX_RANGE_M / 1000:.0f} km: set the fleet's `origin` near the vehicles"
            )
        return east, north

    def to_position(self, place: Vector) -> GeoPosition:
        """Return the WGS-84 position of a place."""
        east, north, up = place
        return GeoPosition(*self.to_latlon((east, north)), self.origin[2] + up)
