import math
from typing import Any

import pytest
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.identity import Firmware, Identity, Kind
from m2pem_plugin_mavlink.vehicle.modes import modes_of
from m2pem_plugin_mavlink.vehicle.state import AutopilotState
from m2pem_plugin_mavlink.vehicle.telemetry_decoder import TelemetryDecoder, enu_yaw
from mavlink_vehicle_world import HOME, make

from m2pem.api import GeoPosition

LATITUDE, LONGITUDE, ALTITUDE = HOME


def intake(kind: Kind = Kind.COPTER) -> TelemetryDecoder:
    modes = modes_of(Identity(Firmware.ARDUPILOT, kind))
    return TelemetryDecoder(AutopilotState(), modes, flies=kind is Kind.COPTER)


def take(into: TelemetryDecoder, name: str, now_s: float = 1.0, **fields: Any) -> AutopilotState:
    into.take(make(name, **fields), now_s)
    return into.state


def at(relative_alt_m: float = 0.0, boot_ms: int = 60_000, **fields: Any) -> dict[str, Any]:
    return {
        "time_boot_ms": boot_ms,
        "lat": LATITUDE,
        "lon": LONGITUDE,
        "alt": ALTITUDE,
        "relative_alt": round(relative_alt_m * 1000),
        **fields,
    }


def test_velocity_and_attitude_are_turned_to_east_north_up() -> None:
    into = intake()
    heard = take(into, "LOCAL_POSITION_NED", time_boot_ms=1, vx=3.0, vy=1.0, vz=-2.0)
    assert heard.velocity_enu_m_s == (1.0, 3.0, 2.0)
    heard = take(into, "ATTITUDE", time_boot_ms=1, roll=0.1, pitch=0.2, yaw=math.pi / 2)
    assert (heard.roll_rad, heard.pitch_rad) == pytest.approx((0.1, -0.2))
    assert heard.yaw_rad == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("degrees", "yaw_degrees"), [(0, 90), (90, 0), (180, -90), (270, 180), (359, 91)]
)
def test_a_heading_from_north_is_a_yaw_from_east(degrees: float, yaw_degrees: float) -> None:
    yaw = enu_yaw(math.radians(degrees))
    assert math.cos(yaw) == pytest.approx(math.cos(math.radians(yaw_degrees)))
    assert math.sin(yaw) == pytest.approx(math.sin(math.radians(yaw_degrees)))
    off = math.remainder(enu_yaw(yaw) - math.radians(degrees), math.tau)
    assert off == pytest.approx(0.0)


def test_positions_are_degrees_and_metres() -> None:
    heard = take(intake(), "GLOBAL_POSITION_INT", **at(12.5, vx=100, vy=-200, vz=50, hdg=9000))
    assert heard.position == GeoPosition(47.397742, 8.545594, 488.0)
    assert heard.altitude_above_home_m == 12.5
    assert heard.velocity_enu_m_s == (-2.0, 1.0, -0.5)
    assert heard.yaw_rad == pytest.approx(0.0)


@pytest.mark.parametrize("place", [(0, 0), (910_000_000, 1), (1, 1_810_000_000)])
def test_a_place_that_cannot_be_is_no_position(place: tuple[int, int]) -> None:
    latitude, longitude = place
    heard = take(intake(), "GLOBAL_POSITION_INT", lat=latitude, lon=longitude, alt=1)
    assert heard.position is None
    assert heard.speed_m_s == math.inf


def test_a_ground_vehicle_is_not_believed_about_its_height_above_home() -> None:
    into = intake(Kind.ROVER)
    assert take(into, "GLOBAL_POSITION_INT", **at(487.0)).altitude_above_home_m is None
    take(into, "HOME_POSITION", latitude=LATITUDE, longitude=LONGITUDE, altitude=ALTITUDE - 500)
    assert take(into, "GLOBAL_POSITION_INT", **at(487.0)).altitude_above_home_m == 0.5
    assert into.state.landed is True


def test_a_heartbeat_tells_mode_and_arming() -> None:
    heard = take(intake(), "HEARTBEAT", base_mode=129, custom_mode=4)
    assert (heard.mode, heard.armed, heard.custom_mode) == (FlightMode.GUIDED, True, 4)


