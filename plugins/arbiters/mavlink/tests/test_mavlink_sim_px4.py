"""A simulated PX4 by itself: readiness, arming, modes, and going to places."""

import pytest
from m2pem_plugin_mavlink.simulator.autopilot import Autopilot
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from mavlink_px4_bench import (
    ACCEPTED,
    ARM,
    GROUND_M,
    LATER,
    NAN,
    REPOSITION,
    TAKEOFF,
    UNSUPPORTED,
    Px4Bench,
)
from pymavlink.dialects.v20 import ardupilotmega as dialect

PREARM = dialect.MAV_SYS_STATUS_PREARM_CHECK
FAILED = dialect.MAV_RESULT_FAILED
ORBIT = dialect.MAV_CMD_DO_ORBIT


def heard(bench: Px4Bench, id_: int) -> list:
    return [each for each in bench.received if each.get_msgId() == id_]


def test_its_heartbeat_is_that_of_px4() -> None:
    bench = Px4Bench()
    bench.run(1)
    (heartbeat, *_) = heard(bench, 0)
    assert (heartbeat.autopilot, heartbeat.type) == (12, 2)
    assert heartbeat.custom_mode == 4 << 16 | 3 << 24
    assert heartbeat.base_mode & 1
    assert not heartbeat.base_mode & 128


def test_a_simulated_px4_streams_without_being_asked_but_not_what_ardupilot_alone_has() -> None:
    bench = Px4Bench()
    bench.run(10)
    for id_ in (1, 24, 30, 32, 33, 42, 141, 147, 230, 242, 245):
        assert heard(bench, id_), id_
    for id_ in (193, 162):
        assert not heard(bench, id_)
        assert bench.command(511, id_, 100_000) == FAILED


def test_readiness_is_in_the_estimator_status_the_prearm_bit_and_home() -> None:
    bench = Px4Bench(estimator_s=20)
    bench.run(10)
    assert not heard(bench, 230)[-1].flags & dialect.ESTIMATOR_POS_HORIZ_ABS
    assert heard(bench, 230)[-1].flags & dialect.ESTIMATOR_CONST_POS_MODE
    assert not heard(bench, 1)[-1].onboard_control_sensors_health & PREARM
    assert not heard(bench, 242)
    bench.run(15)
    # "Constant position" means also that it is at rest.
    assert heard(bench, 230)[-1].flags == 0x3FF
    assert heard(bench, 1)[-1].onboard_control_sensors_health & PREARM
    assert heard(bench, 242)[-1].altitude == GROUND_M * 1000
    bench.airborne()
    assert heard(bench, 230)[-1].flags == 0x37F


def test_arming_without_a_position_is_rejected_with_texts() -> None:
    bench = Px4Bench(estimator_s=20)
    bench.run(5)
    assert bench.command(ARM, 1) == LATER
    denied = "Arming denied: Resolve system health failures first"  # longer than a message
    assert f"{denied}Preflight Fail: Sensors are still calibrating" in "".join(bench.texts())
    first, second, third = [m for m in bench.received if m.get_type() == "STATUSTEXT"][:3]
    assert [(m.id, m.chunk_seq) for m in (first, second, third)] == [(0, 0), (0, 1), (1, 0)]
    bench.run(10)
    assert bench.command(ARM, 1) == LATER
    assert "Preflight Fail: No valid position estimate" in bench.texts()


def test_a_simulated_px4_takes_off_to_a_height_above_the_sea_and_then_holds() -> None:
    bench = Px4Bench().ready()
    assert bench.command(TAKEOFF, *[NAN] * 6, GROUND_M + 12) == ACCEPTED
    assert bench.mode == "AUTO.TAKEOFF"
    bench.run(2)
    assert bench.report(245).landed_state == dialect.MAV_LANDED_STATE_TAKEOFF
    assert bench.command(TAKEOFF, *[NAN] * 6, GROUND_M + 12) == ACCEPTED
    bench.run_until(lambda: bench.mode == "AUTO.LOITER")
    bench.run(5)
    assert bench.autopilot.body.up_m == pytest.approx(12, abs=0.3)
    assert bench.autopilot.log.counts["takeoff"] == 1


