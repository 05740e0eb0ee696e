"""Failsafes of simulated vehicles."""

import pytest
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_bench import Bench, item
from mavlink_px4_bench import Px4Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect

BEAT = dialect.MAVLink_heartbeat_message(dialect.MAV_TYPE_GCS, 8, 0, 0, 0, 3)


def beat(bench: Bench, seconds: int = 1, system: int = 255) -> None:
    """As a ground station does, once a second."""
    for _ in range(seconds):
        bench.tell(BEAT, system=system)
        bench.run(1)


def mode(bench: Bench) -> str:
    return bench.autopilot.modes.mode.name


# --- ArduPilot, the ground station ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("enabled", "then"), [(0, "GUIDED"), (1, "RTL"), (5, "LAND"), (7, "BRAKE")]
)
def test_a_copter_whose_ground_station_is_silent_does_what_is_set(enabled: int, then: str) -> None:
    bench = Bench(parameters={"FS_GCS_ENABLE": enabled}).airborne()
    beat(bench, 3)
    bench.run(3)
    assert mode(bench) == "GUIDED"
    bench.run(3)
    assert mode(bench) == then
    assert ("GCS Failsafe" in bench.texts()) == (enabled > 0)


def test_only_the_ground_station_that_is_set_counts_and_it_may_come_back() -> None:
    bench = Bench(parameters={"FS_GCS_ENABLE": 1}).airborne()
    beat(bench, 3)
    beat(bench, 8, system=254)
    assert mode(bench) == "RTL"
    beat(bench, 2)
    assert bench.texts()[-1] == "GCS Failsafe Cleared"
    assert mode(bench) == "RTL"


def test_a_ground_station_that_was_never_there_is_not_missed() -> None:
    bench = Bench(parameters={"FS_GCS_ENABLE": 1}).airborne()
    bench.run(60)
    assert mode(bench) == "GUIDED"


def test_in_auto_a_copter_may_be_told_to_go_on() -> None:
    bench = Bench(parameters={"FS_GCS_ENABLE": 1, "FS_OPTIONS": 2}).airborne()
    place = bench.offset(2000, 0)
    bench.upload([item(0, 16, frame=0), item(1, 16, place, 20.0)])
    assert bench.command(176, 1, 3) == 0
    beat(bench, 2)
    bench.run(10)
    assert mode(bench) == "AUTO"
    assert "GCS Failsafe - Continuing Auto Mode" in bench.texts()


@pytest.mark.parametrize(("options", "then"), [(16, "BRAKE"), (0, "RTL")])
def test_a_copter_that_is_held_stays_there_unless_its_options_say_otherwise(
    options: int, then: str
) -> None:
    bench = Bench(parameters={"FS_GCS_ENABLE": 1, "FS_OPTIONS": options}).airborne()
    assert bench.command(176, 1, 17) == 0
    beat(bench, 2)
    bench.run(10)
    assert mode(bench) == then
    stays = "GCS Failsafe - Continuing Pilot Control" in bench.texts()
    assert stays == (then == "BRAKE")


def test_on_the_ground_the_motors_stop() -> None:
    bench = Bench(parameters={"FS_GCS_ENABLE": 1, "DISARM_DELAY": 0}).ready()
    beat(bench, 2)
    bench.run(8)
    assert not bench.autopilot.arming.armed
    assert "GCS Failsafe - Disarming" in bench.texts()


@pytest.mark.parametrize(("action", "then"), [(0, "GUIDED"), (1, "RTL"), (2, "HOLD")])
def test_a_rover_does_what_its_action_says(action: int, then: str) -> None:
    bench = Bench(Kind.ROVER, parameters={"FS_GCS_ENABLE": 1, "FS_ACTION": action}).ready()
    beat(bench, 2)
    bench.run(8)
    assert mode(bench) == then
    assert "Radio Failsafe" in bench.texts()


# --- ArduPilot, battery and estimator -------------------------------------------------------------


@pytest.mark.parametrize(("action", "then"), [(0, "GUIDED"), (1, "LAND"), (2, "RTL")])
def test_a_low_battery_is_told_after_a_while_and_acted_on(action: int, then: str) -> None:
    bench = Bench(parameters={"BATT_FS_LOW_ACT": action}).airborne()
    bench.autopilot.battery.left = 0.06
    bench.run(9)
    assert mode(bench) == "GUIDED"
    bench.run(2)
    assert mode(bench) == then
    assert any(text.startswith("Battery 1 is low 10.3") for text in bench.texts())
    assert "Battery Failsafe" in bench.texts()


