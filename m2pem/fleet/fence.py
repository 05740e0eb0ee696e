"""Where the vehicles of a fleet may be, by their domain: the one fence that all checks ask."""

from functools import lru_cache

from m2pem.fleet.fleet import Domain, Fleet
from m2pem.geo.fence import Fence, rings_of
from m2pem.geo.lazy_imports import shapely
from m2pem.geo.local_frame import LocalFrame
from m2pem.mission.geometry import Area, Route


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
