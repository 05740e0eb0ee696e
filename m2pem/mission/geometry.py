"""Routes, areas and points as missions and arbiters see them: named WGS-84 geometries."""

from collections.abc import Iterable
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
    `altitude_frames`: of each waypoint, where they differ; `altitude_frame` is then that of the
    first. Empty: `altitude_frame` holds for all.
    """

    waypoints: tuple[Coordinate, ...]
    altitude_frame: str = "relative"
    speeds_m_s: tuple[float | None, ...] = ()
    altitude_frames: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        waypoints: Iterable[Coordinate],
        frames: Iterable[str],
        speeds_m_s: tuple[float | None, ...] = (),
    ) -> "Route":
        """Return the route of one waypoint or more, each with its altitude frame."""
        of_each = tuple(frames)
        mixed = of_each if len(set(of_each)) > 1 else ()
        return cls(tuple(waypoints), of_each[0], speeds_m_s, mixed)

    @property
    def frames(self) -> tuple[str, ...]:
        """The altitude frame of each waypoint."""
        return self.altitude_frames or (self.altitude_frame,) * len(self.waypoints)

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
