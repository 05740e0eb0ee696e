"""The gimbal of a simulated vehicle."""

import math

import pytest
from m2pem_plugin_mavlink.simulator.gimbal import Gimbal
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_bench import Bench
from mavlink_px4_bench import Px4Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect

PITCH_YAW, CONFIGURE = (
    dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
    dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE,
)
INFORMATION, STATUS, ATTITUDE = 280, 281, 285
NAN = math.nan
LOCK = 16


def angles(bench: Bench) -> tuple[float, float]:
    """Pitch and yaw as told, in degrees."""
    w, x, y, z = bench.report(ATTITUDE).q
    pitch = math.asin(2 * (w * y - z * x))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return math.degrees(pitch), math.degrees(yaw)


def test_the_autopilot_tells_of_the_manager_and_of_the_device() -> None:
    bench = Bench()
    information = bench.report(INFORMATION)
    assert information.gimbal_device_id == 1
    assert math.degrees(information.pitch_min) == pytest.approx(-90)
    assert math.degrees(information.pitch_max) == pytest.approx(25)
    assert bench.report(STATUS).primary_control_sysid == 0
    assert bench.report(ATTITUDE).get_srcComponent() == 1


def test_its_attitude_is_told_only_when_it_is_asked_for() -> None:
    bench = Bench()
    bench.run(10)
    assert not [each for each in bench.received if each.get_msgId() == ATTITUDE]
    assert bench.command(511, ATTITUDE, 200_000) == 0
    bench.run(2)
    assert len([each for each in bench.received if each.get_msgId() == ATTITUDE]) >= 9


def test_a_simulated_gimbal_turns_no_faster_than_it_can() -> None:
    bench = Bench()
    assert bench.command(PITCH_YAW, -60, 90, NAN, NAN, 0) == 0
    bench.run(0.5)
    assert angles(bench) == pytest.approx((-30, 30), abs=2)
    bench.run(2)
    assert angles(bench) == pytest.approx((-60, 90), abs=0.5)


def test_a_simulated_gimbal_stops_at_its_limits() -> None:
    bench = Bench()
    assert bench.command(PITCH_YAW, 80, 179, NAN, NAN, 0) == 0
    bench.run(5)
    assert angles(bench) == pytest.approx((25, 160), abs=0.5)


def test_with_rates_it_turns_on_until_something_else_is_asked_for() -> None:
    bench = Bench()
    assert bench.command(PITCH_YAW, NAN, NAN, -5, 10, 0) == 0
    bench.run(3)
    assert angles(bench) == pytest.approx((-15, 30), abs=1.5)
    assert bench.command(PITCH_YAW, -10, 0, NAN, NAN, 0) == 0
    bench.run(3)
    assert angles(bench) == pytest.approx((-10, 0), abs=0.5)


@pytest.mark.parametrize(("flags", "from_north"), [(0, 60.0), (LOCK, 20.0)])
def test_yaw_follows_the_vehicle_unless_it_is_locked(flags: int, from_north: float) -> None:
    bench = Bench().airborne()
    assert bench.command(PITCH_YAW, 0, 20, NAN, NAN, flags) == 0
    bench.command(dialect.MAV_CMD_CONDITION_YAW, 40, 90, 1, 0)
    bench.run(6)
    heading = math.degrees(bench.autopilot.body.yaw_rad)
    assert heading == pytest.approx(40, abs=2)
    gimbal = bench.autopilot.component(Gimbal)
    assert math.degrees(gimbal.pointing.yaw_rad) + heading == pytest.approx(from_north, abs=2)
    assert angles(bench)[1] == pytest.approx(20, abs=2)
    assert bool(bench.report(ATTITUDE).flags & LOCK) == bool(flags)


def test_neutral_and_retracted_are_positions() -> None:
    bench = Bench()
    bench.command(PITCH_YAW, -40, 10, NAN, NAN, 0)
    bench.run(2)
    assert bench.command(PITCH_YAW, NAN, NAN, NAN, NAN, 2) == 0
    bench.run(2)
    assert angles(bench) == pytest.approx((0, 0), abs=0.5)
    assert bench.command(PITCH_YAW, NAN, NAN, NAN, NAN, 1) == 0
    bench.run(3)
    assert angles(bench)[0] == pytest.approx(-90, abs=0.5)


