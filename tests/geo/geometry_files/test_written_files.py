"""What is written: other libraries read it, and random geometries survive the round trip."""

import csv
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import fastkml
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavutil, mavwp
from pymavlink.dialects.v20 import ardupilotmega

from m2pem.geo.geojson import GeometryError
from m2pem.geo.geometry_files import (
    FileFormat,
    NamedGeometry,
    read_geometry_file,
    write_geometry_file,
)
from m2pem.mission.geometry import Area, Coordinate, Point, Route

ROUTE = NamedGeometry("road", Route(((38.1, -77.3, 20.5), (38.2, -77.25, 30.0)), "terrain"))
HOLED = NamedGeometry(
    "field",
    Area(
        (
            ((38.0, -77.0, None), (38.0, -76.0, None), (39.0, -76.5, None), (38.0, -77.0, None)),
            ((38.1, -76.6, None), (38.1, -76.4, None), (38.3, -76.5, None), (38.1, -76.6, None)),
        )
    ),
)
GATE = NamedGeometry("gate", Point((38.5, -77.1, 12.25), "amsl"))
RALLY = NamedGeometry("rally", Point((38.5, -77.1, 12.25)))
EVERYTHING = (ROUTE, HOLED, GATE)


def written(file_format: str, *geometries: NamedGeometry, altitude_m: float | None = None) -> bytes:
    return write_geometry_file(FileFormat(file_format), geometries, altitude_m)


def read_again(content: bytes, file_format: str) -> Sequence[NamedGeometry]:
    file = read_geometry_file(f"again.{file_format}", content)
    assert file.problems == ()
    return file.geometries


# --- other libraries read it --------------------------------------------------------------------


@pytest.mark.tried_with(
    "fastkml",
    "reads KML that m2pem writes",
    kind="Maps and geodesy",
    result="the same geometries",
    package="fastkml",
)
def test_fastkml_reads_what_is_written() -> None:
    document = fastkml.KML.parse(BytesIO(written("kml", *EVERYTHING))).features[0]
    placemarks = {each.name: each for each in document.features}  # type: ignore[union-attr]
    road = placemarks["road"].geometry
    assert tuple(road.coords) == ((-77.3, 38.1, 20.5), (-77.25, 38.2, 30.0))
    field = placemarks["field"].geometry
    assert len(list(field.interiors)) == 1
    assert next(iter(field.exterior.coords)) == (-77.0, 38.0)
    assert placemarks["gate"].kml_geometry.altitude_mode.value == "absolute"
    assert tuple(placemarks["gate"].geometry.coords) == ((-77.1, 38.5, 12.25),)


@pytest.mark.parametrize("frame", ["relative", "amsl", "terrain"])
@pytest.mark.tried_with(
    "pymavlink",
    "its `mavwp` reads `.waypoints` that m2pem writes",
    kind="MAVLink clients",
    result="the same places, heights and frames",
    package="pymavlink",
)
def test_pymavlink_reads_what_is_written(
    tmp_path: Path, frame: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MAVLINK20", "1")  # another test of the process may have set it
    monkeypatch.setattr(mavutil, "mavlink", ardupilotmega)
    route = Route(((38.1, -77.3, 20.5), (38.2, -77.25, 30.0)), frame)
    path = tmp_path / "road.waypoints"
    path.write_bytes(written("waypoints", NamedGeometry("road", route)))
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(path)) == 3
    home, *items = (loader.wp(index) for index in range(3))
    assert (home.frame, home.command, home.z) == (0, 16, 0)
    assert {item.frame for item in items} == {{"relative": 3, "amsl": 0, "terrain": 10}[frame]}
    assert [(item.x, item.y, item.z) for item in items] == list(route.waypoints)


def test_pymavlink_reads_the_speeds_that_are_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MAVLINK20", "1")
    monkeypatch.setattr(mavutil, "mavlink", ardupilotmega)
    route = Route(((38.1, -77.3, 20.5), (38.2, -77.25, 30.0)), speeds_m_s=(2.5, None))
    path = tmp_path / "road.waypoints"
    path.write_bytes(written("waypoints", NamedGeometry("road", route)))
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(path)) == 4
    speed = loader.wp(2)
    assert (speed.command, speed.param1, speed.param2) == (178, 1, 2.5)
    assert loader.wp(3).command == 16


def test_a_plan_has_what_the_format_asks_for() -> None:
    plan = json.loads(written("plan", ROUTE, HOLED, RALLY))
    assert (plan["fileType"], plan["mission"]["version"]) == ("Plan", 2)
    assert plan["mission"]["plannedHomePosition"] == [38.1, -77.3, 0]
    first = plan["mission"]["items"][0]
    assert (first["command"], first["frame"], first["params"][4:]) == (16, 10, [38.1, -77.3, 20.5])
    fences = plan["geoFence"]["polygons"]
    assert [fence["inclusion"] for fence in fences] == [True, False]
    assert fences[0]["polygon"] == [[38.0, -77.0], [38.0, -76.0], [39.0, -76.5]]
    assert plan["rallyPoints"]["points"] == [[38.5, -77.1, 12.25]]


def test_a_table_is_csv() -> None:
    rows = list(csv.DictReader(written("csv", *EVERYTHING).decode().splitlines()))
    assert [row["name"] for row in rows] == ["road"] * 2 + ["field"] * 8 + ["gate"]
    assert rows[0] == {
        "name": "road",
        "kind": "route",
        "ring": "0",
        "lat_deg": "38.1",
        "lon_deg": "-77.3",
        "alt_m": "20.5",
        "altitude_frame": "terrain",
    }


