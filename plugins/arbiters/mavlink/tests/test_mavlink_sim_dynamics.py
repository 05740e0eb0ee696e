import math

import pytest
from m2pem_plugin_mavlink.simulator.dynamics import (
    BodyState,
    CircleSetpoint,
    MotionSetpoint,
    NoThrust,
    PositionSetpoint,
    VelocitySetpoint,
    dynamics_of,
)
from m2pem_plugin_mavlink.simulator.geometry import Point
from m2pem_plugin_mavlink.simulator.specification import Kind

DT_S = 0.02


def move(
    kind: Kind, body: BodyState, demand: MotionSetpoint, seconds: float, dt_s: float = DT_S
) -> list[BodyState]:
    """The body after each step."""
    kinematics, track = dynamics_of(kind), []
    for _ in range(round(seconds / dt_s)):
        kinematics.step(body, demand, dt_s)
        track.append(BodyState(**{name: getattr(body, name) for name in BodyState.__slots__}))
    return track


@pytest.mark.parametrize("dt_s", [0.01, 0.05, 0.1])
def test_a_copter_reaches_a_place_without_passing_it_by_much(dt_s: float) -> None:
    body = BodyState(up_m=20, on_ground=False)
    track = move(Kind.COPTER, body, PositionSetpoint(Point(60, 0, 30), 10), 25, dt_s)
    assert body.point == pytest.approx((60, 0, 30), abs=0.2)
    assert max(each.north_m for each in track) < 60.5
    assert max(each.ground_speed_mps for each in track) == pytest.approx(10, abs=0.2)


def test_a_copter_gathers_speed_within_its_limits_and_leans() -> None:
    body = BodyState(up_m=20, on_ground=False)
    track = move(Kind.COPTER, body, VelocitySetpoint(8, 0), 2)
    assert track[49].north_mps == pytest.approx(3, abs=0.1)
    assert track[49].pitch_rad < -0.2


def test_a_copter_without_thrust_comes_down_and_stays() -> None:
    body = BodyState(up_m=20, north_mps=5, on_ground=False)
    move(Kind.COPTER, body, NoThrust(), 10)
    assert (body.up_m, body.on_ground, body.moving) == (0, True, False)


@pytest.mark.parametrize("radius_m", [15.0, -15.0])
@pytest.mark.parametrize("kind", [Kind.COPTER, Kind.ROVER])
def test_a_circle_is_gone_around_in_its_direction(kind: Kind, radius_m: float) -> None:
    body = BodyState(up_m=20 if kind is Kind.COPTER else 0, on_ground=kind is Kind.ROVER)
    center = Point(30, 0, body.up_m)
    move(kind, body, CircleSetpoint(center, radius_m, 3), 30)
    before = center.bearing_rad(body.point)
    track = move(kind, body, CircleSetpoint(center, radius_m, 3), 2)
    assert all(abs(each.point.distance_m(center) - 15) < 1 for each in track)
    turned = math.remainder(center.bearing_rad(body.point) - before, math.tau)
    assert math.copysign(1, turned) == math.copysign(1, radius_m)
    assert abs(turned) == pytest.approx(0.4, abs=0.15)


def test_a_rover_turns_in_curves() -> None:
    body = BodyState()
    track = move(Kind.ROVER, body, PositionSetpoint(Point(0, 20, 0), 2), 25)
    assert body.point == pytest.approx((0, 20, 0), abs=0.5)
    assert track[5].ground_speed_mps < 0.5
    for each in track:
        # It goes where it looks.
        sideways = -each.north_mps * math.sin(each.yaw_rad) + each.east_mps * math.cos(each.yaw_rad)
        assert abs(sideways) < 1e-6


def test_a_rover_goes_backwards_to_a_place_behind_it() -> None:
    body = BodyState()
    track = move(Kind.ROVER, body, PositionSetpoint(Point(-15, 0, 0), 2, reverse=True), 20)
    assert body.point == pytest.approx((-15, 0, 0), abs=0.5)
    assert all(abs(each.yaw_rad) < 0.05 for each in track)


def test_a_plane_rolls_before_it_lifts_off_and_never_stands_in_the_air() -> None:
    body = BodyState()
    track = move(Kind.PLANE, body, PositionSetpoint(Point(2000, 0, 60), 22), 30)
    lift_off = next(each for each in track if not each.on_ground)
    assert lift_off.ground_speed_mps >= 12
    assert body.up_m == pytest.approx(60, abs=1)
    track = move(Kind.PLANE, body, NoThrust(), 20)
    assert min(each.ground_speed_mps for each in track) >= 12


def test_a_plane_banks_within_its_limit_and_keeps_its_circle() -> None:
    body = BodyState(up_m=80, north_mps=22, on_ground=False)
    center = Point(300, 200, 80)
    track = move(Kind.PLANE, body, CircleSetpoint(center, 80, 22), 60)
    assert max(abs(each.roll_rad) for each in track) <= math.radians(45) + 1e-9
    assert all(abs(each.point.distance_m(center) - 80) < 5 for each in track[-500:])
    assert body.roll_rad > 0.2


def test_a_plane_without_thrust_glides_down_and_rolls_out() -> None:
    body = BodyState(up_m=10, north_mps=20, on_ground=False)
    move(Kind.PLANE, body, NoThrust(), 20)
    assert body.on_ground
    assert not body.moving