def test_without_a_height_it_takes_off_to_the_one_that_is_set() -> None:
    bench = Px4Bench().ready()
    assert bench.command(TAKEOFF, *[NAN] * 7) == ACCEPTED
    bench.run(20)
    assert bench.autopilot.body.up_m == pytest.approx(2.5, abs=0.3)
    assert "Using default takeoff altitude: 2.5 m" in bench.texts()


def test_the_takeoff_may_be_commanded_before_it_is_armed() -> None:
    bench = Px4Bench()
    bench.run(10)
    assert bench.command(TAKEOFF, *[NAN] * 6, GROUND_M + 10) == ACCEPTED
    bench.run(5)
    assert bench.autopilot.body.on_ground
    assert bench.command(ARM, 1) == ACCEPTED
    bench.run_until(lambda: bench.autopilot.body.up_m > 9)


def test_armed_but_never_in_the_air_it_disarms_itself() -> None:
    bench = Px4Bench().ready()
    bench.run(12)
    assert not bench.autopilot.arming.armed


def test_in_flight_it_is_disarmed_by_force_only() -> None:
    bench = Px4Bench().airborne()
    assert bench.command(ARM, 0) == LATER
    assert bench.texts()[-1] == "Disarming denied: not landed"
    assert bench.command(ARM, 0, 21196) == ACCEPTED


@pytest.mark.parametrize("frame", [0, 3, 5, 6])
def test_a_place_is_above_the_sea_whatever_the_frame_says(frame: int) -> None:
    bench = Px4Bench().airborne()
    place = (*bench.offset(30, -40), GROUND_M + 25)
    assert bench.command_int(REPOSITION, -1, 1, 0, NAN, at=place, frame=frame) == ACCEPTED
    bench.run(40)
    assert bench.autopilot.position == pytest.approx((30, -40, 25), abs=0.5)
    assert bench.mode == "AUTO.LOITER"


def test_a_place_without_a_height_is_at_the_present_one_and_turns_it() -> None:
    bench = Px4Bench().airborne()
    place = (*bench.offset(20, 0), NAN)
    assert bench.command_int(REPOSITION, 2, 1, 0, 1.5, at=place, frame=5) == ACCEPTED
    bench.run(5)
    assert bench.autopilot.body.ground_speed_mps == pytest.approx(2, abs=0.1)
    bench.run(20)
    assert bench.autopilot.position == pytest.approx((20, 0, 20), abs=0.5)
    assert bench.autopilot.body.yaw_rad == pytest.approx(1.5, abs=0.05)


def test_on_its_way_it_is_stopped_by_a_reposition_to_nowhere_and_not_by_the_mode() -> None:
    bench = Px4Bench().airborne()
    place = (*bench.offset(500, 0), GROUND_M + 20)
    assert bench.command_int(REPOSITION, -1, 1, 0, NAN, at=place) == ACCEPTED
    bench.run(5)
    assert bench.enter(4, 3) == ACCEPTED
    bench.run(5)
    assert bench.autopilot.body.moving
    assert bench.command(REPOSITION, -1, 1, 0, NAN, NAN, NAN, NAN) == ACCEPTED
    bench.run(5)
    assert not bench.autopilot.body.moving
    assert bench.autopilot.body.north_m < 100


def test_a_height_alone_does_not_change_where_it_goes() -> None:
    bench = Px4Bench().airborne()
    place = (*bench.offset(50, 0), GROUND_M + 20)
    bench.command_int(REPOSITION, -1, 1, 0, NAN, at=place)
    bench.run(2)
    assert bench.command(REPOSITION, -1, 1, 0, NAN, NAN, NAN, GROUND_M + 30) == ACCEPTED
    bench.run(30)
    assert bench.autopilot.position == pytest.approx((50, 0, 30), abs=0.5)


def test_a_place_without_a_change_of_mode_is_unsupported() -> None:
    bench = Px4Bench().airborne()
    place = (*bench.offset(20, 0), GROUND_M + 20)
    assert bench.command_int(REPOSITION, -1, 0, 0, NAN, at=place) == UNSUPPORTED
    bench.run(5)
    assert not bench.autopilot.body.moving


