from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_bench import Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect

ARM = dialect.MAV_CMD_COMPONENT_ARM_DISARM
MODE = dialect.MAV_CMD_DO_SET_MODE
PREARM = dialect.MAV_SYS_STATUS_PREARM_CHECK


def test_guided_is_not_armed_before_the_estimator_is_ready_and_says_why() -> None:
    bench = Bench(estimator_s=41)
    bench.run(30)
    assert bench.command(MODE, 1, 4) == 0
    assert bench.command(ARM, 1) == 4
    assert bench.texts()[-1] == "Arm: Need Position Estimate"
    bench.run_until(lambda: bench.autopilot.estimator.ready)
    assert bench.command(ARM, 1) == 0
    assert bench.autopilot.arming.armed


def test_a_mode_that_needs_no_position_is_armed_earlier() -> None:
    bench = Bench(estimator_s=41)
    bench.run(20)
    assert not bench.report(1).onboard_control_sensors_health & PREARM
    assert bench.command(ARM, 1) == 4
    bench.run(5)
    assert bench.report(1).onboard_control_sensors_health & PREARM
    assert bench.command(ARM, 1) == 0


def test_the_prearm_bit_goes_when_the_mode_needs_a_position() -> None:
    bench = Bench(estimator_s=41)
    bench.run(25)
    bench.command(MODE, 1, 4)
    assert not bench.report(1).onboard_control_sensors_health & PREARM


def test_arming_twice_is_accepted_twice_and_done_once() -> None:
    bench = Bench().ready()
    assert bench.command(ARM, 1) == 0
    assert bench.autopilot.log.counts["armed"] == 1


def test_a_copter_in_the_air_is_disarmed_by_force_only() -> None:
    bench = Bench().airborne()
    assert bench.command(ARM, 0) == 4
    assert bench.autopilot.arming.armed
    assert bench.command(ARM, 0, 21196) == 0
    bench.run_until(lambda: bench.autopilot.body.on_ground)


def test_a_copter_that_stands_armed_disarms_itself() -> None:
    bench = Bench().ready()
    took_s = bench.run_until(lambda: not bench.autopilot.arming.armed)
    assert 9.5 < took_s < 11


def test_rtl_is_no_mode_to_arm_in() -> None:
    bench = Bench()
    bench.run(10)
    assert bench.command(MODE, 1, 6) == 0
    assert bench.command(ARM, 1) == 4
    assert bench.texts()[-1] == "Arm: RTL mode not armable"


def test_a_rover_without_checks_is_armed_at_once_in_manual_but_not_in_guided() -> None:
    bench = Bench(Kind.ROVER, estimator_s=41, parameters={"ARMING_CHECK": 0})
    bench.run(10)
    assert bench.command(ARM, 1) == 0
    assert bench.command(ARM, 0) == 0
    assert bench.command(MODE, 1, 15) == 0
    assert bench.command(ARM, 1) == 4


def test_the_estimators_flags_go_from_constant_position_to_everything() -> None:
    bench = Bench(estimator_s=41)
    bench.run(20)
    assert bench.report(193).flags == 0xA7
    bench.run(22)
    assert bench.report(193).flags == 0x33F
