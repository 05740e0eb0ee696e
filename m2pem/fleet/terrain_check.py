"""The static check of heights: whether aircraft keep the fleet's clearance from the ground.

Of routes and points whose altitude is known before the mission starts. Altitudes above home count
from the ground at the fleet's origin.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from m2pem.findings import Severity
from m2pem.fleet.fleet import Domain, Fleet
from m2pem.fleet.parameters import ResolvedValue
from m2pem.fleet.task_findings import TaskFindings
from m2pem.geo.elevation_files import Terrain, TerrainError
from m2pem.geo.positions import NO_ORIGIN
from m2pem.geo.terrain import LONGEST_M, ProfilePoint, lowest, profile
from m2pem.geo.terrain_following import not_covered
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Coordinate, Point, Route

_SAME_M = 1e-4


@dataclass
class GroundCheck:
    """The check of one mission. Elevation files are opened with the first altitude."""

    fleet: Fleet

    @cached_property
    def _terrain(self) -> Terrain:
        return Terrain(Path(self.fleet.terrain_folder))

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
                points = self._profile(route)
                gap = next((each.place for each in points if each.ground_m is None), None)
                unknown, low = "" if gap is None else not_covered(gap), lowest(points)
            except TerrainError as error:
                unknown, low = str(error), None
            if unknown:
                findings.add(
                    "ground-unknown",
                    f"parameter '{name}': the height above the ground is not known: {unknown}",
                    line=line,
                    severity=Severity.WARNING,
                )
            if low is None or low.above_ground_m is None:
                continue
            least_m = low.above_ground_m + _SAME_M
            if least_m >= clearance_m:
                continue
            above_m, raise_m = math.floor(least_m * 10) / 10, math.ceil(clearance_m - least_m)
            where = f"[{low.place[0]:.5f}, {low.place[1]:.5f}], {low.along_m:.0f} m along its way"
            height = (
                f"{-above_m:g} m below the ground" if above_m < 0 else f"{above_m:g} m above it"
            )
            findings.add(
                "low-over-ground",
                f"parameter '{name}': {aircraft.id} would be {height} at {where}; the fleet's "
                f"clearance is {clearance_m:g} m",
                f"raise it by {raise_m} m, or let the route follow the terrain",
                line=line,
                severity=Severity.WARNING,
                place=low.place,
            )

    def _profile(self, route: Route) -> list[ProfilePoint]:
        home_m = None
        if "relative" in route.frames and self.fleet.origin != NO_ORIGIN:
            home_m = self._terrain.height_m(self.fleet.origin[:2])
        return profile(route, self._terrain, LONGEST_M, home_m)


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
        if values.get("loop") is True:
            waypoints, frames = (*waypoints, waypoints[0]), (*frames, frames[0])
        if any(each[2] is not None for each in waypoints):
            yield name, Route.of(waypoints, frames)
