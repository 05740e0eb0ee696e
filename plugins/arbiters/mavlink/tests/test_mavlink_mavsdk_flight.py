"""MAVSDK 4 flies a simulated copter."""

import asyncio
import math

import pytest
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.specification import VehicleSpec
from mavlink_mavsdk_flying import first, flying, really
from mavsdk.autopilot import Autopilot
from mavsdk.plugins.action import ActionError
from mavsdk.plugins.offboard import OffboardError, PositionNedYaw, VelocityNedYaw
from mavsdk.plugins.telemetry import FlightMode, LandedState, TelemetryError
from mavsdk.vehicle import Vehicle

HOME = Location(47.397742, 8.545594, 488.0)
COPTER = VehicleSpec(home=HOME, heading_deg=90.0, estimator_s=6.0)


@pytest.fixture
async def copter():
    async with flying(COPTER) as found:
        yield found[1]


async def mode_told(flown, mode):
    await first(flown.telemetry.subscribe_flight_mode(), lambda each: each is mode)


def distance_to_m(flown):
    north_m = (flown.real.location.latitude_deg - HOME.latitude_deg) * 111_195
    east_m = flown.real.location.longitude_deg - HOME.longitude_deg
    return north_m, east_m * 111_195 * math.cos(math.radians(HOME.latitude_deg))


# --- connect and telemetry ------------------------------------------------------------------------


async def test_a_copter_is_found_as_an_ardupilot_copter(copter):
    assert await copter.system.is_connected()
    assert await copter.system.autopilot_type() is Autopilot.ARDUPILOT
    assert await copter.system.vehicle_type() is Vehicle.MULTICOPTER


async def test_its_version_can_be_asked_for(copter):
    version = await copter.info.get_version()
    assert (version.flight_sw_major, version.flight_sw_minor) >= (4, 0)


async def test_a_copter_tells_where_it_is_when_it_is_asked_to(copter):
    await copter.ready()
    await copter.telemetry.set_rate_position(10.0)
    position = await first(copter.telemetry.subscribe_position())
    assert position.latitude_deg == pytest.approx(HOME.latitude_deg, abs=1e-5)
    assert position.longitude_deg == pytest.approx(HOME.longitude_deg, abs=1e-5)
    assert position.absolute_altitude_m == pytest.approx(488.0, abs=1.0)
    assert position.relative_altitude_m == pytest.approx(0.0, abs=1.0)


async def test_a_copter_tells_its_attitude_heading_and_velocity(copter):
    await copter.ready()
    await copter.telemetry.set_rate_attitude_euler(10.0)
    await copter.telemetry.set_rate_position(10.0)
    attitude = await first(copter.telemetry.subscribe_attitude_euler())
    heading = await first(copter.telemetry.subscribe_heading())
    velocity = await first(copter.telemetry.subscribe_velocity_ned())
    assert attitude.yaw_deg == pytest.approx(90.0, abs=2.0)
    assert heading.heading_deg == pytest.approx(90.0, abs=2.0)
    assert velocity.north_m_s == pytest.approx(0.0, abs=0.3)


async def test_a_copter_tells_of_battery_gps_and_home(copter):
    await copter.ready()
    await copter.telemetry.set_rate_battery(5.0)
    await copter.telemetry.set_rate_gps_info(5.0)
    await copter.telemetry.set_rate_home(5.0)
    battery = await first(copter.telemetry.subscribe_battery())
    gps = await first(copter.telemetry.subscribe_gps_info())
    home = await first(copter.telemetry.subscribe_home())
    assert battery.remaining_percent > 90
    assert battery.voltage_v > 10
    assert gps.num_satellites >= 6
    assert (home.latitude_deg, home.longitude_deg) == pytest.approx(
        (HOME.latitude_deg, HOME.longitude_deg), abs=1e-5
    )


async def test_a_rate_beyond_its_loop_is_denied(copter):
    with pytest.raises(TelemetryError, match="COMMAND_DENIED"):
        await copter.telemetry.set_rate_position(1000.0)


# --- health and arming ----------------------------------------------------------------------------


async def test_health_is_told_once_sys_status_is_streamed(copter):
    await copter.telemetry.set_rate_health(5.0)
    health = await first(copter.telemetry.subscribe_health(), lambda each: each.is_armable)
    assert health.is_gyrometer_calibration_ok
    assert health.is_accelerometer_calibration_ok
    assert health.is_magnetometer_calibration_ok


async def test_a_copter_is_not_armed_in_guided_before_it_knows_where_it_is():
    async with flying(VehicleSpec(estimator_s=1000.0)) as found:
        copter, said = found[1], []

        async def listen():
            async for text in copter.telemetry.subscribe_status_text():
                said.append(text.text)

        listening = asyncio.create_task(listen())
        with pytest.raises(ActionError):
            await copter.action.takeoff()  # which begins by a change to GUIDED
        await really(lambda: any("position" in text.lower() for text in said))
        listening.cancel()
        await asyncio.gather(listening, return_exceptions=True)
        assert copter.real.mode != "GUIDED"


async def test_arming_is_told(copter):
    await copter.ready()
    await copter.guided()
    await copter.action.arm()
    assert await first(copter.telemetry.subscribe_armed(), bool)
    assert copter.real.armed
    await copter.action.disarm()
    assert not await first(copter.telemetry.subscribe_armed(), lambda armed: not armed)
    assert not copter.real.armed


