"""Plans of QGroundControl (its documentation of the format) and files with the header QGC WPL."""

import json
from typing import Any

import pytest

from m2pem.findings import Severity
from m2pem.geo.geometry_files import GeometryFile, read_geometry_file
from m2pem.geo.geometry_files.contents import MAX_POSITIONS
from m2pem.geo.local_frame import LocalFrame
from m2pem.mission.geometry import Area, Point, Route

SQUARE = [[38.0, -77.0], [38.1, -77.0], [38.1, -77.1]]
SURVEY = {"type": "ComplexItem", "complexItemType": "survey", "polygon": SQUARE}


def item(command: int, lat: float | None, lon: float | None, alt: float, frame: int = 3) -> Any:
    params = [0, 0, 0, None, lat, lon, alt]
    return {"type": "SimpleItem", "command": command, "frame": frame, "params": params}


def plan(*items: Any, firmware: int = 3, **more: Any) -> Any:
    mission = {"items": list(items), "firmwareType": firmware}
    return {"fileType": "Plan", "version": 1, "mission": mission, **more}


def read(value: Any) -> GeometryFile:
    return read_geometry_file("north.plan", json.dumps(value).encode())


def said(file: GeometryFile) -> list[tuple[str, str]]:
    return [(each.severity.value, str(each)) for each in file.problems]


def test_everything_with_a_place_in_a_plan_is_read() -> None:
    file = read(
        plan(
            item(22, 53.0, 7.0, 10.0),
            {**item(178, 0, 0, 0), "params": [1, 4.5, -1, 0, 0, 0, 0]},
            item(16, 38.5, -77.5, 20.0),
            item(16, 38.6, -77.5, 20.0),
            SURVEY,
            {"type": "ComplexItem", "complexItemType": "fwLandingPattern"},
            geoFence={
                "polygons": [{"polygon": SQUARE}, {"polygon": SQUARE[:2], "inclusion": False}],
                "circles": [{"circle": {"center": [53, 7], "radius": 5}, "inclusion": False}],
                "breachReturn": [38.0, -77.0, 40],
            },
            rallyPoints={"points": [[53.0, 7.0, 30.0]]},
        )
    )
    assert [(each.name, type(each.geometry)) for each in file.geometries] == [
        ("survey", Area),
        ("north", Route),
        ("fence", Area),
        ("keep_out", Area),
        ("fence_return", Point),
        ("rally", Point),
    ]
    places = ((38.5, -77.5, 20.0), (38.6, -77.5, 20.0))
    assert file.geometries[1].geometry == Route(places, speeds_m_s=(4.5, None))
    assert [(each.severity, each.feature, each.kind) for each in file.problems] == [
        (Severity.WARNING, "item 5 (survey)", ""),
        (Severity.WARNING, "item 6 (fwLandingPattern)", "route"),
        (Severity.WARNING, "item 1 (to 10 m)", "route"),
        (Severity.ERROR, "geoFence.polygons[1]", "area"),
    ]


def test_items_have_the_numbers_of_the_ground_station() -> None:
    survey = {**SURVEY, "angle": 45, "TransectStyleComplexItem": {"CameraCalc": {}}}
    landing = {**item(21, 38.0, -77.0, 0), "doJumpId": 42}
    file = read(plan({**item(16, 38.0, -77.0, 30), "doJumpId": 4}, survey, landing))
    assert [each.feature.split(" (")[0] for each in file.problems] == ["item 5", "item 42"]


@pytest.mark.parametrize(
    ("mode", "frame", "altitude", "name"),
    [(1, 3, 30, "relative"), (2, 0, 95, "amsl"), (3, 0, 95, "amsl"), (4, 10, 30, "terrain")],
)
def test_the_frame_of_an_item_says_what_its_altitude_is_above(
    mode: int, frame: int, altitude: float, name: str
) -> None:
    waypoint = {**item(16, 38.0, -77.0, altitude, frame), "AltitudeMode": mode, "Altitude": 30}
    (found,) = read(plan(item(22, None, None, 20), waypoint)).geometries
    assert found.geometry == Route(((38.0, -77.0, altitude),), name)


def test_a_height_over_ground_that_is_not_calculated_is_refused() -> None:
    waypoint = {**item(16, 38.0, -77.0, 0, 0), "AltitudeMode": 3, "Altitude": 30}
    waypoint["params"][6] = None
    ((severity, text),) = said(read(plan(waypoint)))
    assert (severity, "its altitude above the terrain is not calculated" in text) == ("error", True)


@pytest.mark.parametrize(("firmware", "warned"), [(12, ["item 1 (0 deg)"]), (3, [])])
def test_a_heading_of_0_is_north_to_px4_and_none_to_ardupilot(
    firmware: int, warned: list[str]
) -> None:
    waypoint = item(16, 38.0, -77.0, 30)
    waypoint["params"][3] = 0
    file = read(plan(waypoint, firmware=firmware))
    assert [each.feature for each in file.problems] == warned


