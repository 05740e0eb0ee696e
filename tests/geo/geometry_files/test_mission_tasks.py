"""The items of ground stations as tasks."""

import pytest

from m2pem.findings import Severity
from m2pem.geo.geometry_files.contents import FileProblem
from m2pem.geo.geometry_files.mission_items import MissionItem
from m2pem.geo.geometry_files.mission_tasks import (
    read_fence_items,
    read_mission_tasks,
    read_rally_items,
)
from m2pem.mission.geometry import Point, Route

A, B, C = (38.1, -77.0, 20.0), (38.11, -77.0, 25.0), (38.12, -77.0, None)
NONE = (None, None, None)
Place = tuple[float | None, float | None, float | None]


def item(
    number: int,
    command: int,
    place: Place = NONE,
    params: tuple[float | None, ...] = (None,) * 4,
    frame: int = 3,
    goes_on: bool = True,
) -> MissionItem:
    return MissionItem(number, "", command, frame, (*params, *place), goes_on)


def is_error(problem: FileProblem) -> bool:
    return problem.severity is Severity.ERROR


def test_waypoints_in_a_row_are_one_route_with_its_speeds_and_frames() -> None:
    speed = item(1, 178, params=(1.0, 5.0, -1.0, 0.0), frame=2)
    read = read_mission_tasks([item(0, 16, A), speed, item(2, 16, B, frame=0), item(3, 16, A)])
    (task,) = read.tasks
    assert (task.behavior, task.items) == ("single_vehicle_routing", (0, 2, 3))
    assert task.parameters["route"] == Route(
        (A, B, A), "relative", (5.0, None, None), ("relative", "amsl", "relative")
    )
    assert read.problems == ()


def test_what_a_route_has_no_place_for_is_a_task_between_two() -> None:
    read = read_mission_tasks(
        [
            item(0, 22, (None, None, 10.0)),
            item(1, 178, params=(1.0, 5.0, -1.0, 0.0), frame=2),
            item(2, 16, A, (3.0, 0.0, 0.0, None)),
            item(3, 93, params=(2.0, 0.0, 0.0, 0.0), frame=2),
            item(4, 18, B, (2.0, None, 15.0, None)),
            item(5, 2000, params=(0.0, 2.0, 3.0, None), frame=2),
            item(6, 16, (0.0, 0.0, 30.0)),
            item(7, 21, (38.2, -77.1, 0.0)),
        ]
    )
    assert [(each.behavior, each.items) for each in read.tasks] == [
        ("takeoff", (0,)),
        ("goto", (2,)),
        ("hold", (2,)),
        ("hold", (3,)),
        ("orbit", (4,)),
        ("take_picture", (5,)),
        ("goto", (6,)),
        ("goto", (7,)),
        ("land", (7,)),
    ]
    takeoff, first, wait, _, orbit, pictures, higher, before, _ = read.tasks
    assert takeoff.parameters == {"altitude": "10.0 m", "altitude_frame": "relative"}
    assert first.parameters == {"target": Point(A), "speed": "5.0 m/s"}
    assert wait.parameters == {"duration": "3.0 s"}
    assert orbit.parameters == {"target": Point(B), "radius": "15.0 m", "turns": "2"}
    assert pictures.parameters == {"count": 3, "interval": "2.0 s"} and pictures.of_payload
    # Latitude and longitude 0, 0: the place before, at another altitude.
    assert higher.parameters == {"target": Point((*B[:2], 30.0)), "speed": "5.0 m/s"}
    assert before.parameters == {"target": Point((38.2, -77.1, 30.0))}


