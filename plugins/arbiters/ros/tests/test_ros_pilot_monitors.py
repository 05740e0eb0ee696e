"""What the pilot makes of poses that are old, that are no numbers, or that cannot be."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from m2pem_plugin_ros.behaviors import LocalParameters, Observation, Pilot, make_motion
from m2pem_plugin_ros.behaviors.monitors import IGNORED
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.settings import Bounds
from ros_behaviors_bench import DT_S, GOAL, LIKE_A_CAR, TURNS_ON_THE_SPOT, Road, point, route

from m2pem.api import BehaviorState

numbers = st.floats(allow_nan=True, allow_infinity=True)
poses = st.none() | st.builds(Pose, numbers, numbers, numbers)
twists = st.none() | st.builds(Twist, numbers, numbers)


def driving() -> Road:
    road = Road()
    road.begin("single_vehicle_routing", route=route([(40.0, 0.0), (40.0, 40.0)]))
    road.drive(6.0)
    assert road.commands[-1].forward_m_s > 1.5
    return road


def test_old_odometry_stops_the_base_within_one_step() -> None:
    road = driving()
    road.age_s = 0.51
    road.step()
    assert road.commands[-1] == Twist()


def test_odometry_that_comes_again_lets_it_go_on_from_a_stand() -> None:
    road = driving()
    road.age_s = 5.0
    road.drive(3.0)
    assert road.ending is None
    road.age_s = 0.0
    road.step()
    assert 0 < road.commands[-1].forward_m_s <= road.bounds.acceleration_m_s2 * DT_S + 1e-9
    assert road.until_ended().state is BehaviorState.SUCCEEDED


def test_time_without_odometry_is_no_time_of_being_stuck() -> None:
    road = driving()
    road.age_s = math.inf
    road.drive(60.0)
    assert road.ending is None


@pytest.mark.parametrize("age_s", [math.nan, math.inf])
def test_an_age_that_is_no_number_counts_as_old(age_s: float) -> None:
    road = driving()
    road.age_s = age_s
    seen = Observation(road.now_s + DT_S, road.body.pose, road.body.twist, age_s)
    assert road.pilot.step(seen).twist == Twist()


def test_no_pose_is_no_reason_to_drive() -> None:
    road = driving()
    seen = Observation(road.now_s + DT_S, None, road.body.twist)
    assert road.pilot.step(seen).twist == Twist()


@pytest.mark.parametrize("field", ["east_m", "north_m", "yaw_rad"])
def test_a_pose_that_is_no_number_stops_the_base(field: str) -> None:
    road = driving()
    pose = replace(road.body.pose, **{field: math.nan})
    assert road.pilot.step(Observation(road.now_s + DT_S, pose, road.body.twist)).twist == Twist()


@settings(max_examples=100, deadline=None)
@given(
    seen=st.lists(st.tuples(poses, twists, twists, numbers, numbers), min_size=1, max_size=30),
    behavior=st.sampled_from(["single_vehicle_routing", "goto", "reverse", "teleop", "hold"]),
    bounds=st.sampled_from([TURNS_ON_THE_SPOT, LIKE_A_CAR]),
)
def test_whatever_is_seen_commands_are_numbers_within_the_bounds(
    seen: list[tuple[Pose | None, Twist | None, Twist | None, float, float]],
    behavior: str,
    bounds: Bounds,
) -> None:
    parameters = {"route": route([(9.0, 3.0), (0.0, 9.0)]), "target": point((5.0, -5.0))}
    local = LocalParameters(parameters, lambda east, north: (east, north), "self")
    pilot = Pilot(bounds)
    pilot.begin(GOAL, make_motion(behavior, local, bounds))
    for number, (pose, twist, joystick, age_s, joystick_age_s) in enumerate(seen):
        step = pilot.step(
            Observation(number * DT_S, pose, twist, age_s, None, joystick, joystick_age_s)
        )
        command = step.twist or Twist()
        assert -bounds.reverse_m_s <= command.forward_m_s <= bounds.speed_m_s
        assert abs(command.yaw_rad_s) <= bounds.yaw_rate_rad_s
        if bounds.turn_radius_m:
            assert abs(command.yaw_rad_s) * bounds.turn_radius_m <= abs(command.forward_m_s) + 1e-9


def test_a_few_poses_that_cannot_be_are_ignored() -> None:
    road = driving()
    before = road.commands[-1]
    road.seen_pose = lambda pose: replace(pose, east_m=pose.east_m + 100.0, yaw_rad=3.0)
    road.drive(IGNORED * DT_S)
    assert road.commands[-1].yaw_rad_s == pytest.approx(before.yaw_rad_s, abs=0.05)
    assert road.commands[-1].forward_m_s > 1.5
    road.seen_pose = lambda pose: pose
    assert road.until_ended().state is BehaviorState.SUCCEEDED
    assert max(abs(pose.north_m) for pose in road.driven if pose.east_m < 38) < 0.5


def test_a_jump_that_stays_is_believed_and_the_route_found_again_near_by() -> None:
    road = driving()
    place = road.body.pose
    road.body.pose = replace(place, north_m=place.north_m + 4.0)
    road.drive((IGNORED + 1) * DT_S)
    assert road.until_ended().state is BehaviorState.SUCCEEDED
    corner = [pose for pose in road.driven if math.dist((pose.east_m, pose.north_m), (40, 0)) < 1]
    assert corner, "the corner that lay ahead was driven to all the same"


def test_nothing_ends_by_a_pose_that_is_in_doubt() -> None:
    road = Road()
    road.drive(1.0)
    road.seen_pose = lambda pose: replace(pose, east_m=pose.east_m - 30.0)
    road.begin("goto", target=point((0.0, 0.0)))
    road.drive(1.0)
    assert road.ending is None


def test_a_pose_that_is_heard_once_is_one_pose_however_often_it_is_seen() -> None:
    road = driving()
    jumped = replace(road.body.pose, east_m=road.body.pose.east_m + 50.0)
    received_s = road.now_s
    for number in range(1, 9):  # one odd message, looked at eight times
        now_s = received_s + number * DT_S
        step = road.pilot.step(
            Observation(now_s, jumped, road.body.twist, now_s - received_s - DT_S)
        )
        assert step.twist is not None
        assert step.twist.forward_m_s > 1.0