def test_a_simulated_px4_orbits_a_place() -> None:
    bench = Px4Bench().airborne()
    place = (*bench.offset(40, 0), GROUND_M + 20)
    assert bench.command_int(ORBIT, 15, 4, 0, 0, at=place) == ACCEPTED
    bench.run(40)
    assert bench.mode == "POSCTL.ORBIT"
    assert heard(bench, 0)[-1].custom_mode == 3 << 16 | 1 << 24
    distance_to_m = bench.autopilot.position.distance_m(
        bench.autopilot.frame.to_point(_place(place))
    )
    assert distance_to_m == pytest.approx(15, abs=1.5)
    assert heard(bench, 360)[-1].radius == 15
    assert bench.autopilot.body.ground_speed_mps == pytest.approx(4, abs=0.5)


def _place(place: tuple[float, float, float]):
    from m2pem_plugin_mavlink.simulator.geometry import Location

    return Location(*place)


def test_a_simulated_px4_returns_lands_and_disarms() -> None:
    bench = Px4Bench().airborne()
    bench.command_int(REPOSITION, -1, 1, 0, NAN, at=(*bench.offset(100, 0), GROUND_M + 20))
    bench.run(40)
    assert bench.enter(4, 5) == ACCEPTED
    highest_m = 0.0
    while bench.autopilot.arming.armed:
        bench.run(0.5)
        highest_m = max(highest_m, bench.autopilot.body.up_m)
        assert bench.autopilot.now_s < 400
    assert highest_m == pytest.approx(60, abs=1)
    assert bench.autopilot.position.distance_m(bench.autopilot.home.point) < 1


def test_near_home_it_returns_without_the_full_climb() -> None:
    bench = Px4Bench().airborne(10)
    assert bench.command(dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH) == ACCEPTED
    bench.run_until(lambda: bench.autopilot.body.up_m > 29)
    bench.run_until(lambda: not bench.autopilot.arming.armed)


def test_a_simulated_px4_lands_where_it_is() -> None:
    bench = Px4Bench().airborne(8)
    assert bench.command(dialect.MAV_CMD_NAV_LAND) == ACCEPTED
    bench.run(1)
    assert bench.report(245).landed_state == dialect.MAV_LANDED_STATE_LANDING
    bench.run_until(lambda: not bench.autopilot.arming.armed)
    assert bench.autopilot.body.on_ground


def test_a_mode_that_it_has_not_is_rejected() -> None:
    bench = Px4Bench()
    assert bench.enter(4, 77) == LATER
    assert bench.command(dialect.MAV_CMD_DO_SET_MODE, 0, 4, 4) == LATER


def test_commands_of_ardupilot_alone_are_unsupported() -> None:
    bench = Px4Bench().airborne()
    assert bench.command(dialect.MAV_CMD_CONDITION_YAW, 90) == UNSUPPORTED


def test_a_rover_drives_to_a_place_and_stands_there() -> None:
    bench = Px4Bench(Kind.ROVER).ready()
    place = (*bench.offset(20, 10), NAN)
    assert bench.command_int(REPOSITION, -1, 1, 0, NAN, at=place) == ACCEPTED
    bench.run(40)
    assert bench.autopilot.position.distance_m(bench.autopilot.home.point.moved(0, 0)) > 20
    assert bench.autopilot.position[:2] == pytest.approx((20, 10), abs=2.5)
    assert not bench.autopilot.body.moving
    assert bench.command(TAKEOFF, *[NAN] * 7) == UNSUPPORTED


def test_planes_with_px4_and_unknown_firmwares_are_refused() -> None:
    with pytest.raises(ValueError, match="a plane with PX4 is not simulated"):
        Autopilot(VehicleSpec(Kind.PLANE, firmware="px4"))
    with pytest.raises(ValueError, match="there is no firmware 'ardu'; there are: ardupilot, px4"):
        Autopilot(VehicleSpec(firmware="ardu"))
