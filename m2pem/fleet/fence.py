"""Where the vehicles of a fleet may be, by their domain: the one fence that all checks ask."""

import re
from collections.abc import Mapping
from functools import lru_cache

from m2pem.fleet.fleet import Domain, Fleet
from m2pem.geo.fence import Fence, rings_of
from m2pem.geo.geometry_files import KEEP_OUT
from m2pem.geo.lazy_imports import shapely
from m2pem.geo.local_frame import LocalFrame
from m2pem.mission.geometry import Area, Point, Route


def fence_of(fleet: Fleet, domain: Domain) -> Fence | None:
    """Return the fence of a fleet for vehicles of a domain: within its `fence`, and out of shared
    space that has no place for them. None: they may be anywhere."""
    area = fleet.geometries.get(fleet.fence)
    closed = tuple(
        (space.name, fleet.geometries[space.name], space.width_m)
        for space in fleet.closed_space.values()
        if domain in space.domains
    )
    if not isinstance(area, Area) and not closed:
        return None
    return _fence(area if isinstance(area, Area) else None, closed)


@lru_cache(16)
def _fence(area: Area | None, closed: tuple[tuple[str, Area | Route, float | None], ...]) -> Fence:
    return Fence(
        area,
        {
            name: _corridor(each, width_m or 0.0) if isinstance(each, Route) else each
            for name, each, width_m in closed
        },
    )


def _corridor(route: Route, width_m: float) -> Area:
    frame = LocalFrame(route.waypoints[0][:2])
    line = shapely.LineString([frame.to_local(each[:2]) for each in route.waypoints])
    rings = rings_of(line.buffer(width_m / 2))
    return Area(tuple(tuple((*frame.to_latlon(at), None) for at in ring) for ring in rings))


def own_areas(vehicle: str, geometries: Mapping[str, Point | Route | Area]) -> dict[str, Area]:
    """Return the areas, among those that were handed over, that bound one vehicle alone, by their
    names: VEHICLE.fence, which it may not leave, VEHICLE.keep_out, and more with a number."""
    is_own = re.compile(rf"{re.escape(vehicle)}\.(fence|{KEEP_OUT})(_\d+)?").fullmatch
    return {
        name: area for name, area in geometries.items() if isinstance(area, Area) and is_own(name)
    }


def own_fences(vehicle: str, geometries: Mapping[str, Point | Route | Area]) -> list[Fence]:
    """Return the fences of one vehicle alone: it must be within each."""
    areas = own_areas(vehicle, geometries)
    closed = {name: area for name, area in areas.items() if f".{KEEP_OUT}" in name}
    fences = [Fence(area) for name, area in areas.items() if name not in closed]
    return [*fences, *([Fence(None, closed)] if closed else [])]
