"""What faces and maps show besides vehicles: all routes, areas and points that are used now."""

import logging

from m2pem.api.control import MissionControl
from m2pem.errors import M2pemError
from m2pem.geo.geojson import parse_geojson
from m2pem.mission.geometry import Area, Point, Route

log = logging.getLogger("m2pem.api")


def shown_geometries(control: MissionControl) -> dict[str, Point | Route | Area]:
    """Return the geometries that an executive uses now, by the names under which they are shown.

    Those of the fleet file and those that operators have handed over for all runs have their own
    names. One that a run under way has alone (`MissionControl.run_geometries`) is `RUN/NAME`, as
    in `r1/lane`: no other name has a slash. It is shown until its run has ended.
    """
    shown: dict[str, Point | Route | Area] = {
        name: geometry
        for name, geometry in control.fleet().geometries.items()
        if isinstance(geometry, Point | Route | Area)
    }
    for name, given in control.geometries().items():
        try:
            shown[name] = parse_geojson(given.geometry)
        except M2pemError as error:  # it was checked when it was handed over
            log.warning("geometry %s is not shown: %s", name, error)
    for run, geometries in control.run_geometries().items():
        shown |= {f"{run}/{name}": geometry for name, geometry in geometries.items()}
    return shown
