from typing import Any

import pytest

from m2pem.geo.geojson import GeometryError
from m2pem.geo.qgroundcontrol import parse_plan, parse_waypoints
from m2pem.mission.geometry import Area, Route


def item(command: int, lat: float | None, lon: float | None, alt: float, frame: int = 3) -> Any:
    params = [0, 0, 0, None, lat, lon, alt]
    return {"type": "SimpleItem", "command": command, "frame": frame, "params": params}


def plan(*items: Any, **more: Any) -> Any:
    return {"fileType": "Plan", "version": 1, "mission": {"items": list(items)}, **more}


SURVEY = {
    "type": "ComplexItem",
    "complexItemType": "survey",
    "polygon": [[38.0, -77.0], [38.1, -77.0], [38.1, -77.1]],
}


def test_the_places_of_a_plan_are_a_route() -> None:
    route = parse_plan(
        plan(
            item(22, None, None, 20),  # take off here
            item(16, 38.0, -77.0, 30),
            item(206, 0, 0, 0, frame=2),  # camera trigger: no place
            item(82, 38.1, -77.1, 40),
            item(20, 0, 0, 0, frame=2),  # return to launch: no place
        ),
        area=False,
    )
    assert route == Route(((38.0, -77.0, 30.0), (38.1, -77.1, 40.0)), "relative")


@pytest.mark.parametrize(
    ("frame", "name"), [(0, "amsl"), (5, "amsl"), (6, "relative"), (10, "terrain"), (11, "terrain")]
)
def test_the_frame_of_the_items_is_the_altitude_frame(frame: int, name: str) -> None:
    route = parse_plan(plan(item(16, 1, 2, 3, frame=frame)), area=False)
    assert route.altitude_frame == name


def test_a_survey_or_an_inclusion_fence_is_an_area() -> None:
    corner = (38.0, -77.0, None)
    ring = (corner, (38.1, -77.0, None), (38.1, -77.1, None), corner)
    assert parse_plan(plan(SURVEY), area=True) == Area((ring,))
    fence = {"polygons": [{"inclusion": True, "polygon": SURVEY["polygon"]}, {"inclusion": False}]}
    assert parse_plan(plan(geoFence=fence), area=True) == Area((ring,))


@pytest.mark.parametrize(
    ("value", "area", "message"),
    [
        ({"fileType": "Fence"}, False, "'fileType' is not 'Plan'"),
        ({"fileType": "Plan"}, False, "mission.items: a list"),
        (plan("x"), False, "mission.items: a list"),
        (plan(), False, "has no waypoint"),
        (plan(SURVEY), False, "mission.items[0]: a 'survey' item is no waypoint"),
        (plan(item(16, 1, 2, 3), item(16, 1, 2, 3, frame=0)), False, "mixes altitude frames"),
        (plan(item(16, 1, 2, 3, frame=7)), False, "MAV_FRAME 7"),
        (plan(item(16, 91, 2, 3)), False, "mission.items[0]: latitude 91"),
        (plan({"type": "SimpleItem", "command": 16, "params": [1]}), False, "seven numbers"),
        (plan(), True, "has 0 survey"),
        (plan(SURVEY, SURVEY), True, "has 2 survey"),
        (plan({"polygon": [[1, 2]]}), True, "at least three corners"),
        (plan({"polygon": [[1, 2], [3], [4, 5]]}), True, "polygon[1]: a corner"),
    ],
)
def test_a_plan_that_holds_no_such_geometry_is_refused(
    value: Any, area: bool, message: str
) -> None:
    with pytest.raises(GeometryError) as refused:
        parse_plan(value, area)
    assert message in str(refused.value)


WAYPOINTS = """\
QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t38.0\t-77.0\t60.0\t1
1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t20.0\t1
2\t0\t3\t16\t0\t0\t0\t0\t38.1\t-77.1\t30.0\t1

3\t0\t3\t178\t0\t5\t0\t0\t0\t0\t0\t1
4\t0\t3\t16\t0\t0\t0\t0\t38.2\t-77.2\t40.0\t1
"""


def test_the_places_of_a_waypoint_file_are_a_route_without_its_home() -> None:
    places = ((38.1, -77.1, 30.0), (38.2, -77.2, 40.0))
    assert parse_waypoints(WAYPOINTS) == Route(places, speeds_m_s=(5.0, None))


@pytest.mark.parametrize(
    ("changed", "speeds"),
    [
        (("178\t0\t5", "178\t1\t5"), (5.0, None)),
        (("178\t0\t5", "178\t2\t5"), ()),  # of climbing
        (("178\t0\t5", "178\t1\t-1"), ()),  # no change
        (("3\t0\t3\t178", "4\t0\t3\t178"), (5.0, None)),
    ],
)
def test_only_speeds_over_ground_or_through_the_air_are_read(
    changed: tuple[str, str], speeds: tuple[float | None, ...]
) -> None:
    assert parse_waypoints(WAYPOINTS.replace(*changed)).speeds_m_s == speeds


def test_a_speed_before_the_first_place_holds_from_there_on() -> None:
    header, home, *items = WAYPOINTS.splitlines()
    speed = next(item for item in items if "\t178\t" in item)
    text = "\n".join((header, home, speed, *(item for item in items if item is not speed)))
    assert parse_waypoints(text).speeds_m_s == (5.0, None)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1 is not 'QGC WPL 110'"),
        ("QGC WPL 120\n", "line 1 is not 'QGC WPL 110'"),
        ("QGC WPL 110\n", "has no waypoint"),
        (WAYPOINTS + "5\t0\t3\n", "line 8: has 3 columns, not 12"),
        (WAYPOINTS.replace("38.1", "x"), "line 4: a number is expected"),
        (WAYPOINTS.replace("38.1", "nan"), "line 4: latitude nan is not finite"),
        (WAYPOINTS.replace("38.1", "98.1"), "line 4: latitude 98.1"),
        (WAYPOINTS.replace("4\t0\t3", "4\t0\t10"), "mixes altitude frames (relative, terrain)"),
    ],
)
def test_a_waypoint_file_that_cannot_be_read_names_the_line(text: str, message: str) -> None:
    with pytest.raises(GeometryError) as refused:
        parse_waypoints(text)
    assert message in str(refused.value)