async def test_a_copter_is_not_disarmed_in_flight(copter):
    await copter.up(10.0)
    with pytest.raises(ActionError, match="FAILED"):
        await copter.action.disarm()
    assert copter.real.armed


# --- flying ---------------------------------------------------------------------------------------


async def test_a_copter_takes_off_to_the_altitude_that_was_set(copter):
    await copter.telemetry.set_rate_position(10.0)
    await copter.telemetry.set_rate_landed_state(5.0)
    await copter.up(12.0)
    position = await first(
        copter.telemetry.subscribe_position(), lambda each: each.relative_altitude_m > 11.5
    )
    assert position.absolute_altitude_m == pytest.approx(500.0, abs=1.0)
    state = await first(copter.telemetry.subscribe_landed_state())
    assert state in (LandedState.IN_AIR, LandedState.TAKING_OFF)
    assert copter.real.takeoffs == 1


async def test_a_copter_goes_where_it_is_told(copter):
    await copter.up(10.0)
    there = (HOME.latitude_deg + 0.0003, HOME.longitude_deg + 0.0004)
    await copter.action.goto_location(*there, 508.0, math.nan)
    await really(lambda: _near(copter, *there, 20.0))
    assert await first(copter.telemetry.subscribe_flight_mode()) is FlightMode.OFFBOARD


def _near(flown, latitude_deg, longitude_deg, up_m):
    place = flown.real.location
    return (
        abs(place.latitude_deg - latitude_deg) < 1e-5
        and abs(place.longitude_deg - longitude_deg) < 2e-5
        and abs(flown.real.up_m - up_m) < 1.0
    )


async def test_a_copter_holds(copter):
    await copter.up(10.0)
    await copter.action.goto_location(HOME.latitude_deg + 0.01, HOME.longitude_deg, 500.0, 0.0)
    await really(lambda: distance_to_m(copter)[0] > 5.0)
    await copter.action.hold()
    await mode_told(copter, FlightMode.HOLD)
    assert copter.real.mode == "BRAKE"
    before = distance_to_m(copter)[0]
    await really(lambda: not copter.real.autopilot.body.moving)
    assert distance_to_m(copter)[0] - before < 30.0


async def test_its_speed_can_be_set(copter):
    await copter.up(10.0)
    await copter.telemetry.set_rate_velocity_ned(10.0)
    await copter.action.set_current_speed(3.0)
    await copter.action.goto_location(HOME.latitude_deg + 0.002, HOME.longitude_deg, 498.0, 0.0)
    await first(copter.telemetry.subscribe_velocity_ned(), lambda each: 2.8 < each.north_m_s < 3.2)


async def test_a_copter_returns_lands_and_disarms(copter):
    await copter.up(10.0)
    await copter.action.goto_location(HOME.latitude_deg + 0.0002, HOME.longitude_deg, 498.0, 0.0)
    await really(lambda: distance_to_m(copter)[0] > 15.0)
    await copter.action.return_to_launch()
    await mode_told(copter, FlightMode.RETURN_TO_LAUNCH)
    await really(lambda: not copter.real.armed, 40.0)
    assert math.hypot(*distance_to_m(copter)) < 1.0
    assert abs(copter.real.up_m) < 0.3


async def test_a_copter_lands_where_it_is(copter):
    await copter.telemetry.set_rate_landed_state(5.0)
    await copter.up(5.0)
    await copter.action.land()
    await mode_told(copter, FlightMode.LAND)
    on_ground = LandedState.ON_GROUND
    assert await first(copter.telemetry.subscribe_landed_state(), lambda each: each is on_ground)
    await really(lambda: not copter.real.armed)


# --- offboard -------------------------------------------------------------------------------------


async def test_offboard_needs_a_setpoint_first(copter):
    await copter.up(10.0)
    with pytest.raises(OffboardError, match="NO_SETPOINT_SET"):
        await copter.offboard.start()


async def test_offboard_flies_by_velocity_until_it_is_stopped(copter):
    await copter.up(10.0)
    await copter.offboard.set_velocity_ned(VelocityNedYaw(0.0, 2.0, 0.0, 90.0))
    await copter.offboard.start()
    assert await copter.offboard.is_active()
    assert copter.real.mode == "GUIDED"
    await really(lambda: distance_to_m(copter)[1] > 10.0)
    await copter.offboard.stop()
    await really(lambda: copter.real.mode == "BRAKE")
    stopped = distance_to_m(copter)[1]
    await really(lambda: not copter.real.autopilot.body.moving)
    assert distance_to_m(copter)[1] - stopped < 5.0


async def test_offboard_goes_to_a_place_in_its_own_frame(copter):
    await copter.up(10.0)
    await copter.offboard.set_position_ned(PositionNedYaw(15.0, -8.0, -14.0, 0.0))
    await copter.offboard.start()
    await really(
        lambda: math.dist((*distance_to_m(copter), copter.real.up_m), (15.0, -8.0, 14.0)) < 1.0
    )


async def test_a_velocity_that_is_not_repeated_runs_out(copter):
    await copter.up(10.0)
    await copter.offboard.set_velocity_ned(VelocityNedYaw(0.0, 2.0, 0.0, 90.0))
    await copter.offboard.start()
    await really(lambda: distance_to_m(copter)[1] > 5.0)
    copter.offboard.destroy()  # it repeats its setpoint no more, and changes nothing else
    at = distance_to_m(copter)[1]
    await really(lambda: not copter.real.autopilot.body.moving)
    assert copter.real.mode == "GUIDED"
    assert distance_to_m(copter)[1] - at < 10.0
