"""How a simulated base moves: within its limits, and no longer than commands come."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.simulator.dynamics import STANDS_M_S, Chassis, Dynamics

STEP_S = 0.02
EPSILON = 1e-9

speeds = st.floats(-20, 20)
commands = st.lists(st.tuples(speeds, speeds, st.integers(1, 60)), min_size=1, max_size=12)
chassis = st.builds(
    Chassis,
    speed_m_s=st.floats(0.1, 15),
    reverse_m_s=st.floats(0, 5),
    acceleration_m_s2=st.floats(0.1, 5),
    yaw_rate_rad_s=st.floats(0.1, 3),
    yaw_acceleration_rad_s2=st.floats(0.1, 5),
    turn_radius_m=st.sampled_from([0.0, 0.5, 8.0]),
    lag_s=st.floats(0, 1),
)


def driven(body: Dynamics, twist: Twist, seconds: float, now_s: float = 0.0) -> float:
    """Command it again and again; returns the time then."""
    for _ in range(round(seconds / STEP_S)):
        now_s += STEP_S
        body.command(twist, now_s)
        body.step(now_s, STEP_S)
    return now_s


@given(chassis, commands)
def test_no_limit_is_ever_exceeded(
    chassis: Chassis, commands: list[tuple[float, float, int]]
) -> None:
    body, now_s = Dynamics(chassis, Pose(0, 0, 0)), 0.0
    for forward, yaw, steps in commands:
        for _ in range(steps):
            now_s += STEP_S
            before, stood = body.twist, body.pose
            body.command(Twist(forward, yaw), now_s)
            body.step(now_s, STEP_S)
            after = body.twist
            assert -chassis.reverse_m_s - EPSILON <= after.forward_m_s
            assert after.forward_m_s <= chassis.speed_m_s + EPSILON
            assert abs(after.yaw_rad_s) <= chassis.yaw_rate_rad_s + EPSILON
            change = abs(after.forward_m_s - before.forward_m_s)
            assert change <= chassis.acceleration_m_s2 * STEP_S + 2 * STANDS_M_S
            if chassis.turn_radius_m:
                bend = chassis.turn_radius_m * abs(after.yaw_rad_s)
                assert bend <= abs(after.forward_m_s) + EPSILON
            way = math.hypot(body.pose.east_m - stood.east_m, body.pose.north_m - stood.north_m)
            fastest = max(abs(before.forward_m_s), abs(after.forward_m_s))
            assert way <= (fastest + STANDS_M_S) * STEP_S
            assert -math.pi <= body.pose.yaw_rad <= math.pi


@given(chassis, speeds, speeds)
def test_without_commands_it_comes_to_a_stand(chassis: Chassis, forward: float, yaw: float) -> None:
    body = Dynamics(chassis, Pose(0, 0, 0))
    now_s = driven(body, Twist(forward, yaw), 2.0)
    slow_s = max(
        max(chassis.speed_m_s, chassis.reverse_m_s) / chassis.acceleration_m_s2,
        chassis.yaw_rate_rad_s / chassis.yaw_acceleration_rad_s2,
    )
    for _ in range(round((chassis.command_timeout_s + slow_s + 20 * chassis.lag_s + 1) / STEP_S)):
        now_s += STEP_S
        body.step(now_s, STEP_S)
    assert body.stands
    assert body.twist == Twist()


def test_a_base_drives_as_far_as_speed_and_acceleration_say() -> None:
    body = Dynamics(Chassis(lag_s=0.0), Pose(0, 0, 0))
    driven(body, Twist(2.0), 6.0)
    assert body.twist.forward_m_s == pytest.approx(2.0)
    assert body.pose.east_m == pytest.approx(2 * 6 - 2.0, abs=0.05)  # 2 s from 0 to 2 m/s
    assert body.pose.north_m == 0
    assert body.driven_m == pytest.approx(body.pose.east_m)


def test_a_base_drives_a_circle() -> None:
    body = Dynamics(
        Chassis(lag_s=0.0, acceleration_m_s2=100, yaw_acceleration_rad_s2=100), Pose(0, 0, 0)
    )
    driven(body, Twist(1.0, 0.5), 4 * math.pi)
    assert math.hypot(body.pose.east_m, body.pose.north_m) < 0.05
    assert body.driven_m == pytest.approx(4 * math.pi, abs=0.05)


def test_steered_wheels_do_not_turn_on_the_spot() -> None:
    body = Dynamics(Chassis(turn_radius_m=3.0), Pose(0, 0, 0))
    driven(body, Twist(0.0, 1.0), 2.0)
    assert body.pose == Pose(0, 0, 0)
    assert body.motions == 0


def test_lag_delays_what_is_commanded() -> None:
    quick, slow = (
        Dynamics(Chassis(lag_s=lag_s, acceleration_m_s2=100), Pose(0, 0, 0)) for lag_s in (0.0, 1.0)
    )
    driven(quick, Twist(1.0), 1.0)
    driven(slow, Twist(1.0), 1.0)
    assert quick.twist.forward_m_s == pytest.approx(1.0)
    assert slow.twist.forward_m_s == pytest.approx(1 - math.exp(-1), abs=0.01)


def test_stuck_wheels_go_nowhere_until_they_are_free() -> None:
    body = Dynamics(Chassis(), Pose(0, 0, 0))
    now_s = driven(body, Twist(1.0), 2.0)
    body.stuck = True
    now_s = driven(body, Twist(1.0), 3.0, now_s)
    assert body.twist == Twist()
    stuck_at = body.pose
    now_s = driven(body, Twist(1.0), 1.0, now_s)
    assert body.pose == stuck_at
    body.stuck = False
    driven(body, Twist(1.0), 1.0, now_s)
    assert body.pose.east_m > stuck_at.east_m


def test_a_motion_is_counted_from_stand_to_stand() -> None:
    body = Dynamics(Chassis(), Pose(0, 0, 0))
    now_s = driven(body, Twist(1.0), 2.0)
    now_s = driven(body, Twist(-0.5, 0.3), 2.0, now_s)
    assert body.motions == 1
    now_s = driven(body, Twist(), 5.0, now_s)
    assert body.stands
    driven(body, Twist(0.0, 0.5), 1.0, now_s)
    assert body.motions == 2


@pytest.mark.parametrize("nonsense", [math.nan, math.inf, -math.inf])
def test_commands_that_are_no_numbers_are_not_heard(nonsense: float) -> None:
    body = Dynamics(Chassis(), Pose(0, 0, 0))
    driven(body, Twist(nonsense, 0.0), 1.0)
    driven(body, Twist(0.0, nonsense), 1.0)
    assert body.pose == Pose(0, 0, 0)
