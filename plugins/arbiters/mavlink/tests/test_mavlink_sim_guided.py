import math

import pytest
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_bench import Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect

VELOCITY_ONLY = 0b1111_1100_0111


def velocity(north: float, east: float, frame: int = 1) -> object:
    return dialect.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, frame, VELOCITY_ONLY, 0, 0, 0, north, east, 0.0, 0, 0, 0, 0, 0
    )


def test_a_takeoff_needs_guided_and_motors() -> None:
    bench = Bench()
    bench.run(10)
    assert bench.command(22, 0, 0, 0, 0, 0, 0, 10) == 4
    bench.command(176, 1, 4)
    assert bench.command(22, 0, 0, 0, 0, 0, 0, 10) == 4
    bench.command(400, 1)
    assert bench.command(22, 0, 0, 0, 0, 0, 0, 10) == 0


def test_a_takeoff_that_is_repeated_in_the_air_fails() -> None:
    bench = Bench().ready()
    for _ in range(3):
        assert bench.command(22, 0, 0, 0, 0, 0, 0, 10) == 0
    bench.run(1)
    assert bench.command(22, 0, 0, 0, 0, 0, 0, 10) == 4
    bench.run(10)
    assert bench.command(22, 0, 0, 0, 0, 0, 0, 10) == 4
    assert bench.autopilot.log.counts["takeoff"] == 1
    assert abs(bench.autopilot.body.up_m - 10) < 0.5


@pytest.mark.parametrize("height", [math.nan, math.inf, -5.0, 0.0])
def test_a_takeoff_to_nowhere_fails(height: float) -> None:
    assert Bench().ready().command(22, 0, 0, 0, 0, 0, 0, height) == 4


def test_reposition_works_in_guided_or_when_it_may_change_the_mode() -> None:
    bench = Bench().airborne()
    bench.command(176, 1, 5)
    assert bench.command_int(192, -1, 0, at=(*bench.offset(40, 0), 20)) == 2
    assert bench.command_int(192, -1, 1, at=(*bench.offset(40, 0), 20)) == 0
    assert bench.autopilot.modes.mode.name == "GUIDED"
    bench.run(15)
    assert bench.autopilot.body.north_m == pytest.approx(40, abs=0.3)
    assert bench.autopilot.log.counts["motion"] == 1


def test_reposition_needs_a_place_on_earth() -> None:
    bench = Bench().airborne()
    assert bench.command_int(192, -1, 1, at=(*bench.offset(40, 0), 20), frame=1) == 2
    assert bench.command_int(192, -1, 1, at=(95.0, 8.5, 20)) == 2
    assert bench.command_int(192, -1, 1, at=(*bench.offset(40, 0), math.nan)) == 2


def test_the_same_place_again_is_no_new_motion() -> None:
    bench = Bench().airborne()
    for _ in range(3):
        assert bench.command_int(192, -1, 1, at=(*bench.offset(40, 0), 20)) == 0
    assert bench.autopilot.log.counts["motion"] == 1


def test_a_velocity_is_forgotten_after_three_seconds() -> None:
    bench = Bench().airborne()
    bench.tell(velocity(4, 0))
    bench.run(2.5)
    assert bench.autopilot.body.north_mps == pytest.approx(4)
    bench.run(4)
    assert not bench.autopilot.body.moving


def test_a_velocity_that_is_renewed_goes_on() -> None:
    bench = Bench().airborne()
    for _ in range(10):
        bench.tell(velocity(0, -4))
        bench.run(1)
    assert bench.autopilot.body.east_mps == pytest.approx(-4)
    assert bench.autopilot.log.counts["motion"] == 1


def test_setpoints_that_are_no_numbers_are_ignored() -> None:
    bench = Bench().airborne()
    bench.tell(velocity(math.nan, 0))
    bench.tell(velocity(math.inf, 0))
    bench.run(1)
    assert not bench.autopilot.body.moving
    assert math.isfinite(bench.autopilot.body.north_m)


def test_velocities_in_other_frames_are_ignored() -> None:
    bench = Bench().airborne()
    bench.tell(velocity(3, 0, frame=8))
    bench.run(1)
    assert not bench.autopilot.body.moving


def test_outside_guided_setpoints_do_nothing() -> None:
    bench = Bench().airborne()
    bench.command(176, 1, 5)
    bench.tell(velocity(4, 0))
    bench.run(2)
    assert not bench.autopilot.body.moving


def test_a_heading_is_taken() -> None:
    bench = Bench().airborne()
    assert bench.command(115, 90, 0, 1, 0) == 0
    bench.run(5)
    assert bench.autopilot.body.yaw_rad == pytest.approx(math.pi / 2, abs=0.05)
    assert bench.command(115, 400, 0, 1, 0) == 4


