from dataclasses import replace

import pytest
from m2pem_plugin_mavlink.vehicle.identity import Firmware
from m2pem_plugin_mavlink.vehicle.readiness import readiness
from m2pem_plugin_mavlink.vehicle.state import AutopilotState

from m2pem.api import GeoPosition

ARDUPILOT, PX4 = Firmware.ARDUPILOT, Firmware.PX4
READY = AutopilotState(
    heartbeat_s=10.0,
    boot_s=0.0,
    armed=False,
    gps_fix=6,
    estimator_flags=0x33F,
    prearm_passed=True,
    home=GeoPosition(47.0, 8.0, 488.0),
    battery_fraction=0.9,
)


def reasons(firmware: Firmware, state: AutopilotState, *texts: str) -> tuple[str, ...]:
    answer = readiness(firmware, state, texts, 12.0)
    assert answer.ready is not bool(answer.reasons)
    return answer.reasons


@pytest.mark.parametrize("firmware", Firmware)
def test_a_vehicle_without_a_reason_is_ready(firmware: Firmware) -> None:
    assert reasons(firmware, READY) == ()


@pytest.mark.parametrize("firmware", Firmware)
@pytest.mark.parametrize("flags", [0x27, 0x0])
def test_an_estimator_without_a_position_is_not_ready(firmware: Firmware, flags: int) -> None:
    """The pre-arm bit is set before there is a position (in STABILIZE)."""
    found = reasons(firmware, replace(READY, estimator_flags=flags))
    assert found == ("EKF: no position yet, 12 s",)


def test_the_estimators_flag_of_a_constant_position_is_a_reason_on_ardupilot_alone() -> None:
    """PX4 sets it whenever it is at rest, also when it may be armed."""
    at_rest = replace(READY, estimator_flags=0x3FF)
    assert reasons(ARDUPILOT, at_rest) == ("EKF: no position yet, 12 s",)
    assert reasons(PX4, at_rest) == ()


def test_an_ardupilot_whose_estimator_is_silent_is_not_ready() -> None:
    found = reasons(ARDUPILOT, replace(READY, estimator_flags=None))
    assert found == ("EKF: no status yet, 12 s",)


def test_a_px4_is_believed_on_its_prearm_bit_where_it_sends_no_estimator_status() -> None:
    silent = replace(READY, estimator_flags=None)
    assert reasons(PX4, silent) == ()
    assert reasons(PX4, replace(silent, prearm_passed=None))
    assert reasons(PX4, replace(silent, home=None)) == ("home: not set yet, 12 s",)


def test_prearm_texts_are_the_reasons_of_a_check_that_fails() -> None:
    failing = replace(READY, prearm_passed=False)
    texts = ("PreArm: Compass not healthy", "EKF3 active", "PreArm: Compass not healthy")
    assert reasons(ARDUPILOT, failing, *texts) == ("prearm: Compass not healthy",)
    assert reasons(ARDUPILOT, READY, *texts) == ()
    assert "does not report which" in reasons(ARDUPILOT, failing)[0]
    assert reasons(PX4, failing, "Preflight Fail: no RC") == ("prearm: no RC",)
    assert reasons(PX4, failing, "Preflight: GPS fix too low") == ("prearm: GPS fix too low",)


def test_gps_battery_and_link_are_reasons() -> None:
    assert reasons(ARDUPILOT, replace(READY, gps_fix=1)) == ("GPS: no 3D fix",)
    assert reasons(PX4, replace(READY, battery_fraction=0.12)) == ("battery at 12 %",)
    assert reasons(PX4, AutopilotState()) == ("link: no heartbeat yet",)


def test_an_armed_vehicle_is_ready() -> None:
    assert reasons(ARDUPILOT, replace(READY, armed=True, estimator_flags=0xA7)) == ()
