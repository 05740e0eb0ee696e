"""MAVSDK 4 drives a simulated rover; and several vehicles at one port."""

import asyncio
import math

import pytest
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from mavlink_mavsdk_flying import first, flying, really
from mavsdk.autopilot import Autopilot
from mavsdk.plugins.action import ActionError
from mavsdk.plugins.offboard import VelocityNedYaw
from mavsdk.plugins.telemetry import FlightMode
from mavsdk.vehicle import Vehicle

HOME = Location(47.397742, 8.545594, 488.0)
NORTH = (HOME.latitude_deg + 0.0002, HOME.longitude_deg)
ROVER = VehicleSpec(Kind.ROVER, home=HOME, estimator_s=6.0)


@pytest.fixture
async def rover():
    async with flying(ROVER) as found:
        yield found[1]


async def to_go(rover):
    await rover.ready()
    await rover.guided()
    await rover.action.arm()


def north_m(flown):
    return (flown.real.location.latitude_deg - HOME.latitude_deg) * 111_195


async def test_a_rover_is_found_as_an_ardupilot_rover(rover):
    assert await rover.system.autopilot_type() is Autopilot.ARDUPILOT
    assert await rover.system.vehicle_type() is Vehicle.ROVER


async def test_a_rover_tells_where_it_is(rover):
    await rover.ready()
    await rover.telemetry.set_rate_position(10.0)
    position = await first(rover.telemetry.subscribe_position())
    assert position.latitude_deg == pytest.approx(HOME.latitude_deg, abs=1e-5)
    assert position.absolute_altitude_m == pytest.approx(488.0, abs=1.0)


async def test_health_is_told_once_sys_status_is_streamed(rover):
    await rover.telemetry.set_rate_health(5.0)
    assert await first(rover.telemetry.subscribe_health(), lambda each: each.is_armable)


async def test_a_rover_is_armed_and_disarmed(rover):
    await to_go(rover)
    assert rover.real.armed
    assert await first(rover.telemetry.subscribe_armed(), bool)
    await rover.action.disarm()
    assert not rover.real.armed


async def test_a_rover_does_not_take_off(rover):
    await to_go(rover)
    with pytest.raises(ActionError):
        await rover.action.takeoff()


async def test_a_rover_goes_where_it_is_told_and_holds(rover):
    await to_go(rover)
    await rover.action.goto_location(
        HOME.latitude_deg + 0.0002, HOME.longitude_deg, 488.0, math.nan
    )
    await really(lambda: north_m(rover) > 10.0)
    await rover.action.hold()
    await first(rover.telemetry.subscribe_flight_mode(), lambda mode: mode is FlightMode.HOLD)
    stopped = north_m(rover)
    await really(lambda: not rover.real.autopilot.body.moving)
    assert north_m(rover) - stopped < 3.0


@pytest.mark.long
async def test_a_rover_drives_home(rover):
    await to_go(rover)
    await rover.action.goto_location(
        HOME.latitude_deg + 0.0002, HOME.longitude_deg, 488.0, math.nan
    )
    await really(lambda: north_m(rover) > 15.0)
    await rover.action.return_to_launch()
    assert rover.real.mode == "RTL"
    await really(lambda: abs(north_m(rover)) < 3.0)


@pytest.mark.long
async def test_offboard_drives_by_velocity(rover):
    await to_go(rover)
    await rover.offboard.set_velocity_ned(VelocityNedYaw(1.5, 0.0, 0.0, 0.0))
    await rover.offboard.start()
    assert rover.real.mode == "GUIDED"
    await really(lambda: north_m(rover) > 5.0)
    await rover.offboard.stop()
    assert rover.real.mode == "HOLD"


async def test_several_vehicles_at_one_port_are_each_commanded_alone():
    specs = (
        VehicleSpec(home=HOME, estimator_s=6.0),
        VehicleSpec(system=2, estimator_s=6.0),
        VehicleSpec(Kind.ROVER, system=3, estimator_s=6.0),
    )
    async with flying(*specs) as found:
        await asyncio.gather(*(each.ready() for each in found.values()))
        await asyncio.gather(*(each.guided() for each in found.values()))
        await asyncio.gather(found[2].action.arm(), found[3].action.arm())
        assert [each.real.armed for _, each in sorted(found.items())] == [False, True, True]
        await found[2].action.set_takeoff_altitude(5.0)
        await found[2].action.takeoff()
        await really(lambda: found[2].real.up_m > 4.5)
        assert found[1].real.up_m == pytest.approx(0.0, abs=0.1)