def test_a_capacity_may_be_the_threshold_and_critical_comes_second() -> None:
    levels = {"BATT_LOW_MAH": 1000, "BATT_FS_LOW_ACT": 2}
    critical = {"BATT_CRT_MAH": 500, "BATT_FS_CRT_ACT": 1}
    bench = Bench(parameters={**levels, **critical}).airborne(40)
    bench.autopilot.battery.left = 0.25
    bench.run(11)
    assert mode(bench) == "RTL"
    bench.autopilot.battery.left = 0.14
    bench.run(11)
    assert mode(bench) == "LAND"
    assert any("Battery 1 is critical" in text for text in bench.texts())


def test_with_a_low_battery_it_is_not_armed() -> None:
    bench = Bench()
    bench.run(10)
    bench.autopilot.battery.left = 0.05
    bench.command(176, 1, 4)
    assert bench.command(400, 1) == 4
    assert bench.texts()[-1] == "Arm: Battery 1 low voltage failsafe"


def test_without_satellites_a_copter_lands_and_is_not_ready_again() -> None:
    bench = Bench().airborne(10)
    bench.autopilot.injected_faults.gps_lost = True
    bench.run(2)
    assert mode(bench) == "LAND"
    assert "EKF Failsafe: changed to LAND Mode" in bench.texts()
    assert bench.report(193).flags == 0xA7
    assert bench.report(24).fix_type < 3
    assert bench.report(33).lat != 0
    bench.run_until(lambda: not bench.autopilot.arming.armed)
    assert bench.command(176, 1, 4) == 0
    assert bench.command(400, 1) == 4
    bench.autopilot.injected_faults.gps_lost = False
    assert bench.command(400, 1) == 0


def test_without_satellites_a_rover_holds() -> None:
    bench = Bench(Kind.ROVER).ready()
    bench.autopilot.injected_faults.gps_lost = True
    bench.run(2)
    assert mode(bench) == "HOLD"


# --- PX4 ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("action", "then"), [(0, "AUTO.LOITER"), (2, "AUTO.RTL"), (3, "AUTO.LAND")]
)
def test_px4_misses_any_ground_station(action: int, then: str) -> None:
    bench = Px4Bench(parameters={"NAV_DLL_ACT": action}).airborne()
    bench.beats = False
    beat(bench, 2, system=254)
    bench.run(8 + 5)
    assert bench.mode == "AUTO.LOITER"
    bench.run(3)
    assert bench.mode == then
    assert "Connection to ground station lost" not in bench.texts()
    beat(bench, 2)
    assert bench.texts()[-1] == "GCS connection regained"
    assert bench.mode == then


def test_px4_goes_on_in_modes_that_are_excepted() -> None:
    bench = Px4Bench(parameters={"NAV_DLL_ACT": 2, "COM_DLL_EXCEPT": 2}).airborne()
    bench.beats = False
    beat(bench, 2)
    bench.run(15)
    assert bench.mode == "AUTO.LOITER"


def test_px4_warns_of_a_low_battery_returns_at_a_critical_and_lands_at_last() -> None:
    bench = Px4Bench(parameters={"COM_LOW_BAT_ACT": 3}).airborne(40)
    bench.autopilot.battery.left = 0.14
    bench.run(1)
    assert bench.mode == "AUTO.LOITER"
    assert "Low battery" in bench.texts()
    bench.autopilot.battery.left = 0.065
    bench.run(4.5)
    assert bench.mode == "AUTO.LOITER"
    assert "Failsafe activated: entering Hold for 5 seconds" in bench.texts()
    bench.run(1)
    assert bench.mode == "AUTO.RTL"
    bench.autopilot.battery.left = 0.04
    bench.run(1)
    assert bench.mode == "AUTO.LAND"


def test_px4_holds_no_longer_once_another_mode_is_commanded() -> None:
    bench = Px4Bench(parameters={"COM_LOW_BAT_ACT": 3}).airborne(40)
    bench.autopilot.battery.left = 0.065
    bench.run(2)
    assert bench.enter(4, 5) == 0
    bench.run(1)
    assert bench.enter(4, 3) == 0
    bench.run(20)
    assert bench.mode == "AUTO.LOITER"


def test_px4_without_a_position_descends() -> None:
    bench = Px4Bench().airborne(10)
    bench.autopilot.injected_faults.gps_lost = True
    bench.run(2)
    assert bench.mode == "AUTO.DESCEND"
    assert not bench.report(230).flags & dialect.ESTIMATOR_POS_HORIZ_ABS
    bench.run_until(lambda: not bench.autopilot.arming.armed)
    assert bench.mode == "AUTO.LOITER"