def test_a_place_that_is_null_is_the_one_before() -> None:
    items = [item(22, None, None, 20), item(16, 38.0, -77.0, 30), item(19, None, None, 40)]
    (found,) = read(plan(*items, item(21, None, None, 0))).geometries
    assert found.geometry == Route(((38.0, -77.0, 30.0), (38.0, -77.0, 40.0)))


def test_how_a_survey_is_flown_is_said() -> None:
    style = {
        "CameraCalc": {"AdjustedFootprintSide": 25, "DistanceToSurface": 50, "CameraName": "Sony"},
        "TurnAroundDistance": 10,
        "FollowTerrain": True,
        "Items": [item(16, 38.0, -77.0, 50)],
    }
    file = read(plan({**SURVEY, "angle": 0, "TransectStyleComplexItem": style}))
    ((_, text),) = said(file)
    assert text == (
        "item 1 (survey): only its area is read, not angle 0, AdjustedFootprintSide 25, "
        "DistanceToSurface 50, TurnAroundDistance 10, FollowTerrain True, CameraName Sony; set "
        "heading, spacing, altitude and overshoot of a task `area_survey`"
    )
    old = {**SURVEY, "grid": {"angle": 30, "spacing": 20, "altitude": 60}}
    ((_, text),) = said(read(plan(old)))
    assert "not angle 30, spacing 20, altitude 60;" in text


def test_a_corridor_is_an_area_of_its_width() -> None:
    line = [[38.0, -77.0], [38.01, -77.0]]
    corridor = {"type": "ComplexItem", "complexItemType": "CorridorScan", "polyline": line}
    (found,) = read(plan({**corridor, "CorridorWidth": 30})).geometries
    assert found.name == "corridor"
    assert isinstance(found.geometry, Area)
    frame = LocalFrame((38.0, -77.0))
    easts = [frame.to_local(each[:2])[0] for each in found.geometry.rings[0]]
    assert easts == pytest.approx([-15, -15, 15, 15, -15], abs=1e-3)
    ((severity, text),) = said(read(plan(corridor)))
    assert (severity, "CorridorWidth" in text) == ("error", True)


def test_a_corridor_whose_sides_cross_is_refused() -> None:
    line = [[38.0, -77.0], [38.001, -77.0], [38.0, -77.0001]]
    corridor = {"type": "ComplexItem", "complexItemType": "CorridorScan", "polyline": line}
    ((severity, text),) = said(read(plan({**corridor, "CorridorWidth": 200})))
    assert (severity, "draw it as an area, 200 m wide" in text) == ("error", True)


def test_the_building_of_a_structure_scan_is_no_area() -> None:
    scan = {"type": "ComplexItem", "complexItemType": "StructureScan", "polygon": SQUARE}
    file = read(plan(scan))
    assert file.geometries == ()
    assert said(file)[0][1].startswith("item 1 (StructureScan): its polygon is a building")


def test_a_survey_between_waypoints_is_no_part_of_a_route() -> None:
    file = read(plan(item(16, 38.0, -77.0, 30), SURVEY, item(16, 38.1, -77.0, 30)))
    assert [each.name for each in file.geometries] == ["survey"]
    assert said(file)[1][1].startswith("item 2: a survey, with waypoints behind it, is no part")


def test_fences_and_rally_points_are_read_without_a_mission() -> None:
    points = {"points": [[53.0, 7.0, 30.0]]}
    file = read({"fileType": "Plan", "rallyPoints": points})
    assert [each.name for each in file.geometries] == ["rally"]
    assert [each.kind for each in file.problems] == ["route"]


def test_items_of_the_first_plans_have_a_coordinate_and_four_parameters() -> None:
    old = {**item(16, 0, 0, 0), "params": [0, 0, 0, 0], "coordinate": [38.0, -77.0, 30]}
    fence = {"polygon": SQUARE, "version": 1}
    first, second = read(plan(old, geoFence=fence)).geometries
    assert first.geometry == Route(((38.0, -77.0, 30.0),))
    assert second.name == "fence"


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({"fileType": "Fence"}, "'fileType' is not 'Plan'"),
        ({"fileType": "Plan"}, "mission: items: a list"),
        (plan("x"), "mission: items: a list"),
        (plan(), "has no route, area or point"),
        (plan(item(20, 0, 0, 0, frame=2)), "has no route, area or point"),
        (plan(item(16, 1, 2, 3, frame=7)), "item 1 (mission.items[0]): MAV_FRAME 7"),
        (plan(item(16, 91, 2, 3)), "item 1 (mission.items[0]): latitude 91"),
        (plan({"type": "SimpleItem", "command": 16, "params": [1]}), "seven numbers"),
        (plan({"type": "SimpleItem", "command": 16, "params": [True] * 7}), "seven numbers"),
        (plan({"type": "SimpleItem", "command": "16", "params": [0] * 7}), "'command', a number"),
        (plan({**SURVEY, "polygon": [[1, 2]]}), "at least three corners"),
        (plan({**SURVEY, "polygon": [[1, 2], [3], [4, 5]]}), "polygon[1]: [latitude"),
        (
            plan({"type": "ComplexItem", "complexItemType": "Spiral"}),
            "item 1 (Spiral): is not read",
        ),
        (plan(geoFence={"circles": [{"circle": {"center": [1, 2]}}]}), "a radius of None m"),
    ],
)
def test_a_plan_that_cannot_be_read_says_where(value: Any, message: str) -> None:
    file = read(value)
    assert file.geometries == ()
    assert message in next(text for severity, text in said(file) if severity == "error")


