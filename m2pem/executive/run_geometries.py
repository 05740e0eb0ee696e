"""The routes, areas and points that one run has alone, besides those of all runs."""

from collections.abc import Mapping
from contextlib import suppress

from m2pem.api.runs import HandedOver
from m2pem.engine.state import RunState
from m2pem.geo.geojson import GeometryError, parse_geojson
from m2pem.mission.geometry import Area, Geometry, Point, Route


def own_geometries(
    state: RunState, handed_over: Mapping[str, HandedOver], of_all: Mapping[str, Geometry]
) -> dict[str, Route | Area | Point]:
    """Return what a run's tasks get by name and other runs do not.

    `handed_over`: the latest of operators for all runs; `of_all`: those and the fleet file's.
    """
    used: dict[str, Geometry] = dict(state.mission.geometries)
    for name, geometry in state.geometries.items():
        latest = handed_over.get(name)
        if name in used or latest is None or latest.geometry != geometry:
            with suppress(GeometryError):  # one of an older release, which this one does not read
                used[name] = parse_geojson(geometry)
    return {
        name: geometry
        for name, geometry in used.items()
        if isinstance(geometry, Route | Area | Point) and geometry != of_all.get(name)
    }