def test_a_speed_holds_until_the_mode_changes() -> None:
    bench = Bench().airborne()
    bench.command_int(192, -1, 1, at=(*bench.offset(100, 0), 20))
    assert bench.command(178, 1, 3, -1) == 0
    bench.run(8)
    assert bench.autopilot.body.ground_speed_mps == pytest.approx(3, abs=0.1)
    bench.command_int(192, -1, 1, at=(*bench.offset(-100, 0), 20))
    bench.run(8)
    assert bench.autopilot.body.ground_speed_mps == pytest.approx(3, abs=0.1)
    assert bench.command(178, 1, -2) == 2


def test_a_copter_forgets_a_speed_that_it_was_given_before_its_first_place() -> None:
    bench = Bench().airborne()
    assert bench.command(178, 1, 3, -1) == 0
    bench.command_int(192, 3, 1, at=(*bench.offset(200, 0), 20))
    bench.run(8)
    assert bench.autopilot.body.ground_speed_mps == pytest.approx(10, abs=0.1)


@pytest.mark.parametrize(
    ("mode", "result"), [(4, 0), (6, 0), (21, 0), (5, 4), (17, 4), (2, 4), (7, 4), (16, 4), (9, 4)]
)
def test_a_copter_takes_a_speed_in_guided_auto_and_rtl_only(mode: int, result: int) -> None:
    bench = Bench().airborne()
    assert bench.command(176, 1, mode) == 0
    assert bench.command(178, 1, 3, -1) == result


@pytest.mark.parametrize(("mode", "result"), [(4, 4), (5, 4), (0, 4), (11, 0), (12, 0)])
def test_what_drives_takes_a_speed_only_where_it_goes_to_a_place(mode: int, result: int) -> None:
    bench = Bench(Kind.ROVER).ready()
    assert bench.command(176, 1, mode) == 0
    assert bench.command(178, 1, 2, -1) == result
    assert bench.command(178, 2, 2, -1) == 2


@pytest.mark.parametrize("kind", [Kind.ROVER, Kind.BOAT])
def test_what_drives_takes_a_speed_in_guided_when_it_has_a_place(kind: Kind) -> None:
    bench = Bench(kind).ready()
    there = (*bench.offset(30, 0), 0)
    assert bench.command(178, 1, 2, -1) == 4
    bench.command(176, 1, 4)
    # The mode changes before the speed is refused.
    assert bench.command_int(192, 2, 1, at=there) == 4
    assert bench.autopilot.modes.mode.name == "GUIDED"
    bench.run(3)
    assert not bench.autopilot.body.moving
    assert bench.command_int(192, -1, 1, at=there) == 0
    assert bench.command(178, 1, 2, -1) == 0
    assert bench.command(178, 1, 0.01, -1) == 4
    bench.run(8)
    assert bench.autopilot.body.ground_speed_mps == pytest.approx(2, abs=0.1)
    bench.run_until(lambda: bench.autopilot.position.distance_m(bench.autopilot.home.point) > 27)
    bench.run(10)
    # A boat loiters at the place.
    assert bench.command(178, 1, 2, -1) == (0 if kind is Kind.ROVER else 4)
    bench.tell(velocity(1, 0))
    assert bench.command(178, 1, 2, -1) == 4


def test_a_plane_takes_speeds_between_its_limits_in_guided_and_auto() -> None:
    bench = Bench(Kind.PLANE).ready()
    assert bench.command(178, 0, 15, -1) == 0
    assert bench.command(178, 0, 50, -1) == 4
    # Over the ground it is never slower than its airspeed makes it.
    assert bench.command(178, 1, 5, -1) == 0
    assert bench.autopilot.modes.speed_mps == bench.autopilot.tuning.cruise_mps
    assert bench.texts()[-2:] == ["Set airspeed 15 m/s", "Set groundspeed 5"]
    bench.command(176, 1, 12)
    assert bench.command(178, 0, 15, -1) == 4
    assert bench.command_int(192, -1, 0, at=(*bench.offset(30, 0), 50)) == 4


def test_a_rover_drives_to_a_place_behind_it_and_stands() -> None:
    bench = Bench(Kind.ROVER).ready()
    assert bench.command_int(192, -1, 1, at=(*bench.offset(-20, 15), 0)) == 0
    bench.run(40)
    body = bench.autopilot.body
    assert math.hypot(body.north_m + 20, body.east_m - 15) < 2.5
    assert not body.moving
    assert [m.seq for m in bench.received if m.get_type() == "MISSION_ITEM_REACHED"] == [0]


def test_a_rover_can_drive_to_a_place_in_reverse() -> None:
    bench = Bench(Kind.ROVER).ready()
    assert bench.command(194, 1) == 0
    assert bench.command_int(192, -1, 0, at=(*bench.offset(-20, 0), 0)) == 0
    bench.run(5)
    assert bench.autopilot.body.north_mps < -1
    assert abs(bench.autopilot.body.yaw_rad) < 0.1


def test_what_a_rover_cannot_do_it_does_not_support() -> None:
    bench = Bench(Kind.ROVER).ready()
    assert bench.command(22, 0, 0, 0, 0, 0, 0, 10) == 3
    assert bench.command(21) == 3
    assert bench.command(34) == 3
