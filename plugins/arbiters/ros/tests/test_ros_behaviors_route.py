"""Routes: how near the pilot keeps to them, how it ends them, and that it skips nothing."""

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from m2pem_plugin_ros.behaviors import Ending, RefusedError
from m2pem_plugin_ros.behaviors.route import SingleVehicleRouting
from m2pem_plugin_ros.behaviors.steering import lookahead
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.settings import Bounds
from ros_behaviors_bench import (
    DT_S,
    LIKE_A_CAR,
    TURNS_ON_THE_SPOT,
    Dynamics,
    Place,
    Road,
    off_path,
    route,
)

from m2pem.api import BehaviorState

SQUARE = [(10.0, 0.0), (10.0, 10.0), (0.0, 10.0), (0.0, 0.5)]
FIGURE_EIGHT = [(20.0, 20.0), (20.0, 0.0), (0.0, 20.0), (0.0, 1.0)]
TOLERANCE_M = 0.5

places = st.tuples(st.floats(-40.0, 40.0), st.floats(-40.0, 40.0))
routes = st.lists(places, min_size=1, max_size=6)


def progress(road: Road) -> float:
    motion = road.pilot.motion
    return motion.driven_m if isinstance(motion, SingleVehicleRouting) else math.nan


def drive(road: Road, waypoints: list[Place], **parameters: float) -> list[float]:
    """Drive a route to its end; returns the progress at each step."""
    driven: list[float] = []
    road.begin("single_vehicle_routing", route=route(waypoints), **parameters)

    def ended() -> bool:
        if not math.isnan(progress(road)):
            driven.append(progress(road))
        return road.ending is not None

    road.until(ended, 1200.0)
    return driven


def farthest_off(road: Road, waypoints: list[Place]) -> float:
    path = [(0.0, 0.0), *waypoints]
    path = [b for a, b in zip([(math.inf, 0.0), *path], path, strict=False) if math.dist(a, b) > 0]
    return max(off_path((pose.east_m, pose.north_m), path) for pose in road.driven)


@settings(max_examples=40, deadline=None)
@given(waypoints=routes, yaw=st.floats(-3.1, 3.1))
def test_who_turns_on_the_spot_keeps_within_a_third_of_its_lookahead_of_the_route(
    waypoints: list[Place], yaw: float
) -> None:
    waypoints = [place for place in waypoints if math.hypot(*place) > 0.1] or [(9.0, 9.0)]
    road = Road(TURNS_ON_THE_SPOT, Dynamics(Pose(0.0, 0.0, yaw)))
    driven = drive(road, waypoints)
    assert road.ending == Ending(BehaviorState.SUCCEEDED)
    assert road.away(waypoints[-1]) <= TOLERANCE_M
    # Up to 0.15 m more at a sharp corner soon after the start.
    assert farthest_off(road, waypoints) <= lookahead(road.bounds, road.bounds.speed_m_s) / 3 + 0.2
    assert driven == sorted(driven)


@settings(max_examples=40, deadline=None)
@given(waypoints=routes, yaw=st.floats(-3.1, 3.1))
def test_who_has_a_turning_circle_keeps_within_two_circles_and_ends_where_it_should(
    waypoints: list[Place], yaw: float
) -> None:
    waypoints = [place for place in waypoints if math.hypot(*place) > 0.1] or [(9.0, 9.0)]
    road = Road(LIKE_A_CAR, Dynamics(Pose(0.0, 0.0, yaw)))
    driven = drive(road, waypoints)
    assert road.ending == Ending(BehaviorState.SUCCEEDED)
    assert road.away(waypoints[-1]) <= TOLERANCE_M
    assert farthest_off(road, waypoints) <= 4 * LIKE_A_CAR.turn_radius_m
    assert driven == sorted(driven)


@pytest.mark.parametrize("bounds", [TURNS_ON_THE_SPOT, LIKE_A_CAR], ids=["spot", "car"])
def test_where_a_route_crosses_itself_nothing_is_skipped(bounds: Bounds) -> None:
    road = Road(bounds)
    driven = drive(road, FIGURE_EIGHT)
    steps = [after - before for before, after in pairwise(driven)]
    # A corner that is cut is shorter than the route, by less than a lookahead.
    assert max(steps) <= lookahead(bounds, bounds.speed_m_s)
    length = sum(
        math.dist(a, b) for a, b in zip([(0.0, 0.0), *FIGURE_EIGHT], FIGURE_EIGHT, strict=False)
    )
    assert driven[-1] == pytest.approx(length, abs=0.2)
    assert road.now_s - 100.0 > 0.8 * length / bounds.speed_m_s


def test_out_and_back_reaches_the_far_end() -> None:
    road = Road()
    drive(road, [(20.0, 0.0), (0.0, 0.0)])
    assert max(pose.east_m for pose in road.driven) > 19.8
    assert road.away((0.0, 0.0)) <= TOLERANCE_M


def test_loop_goes_round_again_and_again() -> None:
    road = Road()
    road.begin("single_vehicle_routing", route=route(SQUARE), loop=True)
    passes = 0
    for _ in range(3):
        road.until(lambda: road.away((10.0, 10.0)) < 0.3, 120.0)
        road.until(lambda: road.away((0.0, 10.0)) < 0.3, 120.0)
        road.until(lambda: road.away((10.0, 0.0)) < 0.3, 120.0)
        passes += 1
    assert passes == 3
    assert road.ending is None
    assert 2 * 39.5 < progress(road) < 3.5 * 39.5 + 10


