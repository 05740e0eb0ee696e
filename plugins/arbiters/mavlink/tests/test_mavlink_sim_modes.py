from mavlink_bench import Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect

MODE = dialect.MAV_CMD_DO_SET_MODE


def test_a_mode_that_does_not_exist_is_named() -> None:
    bench = Bench()
    assert bench.command(MODE, 1, 99) == 4
    assert bench.texts() == ["No such mode 99"]


def test_guided_is_refused_until_the_attitude_is_known() -> None:
    bench = Bench(estimator_s=41)
    bench.run(5)
    assert bench.command(MODE, 1, 4) == 4
    assert bench.texts() == ["Mode change to GUIDED failed: requires position"]
    bench.run(10)
    assert bench.command(MODE, 1, 4) == 0
    bench.run(1)
    assert bench.received[-1].custom_mode == 4


def test_armed_it_enters_no_mode_that_needs_a_position_it_has_not() -> None:
    bench = Bench(estimator_s=41)
    bench.run(25)
    assert bench.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 0
    assert bench.command(MODE, 1, 4) == 4


def test_a_base_mode_without_a_custom_mode_is_denied() -> None:
    assert Bench().command(MODE, 0, 4) == 2


def test_auto_in_the_air_without_a_mission_is_refused() -> None:
    bench = Bench().airborne()
    assert bench.command(MODE, 1, 3) == 4
    assert bench.texts()[-1] == "Mode change to AUTO failed: init failed"


def test_rtl_climbs_comes_home_lands_and_stops_the_motors() -> None:
    bench = Bench().airborne(5)
    bench.command_int(192, -1, 0, at=(*bench.offset(60, 0), 5))
    bench.run(15)
    assert bench.command(MODE, 1, 6) == 0
    highest = 0.0
    while bench.autopilot.arming.armed:
        bench.run(0.5)
        highest = max(highest, bench.autopilot.body.up_m)
        assert bench.autopilot.now_s < 300
    assert 14.5 < highest < 16
    assert bench.autopilot.position.distance_m(bench.autopilot.home.point) < 1


def test_land_comes_down_where_it_is() -> None:
    bench = Bench().airborne()
    assert bench.command(dialect.MAV_CMD_NAV_LAND) == 0
    bench.run_until(lambda: not bench.autopilot.arming.armed)
    assert bench.autopilot.body.on_ground
    assert bench.autopilot.log.counts["landed"] == 1