def test_messages_without_acknowledgement_move_it_too() -> None:
    bench = Bench()
    bench.tell(dialect.MAVLink_gimbal_manager_set_pitchyaw_message(1, 1, 0, 1, -0.5, 0.2, NAN, NAN))
    bench.run(2)
    assert angles(bench) == pytest.approx((-28.6, 11.5), abs=0.5)
    q = [math.cos(-0.1), 0.0, math.sin(-0.1), 0.0]
    bench.tell(dialect.MAVLink_gimbal_manager_set_attitude_message(1, 1, 0, 1, q, NAN, NAN, NAN))
    bench.run(2)
    assert angles(bench) == pytest.approx((-11.5, 0), abs=0.5)


def test_a_simulated_gimbal_looks_at_a_place_and_follows_it() -> None:
    bench = Bench().airborne(20)
    place = (*bench.offset(20, 20), 0.0)
    assert bench.command_int(dialect.MAV_CMD_DO_SET_ROI_LOCATION, at=place) == 0
    bench.run(5)
    assert angles(bench) == pytest.approx((-35.3, 45), abs=1)
    bench.command_int(192, -1, 0, at=(*bench.offset(20, -20), 20))
    bench.run(30)
    assert angles(bench) == pytest.approx((-26.6, 90), abs=2)
    assert bench.command(dialect.MAV_CMD_DO_SET_ROI_NONE) == 0
    bench.run(5)
    assert angles(bench) == pytest.approx((0, 0), abs=0.5)


def test_control_is_taken_and_given_back() -> None:
    bench = Bench()
    assert bench.command(CONFIGURE, -2, 0, -1, 0) == 0
    status = bench.report(STATUS)
    assert (status.primary_control_sysid, status.primary_control_compid) == (255, 190)
    assert bench.command(CONFIGURE, 7, 8, -1, 0) == 0
    assert bench.report(STATUS).primary_control_sysid == 7
    assert bench.command(CONFIGURE, -3, 0, -3, 0) == 0
    assert bench.report(STATUS).primary_control_sysid == 7
    assert bench.command(CONFIGURE, 0, 0, 0, 0) == 0
    assert bench.report(STATUS).primary_control_sysid == 0


def test_px4_moves_it_only_for_who_is_in_control() -> None:
    bench = Px4Bench()
    assert bench.command(PITCH_YAW, -30, 0, NAN, NAN, 0) == 2
    bench.tell(dialect.MAVLink_gimbal_manager_set_pitchyaw_message(1, 1, 0, 1, -0.5, 0.2, NAN, NAN))
    bench.run(2)
    assert angles(bench) == pytest.approx((0, 0), abs=0.1)
    assert bench.command(CONFIGURE, -2, 0, -1, 0) == 0
    assert bench.command(PITCH_YAW, -30, 0, NAN, NAN, 0) == 0
    bench.run(2)
    assert angles(bench) == pytest.approx((-30, 0), abs=0.5)


def test_a_gimbal_accepts_no_angles_as_a_real_one_does_and_stays() -> None:
    bench = Bench()
    before = angles(bench)
    assert bench.command(PITCH_YAW, NAN, NAN, NAN, NAN, 0) == 0
    bench.run(5)
    assert angles(bench) == pytest.approx(before, abs=1e-3)


def test_a_gimbal_refuses_another_device_and_values_that_are_no_numbers() -> None:
    bench = Bench()
    assert bench.command(PITCH_YAW, 0, 0, NAN, NAN, 0, 0, 9) == 4
    assert bench.command(PITCH_YAW, 0, 0, NAN, NAN, NAN) == 2
    assert bench.command(dialect.MAV_CMD_DO_SET_ROI_LOCATION, 0, 0, 0, 0, 99, 0, 0) == 2


def test_a_rover_has_none_unless_it_is_given_one() -> None:
    assert Bench(Kind.ROVER).command(PITCH_YAW, 0, 0, NAN, NAN, 0) == 3
    assert Bench(Kind.ROVER, gimbal=True).command(PITCH_YAW, 0, 0, NAN, NAN, 0) == 0