def test_a_loop_without_sharp_corners_is_driven_without_a_stop() -> None:
    octagon = [
        (15.0 * math.sin(k * math.pi / 6), 15.0 - 15.0 * math.cos(k * math.pi / 6))
        for k in range(12)
    ]
    road = Road(LIKE_A_CAR)
    road.begin("single_vehicle_routing", route=route(octagon), loop=True)
    road.drive(20.0)
    before = len(road.commands)
    road.drive(80.0)
    assert min(command.forward_m_s for command in road.commands[before:]) > 0.5
    assert progress(road) > 100.0
    circle = [*octagon, octagon[0]]
    assert max(off_path((p.east_m, p.north_m), circle) for p in road.driven[before:]) < 1.5


def test_a_loop_of_one_place_is_refused() -> None:
    with pytest.raises(RefusedError, match="cannot be repeated"):
        Road().begin("single_vehicle_routing", route=route([(3.0, 3.0), (3.0, 3.0)]), loop=True)


def test_a_route_without_waypoints_is_refused() -> None:
    with pytest.raises(RefusedError, match="'route'"):
        Road().begin("single_vehicle_routing", route=route([]))


def test_who_stands_near_the_first_waypoint_does_not_drive_back_to_it() -> None:
    road = Road(body=Dynamics(Pose(1.0, 0.3, 0.0)))
    drive(road, [(0.0, 0.0), (10.0, 0.0)])
    assert min(pose.east_m for pose in road.driven) > 0.9


def test_who_stands_at_the_end_of_a_route_drives_it_from_its_beginning() -> None:
    road = Road(body=Dynamics(Pose(10.0, 0.0, 0.0)))
    drive(road, [(0.0, 0.0), (10.0, 0.0)])
    assert min(pose.east_m for pose in road.driven) < 0.3
    assert road.away((10.0, 0.0)) <= TOLERANCE_M


def test_a_waypoint_within_the_turning_circle_is_passed_not_circled() -> None:
    road = Road(LIKE_A_CAR)
    drive(road, [(0.0, 1.5), (0.5, -1.5), (25.0, 0.0)])
    assert road.ending == Ending(BehaviorState.SUCCEEDED)
    assert road.now_s - 100.0 < 90.0


def test_speed_is_kept_and_can_be_changed_on_the_way() -> None:
    road = Road()
    road.begin("single_vehicle_routing", route=route([(60.0, 0.0)]), speed=0.7)
    road.drive(10.0)
    assert road.commands[-1].forward_m_s == pytest.approx(0.7)
    road.pilot.adjust(road.local({"speed": 1.2}))
    road.drive(3.0)
    assert road.commands[-1].forward_m_s == pytest.approx(1.2)
    road.pilot.adjust(road.local({"speed": 99.0}))
    road.drive(3.0)
    assert road.commands[-1].forward_m_s == pytest.approx(road.bounds.speed_m_s)


def test_resume_goes_on_where_hold_has_stopped() -> None:
    road = Road()
    road.begin("single_vehicle_routing", route=route(SQUARE))
    road.until(lambda: progress(road) > 15.0)
    road.pilot.hold()
    road.drive(5.0)
    held = progress(road)
    assert road.body.twist.forward_m_s == pytest.approx(0.0, abs=1e-3)
    assert road.commands[-1] == Twist()
    road.pilot.resume()
    road.drive(DT_S)
    assert held <= progress(road) < held + 3.0
    assert road.until_ended() == Ending(BehaviorState.SUCCEEDED)


def test_moved_by_hand_while_held_it_goes_on_at_the_nearest_point_of_the_route() -> None:
    road = Road()
    road.begin("single_vehicle_routing", route=route([(40.0, 0.0), (40.0, 20.0)]))
    road.until(lambda: progress(road) > 25.0)
    road.pilot.hold()
    road.drive(4.0)
    road.body.pose = Pose(10.0, 3.0, 0.0)
    road.pilot.resume()
    road.drive(0.2)
    assert progress(road) == pytest.approx(10.0, abs=1.0)
    assert road.until_ended() == Ending(BehaviorState.SUCCEEDED)


def test_a_stuck_base_fails_and_is_not_pushed_any_more() -> None:
    road = Road()
    road.begin("single_vehicle_routing", route=route([(40.0, 0.0)]))
    road.drive(5.0)
    road.body.stuck = True
    ending = road.until_ended(30.0)
    assert (ending.state, ending.code) == (BehaviorState.FAILED, "ROUTE_BLOCKED")
    assert road.commands[-1] == Twist()


def test_a_base_that_creeps_by_order_is_not_stuck() -> None:
    road = Road()
    road.begin("single_vehicle_routing", route=route([(5.0, 0.0)]), speed=0.01)
    road.drive(60.0)
    assert road.ending is None
    assert road.body.pose.east_m == pytest.approx(0.6, abs=0.05)


def test_a_held_base_is_not_stuck() -> None:
    road = Road()
    road.begin("single_vehicle_routing", route=route([(40.0, 0.0)]))
    road.drive(2.0)
    road.pilot.hold()
    road.drive(60.0)
    assert road.ending is None
