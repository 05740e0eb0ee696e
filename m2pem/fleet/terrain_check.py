"""The static check of heights: whether aircraft keep the fleet's clearance from the ground.

Of routes and points whose altitude is known before the mission starts. Altitudes above home count
from the ground at the fleet's origin.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from m2pem.findings import Severity
from m2pem.fleet.fleet import Domain, Fleet
from m2pem.fleet.parameters import ResolvedValue
from m2pem.fleet.task_findings import TaskFindings
from m2pem.geo.elevation_files import TerrainError
from m2pem.geo.positions import NO_ORIGIN
from m2pem.geo.terrain import Terrain, lowest, profile
from m2pem.geo.terrain_following import not_covered
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Coordinate, Point, Route

_STEP_M = 30.0


@dataclass(slots=True)
class GroundCheck:
    """The check of one mission. Elevation files are opened with the first altitude."""

    fleet: Fleet
    _terrain: list[Terrain] = field(default_factory=list)
    _unusable: str = ""

    def check(
        self,
        resources: Iterable[ResourceId],
        values: Mapping[str, ResolvedValue],
        lines: Mapping[str, int],
        findings: TaskFindings,
    ) -> None:
        """Find where an aircraft among those that act would come too near to the ground.

        `values`: of its behavior's parameters, in SI units; `lines`: of those in the file.
        """
        known = (self.fleet.vehicles.get(each) for each in resources)
        aircraft = next((each for each in known if each and each.domain is Domain.AIR), None)
        clearance_m = self.fleet.clearance_m
        if clearance_m is None or aircraft is None:
            return
        for name, route in _ways(values):
            line = lines.get(name, 0)
            try:
                low = self._lowest(route)
            except TerrainError as error:
                findings.add(
                    "ground-unknown",
                    f"parameter '{name}': the height above the ground is not known: {error}",
                    line=line,
                    severity=Severity.WARNING,
                )
                continue
            if low is None or low[0] >= clearance_m:
                continue
            above_m, (latitude_deg, longitude_deg) = low
            where = f"[{latitude_deg:.5f}, {longitude_deg:.5f}]"
            height = (
                f"{-above_m:.0f} m below the ground" if above_m < 0 else f"{above_m:.0f} m above it"
            )
            findings.add(
                "low-over-ground",
                f"parameter '{name}': {aircraft.id} would be {height} at {where}; the fleet's "
                f"clearance is {clearance_m:g} m",
                f"raise it by {clearance_m - above_m:.0f} m, or let the route follow the terrain",
                line=line,
                severity=Severity.WARNING,
            )

    def _lowest(self, route: Route) -> tuple[float, tuple[float, float]] | None:
        """Return the least height above ground, and where; None: the route has no altitude."""
        if not self._terrain:
            if self._unusable:
                raise TerrainError(self._unusable)
            try:
                self._terrain.append(Terrain(Path(self.fleet.terrain_folder)))
            except TerrainError as error:
                self._unusable = str(error)
                raise
        [terrain] = self._terrain
        home_m = None
        if "relative" in route.frames and self.fleet.origin != NO_ORIGIN:
            home_m = terrain.height_m(self.fleet.origin[:2])
        points = profile(route, terrain, _STEP_M, home_m)
        unknown = next((each for each in points if each.ground_m is None), None)
        if unknown is not None:
            raise TerrainError(not_covered(unknown.place))
        low = lowest(points)
        if low is None or low.above_ground_m is None:
            return None
        return low.above_ground_m, low.place


def _ways(values: Mapping[str, ResolvedValue]) -> Iterator[tuple[str, Route]]:
    """Yield the routes and points of a behavior with the altitudes at which they are passed."""
    altitude_m, frame = values.get("altitude"), values.get("altitude_frame")
    for name, value in values.items():
        if isinstance(value, Route):
            waypoints, frames = value.waypoints, value.frames
        elif isinstance(value, Point):
            waypoints, frames = (value.position,), (value.altitude_frame,)
        else:
            continue
        if isinstance(altitude_m, int | float):
            raised: list[Coordinate] = [(each[0], each[1], float(altitude_m)) for each in waypoints]
            waypoints = tuple(raised)
            frames = (frame if isinstance(frame, str) else "relative",) * len(waypoints)
        if any(each[2] is not None for each in waypoints):
            yield name, Route.of(waypoints, frames)