def test_landed_is_what_it_says_and_else_what_heights_and_speeds_say() -> None:
    into = intake()
    take(into, "HEARTBEAT", base_mode=128)
    assert take(into, "GLOBAL_POSITION_INT", **at(0.1)).landed is True
    assert take(into, "GLOBAL_POSITION_INT", **at(0.1, vz=-100)).landed is False
    assert take(into, "GLOBAL_POSITION_INT", **at(8.0)).landed is False
    assert take(into, "EXTENDED_SYS_STATE", landed_state=1).landed is True
    assert take(into, "GLOBAL_POSITION_INT", **at(8.0)).landed is True
    assert take(into, "EXTENDED_SYS_STATE", landed_state=3).landed is False
    assert take(into, "EXTENDED_SYS_STATE", landed_state=0).landed is False


def test_a_battery_that_is_not_measured_is_not_known() -> None:
    into = intake()
    assert take(into, "SYS_STATUS", battery_remaining=-1).battery_fraction is None
    assert take(into, "SYS_STATUS", battery_remaining=37).battery_fraction == 0.37
    assert take(into, "BATTERY_STATUS", id=1, battery_remaining=5).battery_fraction == 0.37


def test_the_prearm_bit_counts_only_where_it_is_in_use() -> None:
    bit = 0x10000000
    into = intake()
    assert take(into, "SYS_STATUS").prearm_passed is None
    used = {"onboard_control_sensors_present": bit, "onboard_control_sensors_enabled": bit}
    assert take(into, "SYS_STATUS", **used).prearm_passed is False
    assert take(into, "SYS_STATUS", onboard_control_sensors_health=bit, **used).prearm_passed


def test_missions_that_are_not_there_have_no_items() -> None:
    into = intake()
    assert take(into, "MISSION_CURRENT", seq=2).mission_total is None
    assert take(into, "MISSION_CURRENT", seq=2, total=7).mission_total == 7
    assert take(into, "MISSION_CURRENT", total=0xFFFF).mission_total == 0


def test_a_clock_that_goes_back_is_a_new_boot_and_late_messages_are_not() -> None:
    into = intake()
    take(into, "EKF_STATUS_REPORT", now_s=1.0, flags=0x33F)
    heard = take(into, "GLOBAL_POSITION_INT", now_s=2.0, **at(boot_ms=60_000))
    take(into, "ATTITUDE", now_s=2.1, time_boot_ms=58_500)
    assert (heard.boots, heard.estimator_flags) == (1, 0x33F)
    take(into, "ATTITUDE", now_s=9.0, time_boot_ms=3_000)
    assert (heard.boots, heard.boot_s) == (2, 9.0)
    assert heard.estimator_flags is heard.position is None
    take(into, "ATTITUDE", now_s=9.2, time_boot_ms=3_200)
    assert heard.boots == 2


def test_numbers_that_are_none_change_nothing() -> None:
    into = intake()
    take(into, "ATTITUDE", time_boot_ms=1, yaw=math.nan)
    heard = take(into, "LOCAL_POSITION_NED", time_boot_ms=1, vx=math.inf)
    take(into, "TERRAIN_REPORT", loaded=1, current_height=math.nan)
    assert heard.yaw_rad is heard.velocity_enu_m_s is heard.altitude_above_terrain_m is None


def test_a_height_above_ground_that_is_not_known_is_none() -> None:
    into = intake()
    assert take(into, "ALTITUDE", bottom_clearance=-1.0).altitude_above_terrain_m is None
    assert take(into, "ALTITUDE", bottom_clearance=7.5).altitude_above_terrain_m == 7.5


def test_a_message_that_is_half_a_minute_late_is_no_restart() -> None:
    into = intake()
    heard = take(into, "GLOBAL_POSITION_INT", now_s=2.0, **at(20.0, boot_ms=160_000))
    height_m = heard.altitude_above_home_m
    heard = take(into, "GLOBAL_POSITION_INT", now_s=2.3, **at(5.0, boot_ms=130_000))
    assert (heard.boots, heard.altitude_above_home_m) == (1, height_m)
    # An autopilot cannot have run for longer than since its last message.
    heard = take(into, "GLOBAL_POSITION_INT", now_s=9.0, **at(0.0, boot_ms=4_000))
    assert heard.boots == 2
