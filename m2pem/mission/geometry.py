"""Routes, areas and points as missions and arbiters see them: named WGS-84 geometries."""

from dataclasses import dataclass
from typing import TypeAlias, Union

Coordinate: TypeAlias = tuple[float, float, float | None]
"""(latitude in degrees, longitude in degrees, altitude in metres or None when not given)."""


@dataclass(frozen=True, slots=True)
class Point:
    """One position. `altitude_frame` is "relative" (to home), "amsl" or "terrain"."""

    position: Coordinate
    altitude_frame: str = "relative"


@dataclass(frozen=True, slots=True)
class Route:
    """Waypoints in order (a GeoJSON LineString).

    `speeds_m_s`: of each waypoint, how fast the vehicle goes from there on, until another waypoint
    has a speed; None: it has none. Empty: no waypoint has one.
    """

    waypoints: tuple[Coordinate, ...]
    altitude_frame: str = "relative"
    speeds_m_s: tuple[float | None, ...] = ()

    def speed_from(self, index: int) -> float | None:
        """Return how fast a vehicle leaves a waypoint, in m/s; None: as fast as it does anyway."""
        given = (speed for speed in self.speeds_m_s[index::-1] if speed is not None)
        return next(given, None) if index >= 0 else None


@dataclass(frozen=True, slots=True)
class Area:
    """A polygon: outer ring, then holes; each ring closed (first coordinate repeated last)."""

    rings: tuple[tuple[Coordinate, ...], ...]
    altitude_frame: str = "relative"


@dataclass(frozen=True, slots=True)
class VehiclePosition:
    """The present position of a vehicle of the fleet: a moving target."""

    vehicle: str


Geometry: TypeAlias = Union[Point, Route, Area, VehiclePosition]
"""What a geometry parameter resolves to."""
