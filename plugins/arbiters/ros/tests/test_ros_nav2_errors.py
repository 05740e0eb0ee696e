"""What is made of the words of missions for Nav2, and of those of Nav2 for missions."""

import math
from types import SimpleNamespace

import pytest
from m2pem_plugin_ros.drivers.nav2.errors import aborted, missed
from m2pem_plugin_ros.drivers.nav2.parameters import along
from m2pem_plugin_ros.pose import Pose


@pytest.mark.parametrize(
    ("error_code", "code", "words"),
    [
        (208, "ROUTE_BLOCKED", "no valid path (error 208)"),
        (105, "ROUTE_BLOCKED", "no progress"),
        (714, "ROUTE_BLOCKED", "obstacle behind"),
        (207, "TIMEOUT", "planner took too long"),
        (9003, "TIMEOUT", "took too long"),
        (202, "FAILED", "transform"),
        (4711, "FAILED", "unknown reason (error 4711)"),
        (0, "FAILED", "without a reason"),
    ],
)
def test_error_codes_of_nav2_become_codes_of_missions(
    error_code: int, code: str, words: str
) -> None:
    error = aborted(SimpleNamespace(error_code=error_code, error_msg=""))
    assert error.code == code
    assert words in error.reason


def test_what_nav2_says_itself_is_told() -> None:
    said = SimpleNamespace(error_code=0, error_msg=" the map is gone ")
    assert aborted(said).reason == "Nav2 aborted the goal: the map is gone"


def test_results_without_error_codes_or_messages_are_read() -> None:
    assert aborted(SimpleNamespace()).reason == "Nav2 aborted the goal, without a reason"
    assert "error 208" in aborted(SimpleNamespace(error_code=208)).reason


def test_missed_waypoints_are_counted_from_one_in_both_shapes_that_nav2_has() -> None:
    jazzy = missed([SimpleNamespace(index=1, error_code=208)])
    assert jazzy.code == "ROUTE_BLOCKED"
    assert jazzy.reason == "Nav2 did not reach waypoint 2; there is no valid path"
    later = missed([SimpleNamespace(waypoint_index=n, error_code=0) for n in (0, 2)])
    assert later.reason == "Nav2 did not reach waypoint 1, 3"


def test_places_of_a_way_point_to_the_next_and_the_last_as_the_one_before() -> None:
    places = [Pose(0.0, 0.0, 9.9), Pose(5.0, 0.0, 9.9), Pose(5.0, 5.0, 9.9), Pose(5.0, 5.0, 9.9)]
    yaws = [pose.yaw_rad for pose in along(places)]
    assert yaws == pytest.approx([0.0, math.pi / 2, math.pi / 2, math.pi / 2])
    assert along([Pose(1.0, 2.0, 9.9)]) == [Pose(1.0, 2.0, 0.0)]