@pytest.mark.parametrize(
    ("items", "problem"),
    [
        ([item(0, 16, A), item(1, 82, B)], "item 1: MAV_CMD_NAV_SPLINE_WAYPOINT cannot be"),
        ([item(0, 16, A), item(1, 22, B)], "item 1: a take-off comes after a waypoint"),
        ([item(0, 16, A), item(1, 93, frame=2), item(2, 22, B)], "item 1: a delay until a time"),
        ([item(0, 20), item(1, 16, A)], "item 1: MAV_CMD_NAV_WAYPOINT comes after item 0"),
        ([item(0, 17, A), item(1, 16, B)], "item 1: MAV_CMD_NAV_WAYPOINT comes after item 0"),
        ([item(0, 16, A), item(1, 177, params=(0.0, 2.0, 0.0, 0.0))], "item 1: MAV_CMD_DO_JUMP"),
        ([item(0, 16, A, frame=1)], "item 0: MAV_CMD_NAV_WAYPOINT: MAV_FRAME 1 is not"),
        ([item(0, 16, (98.0, 1.0, 2.0))], "item 0: MAV_CMD_NAV_WAYPOINT: latitude 98"),
        ([item(0, 16, A, goes_on=False)], "item 0: it does not go on by itself"),
        ([item(0, 18, A, (1.0, 0.0, -9.0, 0.0))], "item 0: circles need a radius above 0"),
        ([item(0, 18, (98.0, 1.0, 2.0), (1.0, 0.0, 9.0, 0.0))], "item 0: MAV_CMD_NAV_LOITER_TURNS"),
        ([item(0, 21, (98.0, 1.0, 2.0))], "item 0: MAV_CMD_NAV_LAND: latitude 98"),
        ([item(0, 31, A)], "item 0: MAV_CMD_NAV_LOITER_TO_ALT cannot be carried out"),
        ([item(0, 61, A)], "item 0: MAV_CMD_61, which is not known, cannot"),
    ],
)
def test_what_would_change_the_way_refuses_the_mission(
    items: list[MissionItem], problem: str
) -> None:
    errors = [each for each in read_mission_tasks(items).problems if is_error(each)]
    assert str(errors[0]).startswith(problem)


def test_what_does_not_change_the_way_is_left_out_with_its_item() -> None:
    read = read_mission_tasks(
        [item(0, 206, frame=2), item(1, 16, A, (0.0, 9.0, 0.0, None)), item(2, 16, B), item(3, 20)]
    )
    assert [each.behavior for each in read.tasks] == ["single_vehicle_routing", "return_to_launch"]
    assert [str(each) for each in read.problems] == [
        "item 0: MAV_CMD_DO_SET_CAM_TRIGG_DIST is left out",
        "item 1 (9 m): MAV_CMD_NAV_WAYPOINT: an acceptance radius is left out",
    ]


def test_fence_items_are_areas_and_mavsdks_circle_of_nothing_is_none() -> None:
    corners = [(38.0, -77.0), (38.1, -77.0), (38.1, -77.1), (38.0, -77.1)]
    items = [item(n, 5001, (*each, 0.0), (4.0, 0.0, 0.0, 0.0)) for n, each in enumerate(corners)]
    none = item(5, 5003, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0))
    around = item(6, 5004, (38.05, -77.05, 0.0), (50.0, 0.0, 0.0, 0.0))
    areas, problems = read_fence_items([*items, none, around])
    assert sorted(areas) == ["fence", "keep_out"] and problems == []
    _, problems = read_fence_items(items[:3])
    assert "a fence of 3 corners" in str(problems[0])
    _, problems = read_fence_items([item(0, 16, A)])
    assert str(problems[0]) == "item 0: is no part of a fence"


def test_rally_points_are_read_and_other_items_refused() -> None:
    points, problems = read_rally_items([item(0, 5100, A), item(1, 5100, B, frame=0)])
    assert not problems
    assert [each.position for each in points] == [A, B]
    assert [each.altitude_frame for each in points] == ["relative", "amsl"]
    bad = [item(0, 16, A), item(1, 5100, (98.0, 1.0, 2.0)), item(2, 5100, A, frame=1)]
    points, problems = read_rally_items(bad)
    assert not points
    assert [str(each) for each in problems] == [
        "item 0: is no rally point",
        "item 1: MAV_CMD_NAV_RALLY_POINT: latitude 98 is not within -90..90",
        "item 2: MAV_CMD_NAV_RALLY_POINT: MAV_FRAME 1 is not global, relative or terrain",
    ]