# --- QGC WPL ------------------------------------------------------------------------------------

ROWS = """\
# planned by hand
0\t1\t0\t16\t0\t0\t0\t0\t38.0\t-77.0\t60.0\t1

1\t0\t3\t16\t0\t0\t0\t0\t38.1\t-77.1\t30.0\t1
2\t0\t3\t16\t0\t0\t0\t0\t38.2\t-77.2\t40.0\t1
"""
PLACES = ((38.1, -77.1, 30.0), (38.2, -77.2, 40.0))


def waypoints(text: str, name: str = "m.waypoints") -> GeometryFile:
    return read_geometry_file(name, text.encode())


@pytest.mark.parametrize("suffix", ["waypoints", "txt", "mission"])
def test_the_first_row_is_home_and_comments_are_skipped(suffix: str) -> None:
    file = waypoints(f"QGC WPL 110\n{ROWS}", f"m.{suffix}")
    assert file.problems == ()
    assert [each.geometry for each in file.geometries] == [Route(PLACES)]


def test_a_first_row_that_could_be_a_waypoint_is_named() -> None:
    text = ROWS.replace("0\t1\t0\t16", "0\t1\t3\t16")
    file = waypoints(f"QGC WPL 110\n{text}")
    assert [each.geometry for each in file.geometries] == [Route(PLACES)]
    assert said(file)[0][1].startswith(
        "item 0 (line 3): is taken as the home position; 'QGC WPL 120'"
    )


def test_version_120_has_no_home_position() -> None:
    (found,) = waypoints(f"QGC WPL 120\n{ROWS}").geometries
    assert found.geometry == Route.of(
        ((38.0, -77.0, 60.0), *PLACES), ("amsl", "relative", "relative")
    )


def test_version_120_with_a_home_position_before_a_take_off() -> None:
    text = ROWS.replace("1\t0\t3\t16", "1\t0\t3\t22")
    file = waypoints(f"QGC WPL 120\n{text}")
    assert [each.geometry for each in file.geometries] == [Route(PLACES[1:])]
    assert said(file)[0][1].startswith("item 0 (line 3): is taken as the home position")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1 is not 'QGC WPL 110'"),
        (f"QGC WPL 130\n{ROWS}", "line 1 is not 'QGC WPL 110'"),
        ("QGC WPL 110\n", "has no route, area or point"),
        (f"QGC WPL 110\n{ROWS}5\t0\t3\n", "line 7: has 3 columns, not 12"),
        (f"QGC WPL 110\n{ROWS}".replace("38.1", "x"), "line 5: a number is expected"),
        (f"QGC WPL 110\n{ROWS}".replace("38.1", "nan"), "item 1 (line 5): latitude None"),
        (f"QGC WPL 110\n{ROWS}".replace("38.1", "98.1"), "item 1 (line 5): latitude 98.1"),
        (f"QGC WPL 110\n{ROWS}".replace("1\t0\t3\t16", "1\t0\tinf\t16"), "line 5: a number is"),
    ],
)
def test_a_waypoint_file_that_cannot_be_read_names_the_line(text: str, message: str) -> None:
    file = waypoints(text)
    assert file.geometries == ()
    assert message in str(file.problems[0])


@pytest.mark.parametrize(("of_plan", "of_mission"), [(1, 7), (42, 2), ("1", 2)])
def test_a_version_that_is_not_known_is_refused(of_plan: object, of_mission: int) -> None:
    """As QGroundControl does: MAVSDK's tests have such plans."""
    value = plan(item(16, 38.5, -77.5, 20.0), version=of_plan)
    value["mission"]["version"] = of_mission
    ((_, error),) = said(read(value))
    assert f"has the versions {(of_plan, of_mission)} of the plan and its mission" in error


def test_an_item_without_a_type_is_named_by_what_is_missing() -> None:
    untyped = item(16, 38.5, -77.5, 20.0)
    del untyped["type"]
    assert said(read(plan(untyped)))[0][1].startswith("item 1 (no 'type'): is not read")


def test_rows_are_counted_before_they_are_read() -> None:
    """A bad row at the end: of a file that is too long it is never reached."""
    rows = "1 0 3 16 0 0 0 0 38 -77 20 1\n" * MAX_POSITIONS
    (problem,) = read_geometry_file("a.waypoints", f"QGC WPL 110\n{rows}bad\n".encode()).problems
    assert str(problem).startswith("the file has more than 200,000 positions")