# --- what a format cannot hold ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("file_format", "geometries", "says"),
    [
        ("plan", (ROUTE, NamedGeometry("other", ROUTE.geometry)), "one route, not 2"),
        ("waypoints", (ROUTE, GATE), "one route and nothing else"),
        ("waypoints", (GATE,), "one route and nothing else"),
        ("waypoints", (NamedGeometry("a", Route(((1, 2, 3.0), (2, 3, None)))),), "waypoint 2"),
        ("plan", (GATE,), "rally point is amsl"),
        ("geojson", (), "nothing to write"),
    ],
)
def test_what_a_format_cannot_hold_is_refused(
    file_format: str, geometries: Sequence[NamedGeometry], says: str
) -> None:
    with pytest.raises(GeometryError, match=says):
        written(file_format, *geometries)


def test_waypoints_without_an_altitude_get_the_one_that_is_said() -> None:
    content = written(
        "waypoints", NamedGeometry("a", Route(((1.0, 2.0, 3.0), (2.0, 3.0, None)))), altitude_m=40.0
    )
    (again,) = read_again(content, "waypoints")
    assert again.geometry == Route(((1.0, 2.0, 3.0), (2.0, 3.0, 40.0)))


# --- random geometries --------------------------------------------------------------------------

latitudes = st.floats(-80, 80, allow_nan=False)
longitudes = st.floats(-170, 170, allow_nan=False)
altitudes = st.floats(-500, 9000, allow_nan=False)
frames = st.sampled_from(["relative", "amsl", "terrain"])


@st.composite
def areas(draw: st.DrawFn) -> Area:
    """A star around a centre, so that its edges do not cross; perhaps with a hole of its shape."""
    latitude, longitude = draw(latitudes), draw(longitudes)
    radii = draw(st.lists(st.floats(0.2, 1.0), min_size=3, max_size=8))

    def ring(scale: float) -> tuple[Coordinate, ...]:
        corners: list[Coordinate] = []
        for index, radius in enumerate(radii):
            angle = math.tau * index / len(radii)
            north, east = scale * radius * math.sin(angle), scale * radius * math.cos(angle)
            corners.append((latitude + north, longitude + east, None))
        return (*corners, corners[0])

    holes = (ring(0.5),) if draw(st.booleans()) else ()
    return Area((ring(1.0), *holes), draw(frames))


positions = st.tuples(latitudes, longitudes, st.none() | altitudes)
flown = st.tuples(latitudes.filter(bool), longitudes, altitudes.filter(bool))


@st.composite
def with_speeds(draw: st.DrawFn, routes: st.SearchStrategy[Route]) -> Route:
    route = draw(routes)
    count = len(route.waypoints)
    speeds = draw(st.lists(st.none() | st.floats(0.01, 99.0), min_size=count, max_size=count))
    has_some = any(speed is not None for speed in speeds)
    own_frames = [draw(frames) for _ in range(count if draw(st.booleans()) else 0)]
    mixed = Route.of(route.waypoints, own_frames) if own_frames else route
    return replace(mixed, speeds_m_s=tuple(speeds) if has_some else ())


routes = with_speeds(
    st.builds(Route, st.lists(positions, min_size=2, max_size=8).map(tuple), frames)
)
points = st.builds(Point, positions, frames)
names = st.from_regex(r"[a-z][a-z0-9_\-]{0,10}[a-z0-9]", fullmatch=True)
named = st.lists(
    st.builds(NamedGeometry, names, routes | points | areas()),
    min_size=1,
    max_size=4,
    unique_by=lambda each: each.name,
)


@pytest.mark.parametrize("file_format", ["geojson", "kml", "csv"])
@given(geometries=named)
def test_all_kinds_survive_the_round_trip(
    file_format: str, geometries: list[NamedGeometry]
) -> None:
    assert list(read_again(written(file_format, *geometries), file_format)) == geometries


def test_a_place_at_0_0_cannot_be_written_as_a_waypoint() -> None:
    nowhere = NamedGeometry("a", Route(((0.0, 0.0, 20.0),)))
    with pytest.raises(GeometryError, match="waypoint 1 is at 0, 0, which in such files means"):
        written("waypoints", nowhere)


def test_a_plan_of_different_altitude_frames_says_so_of_each_item() -> None:
    mixed = Route.of(((38.1, -77.3, 20.0), (38.2, -77.3, 95.0)), ("relative", "amsl"))
    mission = json.loads(written("plan", NamedGeometry("road", mixed)))["mission"]
    assert mission["globalPlanAltitudeMode"] == 0
    assert [(each["frame"], each["AltitudeMode"]) for each in mission["items"]] == [(3, 1), (0, 2)]


@pytest.mark.parametrize("file_format", ["plan", "waypoints"])
@given(
    route=with_speeds(st.builds(Route, st.lists(flown, min_size=1, max_size=8).map(tuple), frames))
)
def test_routes_survive_the_round_trip(file_format: str, route: Route) -> None:
    (again,) = read_again(written(file_format, NamedGeometry("again", route)), file_format)
    assert again == NamedGeometry("again", route)


@given(area=areas())
def test_areas_survive_the_round_trip_through_a_plan(area: Area) -> None:
    again = read_again(written("plan", NamedGeometry("a", area)), "plan")
    holes = area.rings[1:]
    assert [each.name for each in again] == ["fence", *("keep_out" for _ in holes)]
    assert [each.geometry for each in again] == [Area((ring,)) for ring in area.rings]
