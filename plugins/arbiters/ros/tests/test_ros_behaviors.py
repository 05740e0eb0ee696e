"""What a base does for each behavior but routes."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from m2pem_plugin_ros.behaviors import Ending, RefusedError, Target
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.settings import Bounds
from ros_behaviors_bench import (
    DT_S,
    GOAL,
    LIKE_A_CAR,
    TURNS_ON_THE_SPOT,
    Dynamics,
    Place,
    Road,
    point,
    route,
)

from m2pem.api import BehaviorState, VehiclePosition

OTHER = VehiclePosition("other")
DONE = Ending(BehaviorState.SUCCEEDED)

both = pytest.mark.parametrize("bounds", [TURNS_ON_THE_SPOT, LIKE_A_CAR], ids=["spot", "car"])


def moving(speed_m_s: float, start: Place = (10.0, 0.0), yaw_rad: float = 0.0) -> object:
    """A target on a straight course, as its telemetry tells it."""
    east_m_s, north_m_s = speed_m_s * math.cos(yaw_rad), speed_m_s * math.sin(yaw_rad)

    def at(now_s: float) -> Target:
        passed_s = now_s - 100.0
        east, north = start[0] + east_m_s * passed_s, start[1] + north_m_s * passed_s
        return Target(Pose(east, north, yaw_rad), east_m_s, north_m_s)

    return at


# --- goto ---------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    place=st.tuples(st.floats(-30, 30), st.floats(-30, 30)),
    yaw=st.floats(-3.1, 3.1),
    bounds=st.sampled_from([TURNS_ON_THE_SPOT, LIKE_A_CAR]),
)
def test_goto_arrives_wherever_the_place_is(place: Place, yaw: float, bounds: Bounds) -> None:
    road = Road(bounds, Dynamics(Pose(0.0, 0.0, yaw)))
    road.begin("goto", target=point(place), tolerance=0.3)
    assert road.until_ended() == DONE
    assert road.away(place) <= 0.3 + 1e-6
    assert abs(road.body.twist.forward_m_s) < 0.1


def test_goto_turns_to_the_heading_at_the_end() -> None:
    road = Road()
    road.begin("goto", target=point((5.0, 5.0)), heading=math.radians(270.0))
    assert road.until_ended() == DONE
    assert abs(math.remainder(road.body.pose.yaw_rad - math.pi, math.tau)) < math.radians(5.0)
    assert road.away((5.0, 5.0)) <= 0.5


def test_what_cannot_turn_on_the_spot_comes_from_where_it_should_point() -> None:
    road = Road(LIKE_A_CAR)
    road.begin("goto", target=point((20.0, 10.0)), heading=0.0)
    assert road.until_ended() == DONE
    assert road.away((20.0, 10.0)) <= 0.5
    assert road.body.pose.yaw_rad == pytest.approx(math.pi / 2, abs=0.2)


def test_a_heading_at_a_vehicle_is_refused_for_what_cannot_turn_on_the_spot() -> None:
    with pytest.raises(RefusedError, match="cannot turn on the spot"):
        Road(LIKE_A_CAR).begin("goto", target=OTHER, heading=0.0)


@both
def test_goto_a_vehicle_goes_after_it_and_does_not_run_into_it(bounds: Bounds) -> None:
    road = Road(bounds)
    road.target = moving(0.8)
    road.begin("goto", target=OTHER)
    assert road.until_ended(120.0) == DONE
    target = road.target(road.now_s)
    assert target is not None
    assert 2.0 < road.away((target.pose.east_m, target.pose.north_m)) < 6.0


def test_goto_a_vehicle_that_is_not_heard_any_more_stops_and_fails() -> None:
    road = Road()
    road.target = lambda now_s: Target(Pose(50.0, 0.0, 0.0), age_s=max(0.0, now_s - 110.0))
    road.begin("goto", target=OTHER)
    ending = road.until_ended(30.0)
    assert ending.state is BehaviorState.FAILED
    assert "other has sent no position for 3 s" in ending.reason
    assert abs(road.body.twist.forward_m_s) < 0.1


def test_goto_that_comes_no_nearer_fails_and_says_how_near_it_was() -> None:
    road = Road()
    road.seen_pose = lambda _: Pose(
        6.0 + 0.5 * math.cos(road.now_s), 0.5 * math.sin(road.now_s), road.now_s
    )
    road.begin("goto", target=point((6.0, 0.0)), tolerance=0.0)
    ending = road.until_ended(100.0)
    assert ending.state is BehaviorState.FAILED
    assert "comes no nearer to its target than 0.5 m" in ending.reason


def test_goto_that_is_moved_off_while_held_goes_there_again() -> None:
    road = Road()
    road.begin("goto", target=point((6.0, 0.0)))
    road.drive(2.0)
    road.pilot.hold()
    road.drive(3.0)
    road.body.pose = Pose(-10.0, -10.0, 1.0)
    road.pilot.resume()
    assert road.until_ended() == DONE
    assert road.away((6.0, 0.0)) <= 0.5


# --- standing -----------------------------------------------------------------------------------


@both
def test_drive_stop_ends_when_it_stands(bounds: Bounds) -> None:
    road = Road(bounds)
    road.begin("single_vehicle_routing", route=route([(50.0, 0.0)]))
    road.drive(6.0)
    road.begin("drive_stop")
    road.step()
    assert road.ending is None
    assert road.until_ended(10.0) == DONE
    assert abs(road.body.twist.forward_m_s) < 0.1


def test_hold_stands_for_its_duration_not_counting_how_long_it_was_held() -> None:
    road = Road()
    road.begin("hold", duration=5.0)
    road.drive(3.0)
    road.pilot.hold()
    road.drive(20.0)
    assert road.ending is None
    road.pilot.resume()
    began_s = road.now_s
    assert road.until_ended() == DONE
    assert road.now_s - began_s == pytest.approx(2.0, abs=0.2)


def test_a_base_that_does_not_stop_is_not_said_to_stand() -> None:
    road = Road()
    road.begin("goto", target=point((90.0, 0.0)))
    road.drive(4.0)
    road.body.lag_s = 1e9
    road.pilot.end(GOAL)
    ending = road.until_ended(20.0)
    assert (ending.state, ending.code) == (BehaviorState.FAILED, "TIMEOUT")


def test_after_an_end_zero_is_said_for_a_while_and_then_nothing() -> None:
    road = Road()
    road.begin("goto", target=point((90.0, 0.0)))
    road.drive(4.0)
    road.pilot.end(GOAL)
    assert road.until_ended().state is BehaviorState.CANCELLED
    assert road.step().twist == Twist()
    road.drive(3.0)
    assert road.step().twist is None
    assert not road.pilot.busy


def test_a_stop_slows_down_as_the_base_can() -> None:
    road = Road()
    road.begin("goto", target=point((90.0, 0.0)))
    road.drive(4.0)
    road.pilot.hold()
    road.step()
    assert road.commands[-1].forward_m_s == pytest.approx(2.0 - 1.0 * DT_S)


# --- reverse ------------------------------------------------------------------------------------


@both
@pytest.mark.parametrize("yaw_rad", [0.0, 2.0])
def test_reverse_goes_straight_back_and_no_farther(bounds: Bounds, yaw_rad: float) -> None:
    road = Road(bounds, Dynamics(Pose(3.0, 4.0, yaw_rad)))
    road.begin("reverse", distance=6.0, speed=0.8)
    assert road.until_ended() == DONE
    place = (3.0 - 6.0 * math.cos(yaw_rad), 4.0 - 6.0 * math.sin(yaw_rad))
    assert road.away(place) < 0.2
    assert road.body.pose.yaw_rad == pytest.approx(yaw_rad, abs=0.05)
    assert min(command.forward_m_s for command in road.commands) >= -0.8 - 1e-9


@both
def test_reverse_keeps_to_its_line_when_it_is_pushed_off(bounds: Bounds) -> None:
    road = Road(bounds)
    road.begin("reverse", distance=15.0)
    road.drive(3.0)
    pose = road.body.pose
    road.body.pose = Pose(pose.east_m, pose.north_m + 0.4, pose.yaw_rad + 0.15)
    assert road.until_ended() == DONE
    assert road.away((-15.0, 0.0)) < 0.35


def test_reverse_of_no_distance_does_not_move() -> None:
    road = Road()
    road.begin("reverse", distance=0.0)
    assert road.until_ended(2.0) == DONE
    assert road.away((0.0, 0.0)) < 1e-6


# --- teleop -------------------------------------------------------------------------------------


def test_teleop_does_what_the_stick_says_within_the_bounds() -> None:
    road = Road(LIKE_A_CAR)
    road.begin("teleop")
    road.joystick = Twist(9.0, 5.0)
    road.drive(6.0)
    assert road.commands[-1].forward_m_s == pytest.approx(3.0)
    assert road.commands[-1].yaw_rad_s == pytest.approx(0.5)  # by lateral acceleration
    road.joystick = Twist(-9.0, 0.0)
    road.drive(8.0)
    assert road.commands[-1].forward_m_s == pytest.approx(-1.0)


def test_teleop_turns_on_the_spot_as_the_stick_says() -> None:
    road = Road()
    road.begin("teleop")
    road.joystick = Twist(0.0, 0.4)
    road.drive(1.0)
    assert road.commands[-1] == Twist(0.0, 0.4)


def test_teleop_without_the_stick_stands_and_does_not_end() -> None:
    road = Road()
    road.begin("teleop")
    road.joystick = Twist(1.0, 0.0)
    road.drive(3.0)
    road.joystick_age_s = 0.6
    road.drive(2.0)
    assert road.commands[-1] == Twist()
    road.drive(60.0)
    assert road.ending is None


def test_teleop_ends_after_its_timeout() -> None:
    road = Road()
    road.begin("teleop", timeout=5.0)
    road.joystick = Twist(1.0, 0.0)
    assert road.until_ended(10.0) == DONE
    assert abs(road.body.twist.forward_m_s) < 0.1


# --- follow -------------------------------------------------------------------------------------


@both
@pytest.mark.parametrize("yaw_rad", [0.0, 1.5, 3.0])
def test_follow_keeps_its_station_behind_a_vehicle_that_moves(
    bounds: Bounds, yaw_rad: float
) -> None:
    road = Road(bounds)
    road.target = moving(1.2, (10.0, 5.0), yaw_rad)
    road.begin("follow", target=OTHER, offset=8.0)
    road.drive(90.0)
    target = road.target(road.now_s)
    assert target is not None
    station = (
        target.pose.east_m - 8.0 * math.cos(yaw_rad),
        target.pose.north_m - 8.0 * math.sin(yaw_rad),
    )
    assert road.away(station) < 0.8
    assert road.commands[-1].forward_m_s == pytest.approx(1.2, abs=0.1)
    assert road.ending is None


def test_follow_abeam_by_bearing_and_the_station_can_be_changed() -> None:
    road = Road()
    road.target = moving(1.0)
    road.begin("follow", target=OTHER, offset=6.0, bearing=math.pi / 2)
    road.drive(60.0)
    target = road.target(road.now_s)
    assert target is not None
    assert road.away((target.pose.east_m, -6.0)) < 0.8
    road.pilot.adjust(road.local({"offset": 10.0}))
    road.drive(60.0)
    assert road.body.pose.north_m == pytest.approx(-10.0, abs=0.8)


def test_follow_stands_when_its_target_does_and_goes_on_with_it() -> None:
    road = Road()
    road.target = lambda _: Target(Pose(20.0, 0.0, 0.0))
    road.begin("follow", target=OTHER, offset=5.0)
    road.drive(40.0)
    assert road.away((15.0, 0.0)) < 1.5
    assert abs(road.body.twist.forward_m_s) < 0.05
    road.drive(120.0)
    assert road.ending is None
    road.target = lambda _: Target(Pose(40.0, 0.0, 0.0))
    road.drive(40.0)
    assert road.away((35.0, 0.0)) < 1.5


def test_follow_does_not_run_into_a_target_whatever_the_offset() -> None:
    road = Road()
    road.target = lambda _: Target(Pose(20.0, 0.0, 0.0))
    road.begin("follow", target=OTHER, offset=0.0)
    road.drive(60.0)
    assert min(math.dist((p.east_m, p.north_m), (20.0, 0.0)) for p in road.driven) > 1.0


def test_follow_of_who_is_not_heard_any_more_fails() -> None:
    road = Road()
    road.begin("follow", target=OTHER)
    assert "has sent no position" in road.until_ended(2.0).reason


def test_follow_needs_another_vehicle() -> None:
    with pytest.raises(RefusedError, match="another vehicle"):
        Road().begin("follow", target=VehiclePosition("self"))
