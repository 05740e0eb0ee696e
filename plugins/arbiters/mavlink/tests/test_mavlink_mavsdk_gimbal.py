"""MAVSDK 4 moves the gimbal of a simulated copter with ArduPilot."""

import math

import pytest
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.gimbal import Gimbal
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from mavlink_mavsdk_flying import first, flying, really
from mavsdk.plugins.gimbal import ControlMode, GimbalMode, SendMode
from pymavlink.dialects.v20 import ardupilotmega as dialect

HOME = Location(47.397742, 8.545594, 488.0)
COPTER = VehicleSpec(home=HOME, heading_deg=90.0, estimator_s=6.0)
ATTITUDE = dialect.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS


@pytest.fixture
async def copter():
    async with flying(COPTER) as found:
        # ArduPilot speaks for its gimbal, and without being asked says nothing of it.
        for message in (ATTITUDE, dialect.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS):
            await found[1].command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, message, 200_000)
        yield found[1]


async def gimbal_of(flown):
    """The id of its gimbal, under control from here."""
    found = await first(flown.gimbal.subscribe_gimbal_list(), lambda each: each.gimbals)
    (gimbal,) = found.gimbals
    await flown.gimbal.take_control(gimbal.gimbal_id, ControlMode.PRIMARY)
    return gimbal.gimbal_id


def points(flown):
    """Pitch and yaw to the bow, in degrees, as it really is."""
    (gimbal,) = (each for each in flown.real.autopilot.components if isinstance(each, Gimbal))
    pointing = gimbal.pointing
    return math.degrees(pointing.pitch_rad), math.degrees(pointing.yaw_rad)


async def angles_told(flown, frame, *wanted_deg):
    """Wait until these angles are told, in that frame."""

    def told(each):
        angles = getattr(each, frame)
        return (angles.pitch_deg, angles.yaw_deg) == pytest.approx(wanted_deg, abs=1.0)

    await first(flown.gimbal.subscribe_attitude(), told)


async def test_its_gimbal_is_found_with_the_autopilot_as_its_manager(copter):
    found = await first(copter.gimbal.subscribe_gimbal_list(), lambda each: each.gimbals)
    assert [each.gimbal_manager_component_id for each in found.gimbals] == [1]
    assert [each.gimbal_device_id for each in found.gimbals] == [1]


async def test_control_is_taken_and_given_back(copter):
    gimbal = await gimbal_of(copter)
    status = copter.gimbal.subscribe_control_status
    taken = await first(status(), lambda each: each.control_mode is not ControlMode.NONE)
    assert taken.sysid_primary_control == 245  # MAVSDK's own system id
    await copter.gimbal.release_control(gimbal)
    await first(status(), lambda each: each.sysid_primary_control == 0)


async def test_a_gimbal_points_to_angles_from_the_bow(copter):
    gimbal = await gimbal_of(copter)
    await copter.gimbal.set_angles(gimbal, 0, -45, 30, GimbalMode.YAW_FOLLOW, SendMode.ONCE)
    await really(lambda: points(copter) == pytest.approx((-45.0, 30.0), abs=1.0))
    await angles_told(copter, "euler_angle_forward", -45.0, 30.0)


async def test_a_gimbal_points_to_angles_from_north(copter):
    gimbal = await gimbal_of(copter)
    await copter.gimbal.set_angles(gimbal, 0, -20, 120, GimbalMode.YAW_LOCK, SendMode.ONCE)
    await angles_told(copter, "euler_angle_north", -20.0, 120.0)
    assert points(copter)[1] == pytest.approx(30.0, abs=1.0)  # its bow points to the east


async def test_a_gimbal_follows_angles_that_are_streamed(copter):
    gimbal = await gimbal_of(copter)
    await copter.gimbal.set_angles(gimbal, 0, -30, -40, GimbalMode.YAW_FOLLOW, SendMode.STREAM)
    await really(lambda: points(copter) == pytest.approx((-30.0, -40.0), abs=1.0))


async def test_a_gimbal_turns_at_rates(copter):
    gimbal = await gimbal_of(copter)
    await copter.gimbal.set_angular_rates(gimbal, 0, -5, 0, GimbalMode.YAW_FOLLOW, SendMode.ONCE)
    await really(lambda: points(copter)[0] < -20.0)


async def test_a_gimbal_watches_a_place(copter):
    await copter.up(20.0)
    gimbal = await gimbal_of(copter)
    east = HOME.longitude_deg + 20.0 / (111_195 * math.cos(math.radians(HOME.latitude_deg)))
    # MAVSDK documents a height above the sea, and sends it as one above home.
    await copter.gimbal.set_roi_location(gimbal, HOME.latitude_deg, east, 0.0)
    await really(lambda: points(copter)[0] == pytest.approx(-45.0, abs=2.0))


async def test_a_rover_has_no_gimbal():
    async with flying(VehicleSpec(Kind.ROVER, estimator_s=6.0)) as found:
        rover = found[1]
        denied = await rover.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, ATTITUDE, 200_000)
        assert denied == dialect.MAV_RESULT_DENIED
        assert not await rover.system.has_gimbal()
