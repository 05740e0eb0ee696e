"""MAVSDK 4 flies a simulated PX4, by its own rules for PX4."""

import asyncio
import math
import socket
from collections.abc import AsyncGenerator, AsyncIterator, Callable
from contextlib import aclosing, suppress
from typing import Any

import pytest
from m2pem_plugin_mavlink.simulator.simulator import SimulatedVehicle, Simulator
from m2pem_plugin_mavlink.simulator.specification import ZURICH, VehicleSpec
from mavsdk import logging as mavsdk_log
from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.gimbal import GimbalAsync
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.autopilot import Autopilot
from mavsdk.plugins.action import ActionError, OrbitYawBehavior
from mavsdk.plugins.gimbal import ControlMode, GimbalMode, SendMode
from mavsdk.plugins.mission_raw import MissionItem, MissionRawError
from mavsdk.plugins.offboard import OffboardError, PositionNedYaw, VelocityNedYaw
from mavsdk.plugins.telemetry import FlightMode

NAN = math.nan
WITHIN_S = 40.0


class Flown:
    """The vehicle: MAVSDK's plugins for it, and what is true (`real`)."""

    def __init__(self, system: Any, real: SimulatedVehicle) -> None:
        self.system, self.real = system, real
        self.action, self.telemetry = ActionAsync(system), TelemetryAsync(system)
        self.missions, self.offboard = MissionRawAsync(system), OffboardAsync(system)
        self.gimbal, self.param = GimbalAsync(system), ParamAsync(system)

    def release(self) -> None:
        mine = (self.action, self.telemetry, self.missions, self.offboard, self.gimbal, self.param)
        for plugin in mine:
            plugin.destroy()

    async def mode(self, mode: FlightMode) -> None:
        await first(self.telemetry.subscribe_flight_mode(), lambda each: each is mode)

    async def up(self, height_m: float = 10.0) -> "Flown":
        await first(self.telemetry.subscribe_health_all_ok(), bool)
        await self.action.set_takeoff_altitude(height_m)
        await self.action.arm()
        await self.action.takeoff()
        await self.mode(FlightMode.HOLD)
        return self


async def first(stream: AsyncGenerator[Any, None], true: Callable[[Any], bool]) -> Any:
    async with asyncio.timeout(WITHIN_S), aclosing(stream):
        async for value in stream:
            if true(value):
                return value


@pytest.fixture
async def copter() -> AsyncIterator[Flown]:
    mavsdk_log.log_subscribe(lambda *_: True)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
    # MAVSDK sends setpoints 20 times a second, but not of simulated ones.
    spec = VehicleSpec(firmware="px4", parameters={"COM_OF_LOSS_T": 10}, estimator_s=6.0)
    async with Simulator([spec], speed=20, to=("127.0.0.1", port)) as sim:
        system = await mavsdk.first_autopilot(WITHIN_S)
        assert system is not None
        flown = Flown(system, sim[1])
        yield flown
        flown.release()
    mavsdk.destroy()


def items(*places: tuple[float, float]) -> list[MissionItem]:
    """A takeoff, and places (metres north and east of home) at a height of 12 m."""
    return [
        MissionItem(
            seq,
            6,
            16 if seq else 22,
            int(seq == 0),
            1,
            0.0,
            0.0,
            0.0,
            NAN,
            round((ZURICH.latitude_deg + north_m / 111_195) * 1e7),
            round((ZURICH.longitude_deg + east_m / 75_300) * 1e7),
            12.0,
            0,
        )
        for seq, (north_m, east_m) in enumerate([(0.0, 0.0), *places])
    ]


async def test_a_simulated_px4_is_found_as_px4_and_becomes_healthy(copter: Flown) -> None:
    assert await copter.system.autopilot_type() is Autopilot.PX4
    health = await first(copter.telemetry.subscribe_health(), lambda each: each.is_armable)
    assert health.is_global_position_ok
    await first(copter.telemetry.subscribe_health_all_ok(), bool)
    assert await first(copter.telemetry.subscribe_flight_mode(), bool) is FlightMode.HOLD


async def test_parameters_that_are_whole_numbers_are_read_and_set(copter: Flown) -> None:
    assert await copter.param.get_param_int("GF_ACTION") == 2
    await copter.param.set_param_int("NAV_DLL_ACT", 3)
    assert copter.real.autopilot.parameters["NAV_DLL_ACT"] == 3
    assert await copter.param.get_param_float("RTL_RETURN_ALT") == 60.0


async def test_a_simulated_px4_is_not_armed_before_it_is_healthy(copter: Flown) -> None:
    copter.real.faults.refuse_arming("Compass not calibrated")
    with pytest.raises(ActionError):
        await copter.action.arm()
    assert not copter.real.armed


async def test_a_simulated_px4_takes_off_goes_to_a_place_and_returns(copter: Flown) -> None:
    await copter.up(10.0)
    assert copter.real.up_m == pytest.approx(10, abs=0.6)
    latitude, longitude = ZURICH.latitude_deg + 0.0003, ZURICH.longitude_deg + 0.0003
    await copter.action.goto_location(latitude, longitude, 503.0, NAN)
    await first(
        copter.telemetry.subscribe_position(),
        lambda p: abs(p.latitude_deg - latitude) < 5e-6 and abs(p.absolute_altitude_m - 503) < 0.5,
    )
    assert copter.real.location.longitude_deg == pytest.approx(longitude, abs=1e-5)
    await copter.action.return_to_launch()
    await copter.mode(FlightMode.RETURN_TO_LAUNCH)
    await first(copter.telemetry.subscribe_armed(), lambda armed: not armed)
    assert copter.real.location[:2] == pytest.approx(ZURICH[:2], abs=1e-5)


@pytest.mark.long
async def test_a_simulated_px4_lands_where_it_is(copter: Flown) -> None:
    await copter.up(5.0)
    await copter.action.land()
    await copter.mode(FlightMode.LAND)
    await first(copter.telemetry.subscribe_armed(), lambda armed: not armed)
    assert copter.real.up_m == pytest.approx(0, abs=0.1)


@pytest.mark.long
async def test_a_simulated_px4_orbits_and_holds(copter: Flown) -> None:
    await copter.up(10.0)
    place = (ZURICH.latitude_deg, ZURICH.longitude_deg, 500.0)
    await copter.action.do_orbit(20.0, 5.0, OrbitYawBehavior.HOLD_FRONT_TO_CIRCLE_CENTER, *place)
    center = copter.real.autopilot.home.point
    await first(
        copter.telemetry.subscribe_position_velocity_ned(),
        lambda _: abs(copter.real.autopilot.position.distance_m(center) - 20) < 1,
    )
    assert copter.real.mode == "POSCTL.ORBIT"
    await copter.action.hold()
    await copter.mode(FlightMode.HOLD)


@pytest.mark.tried_with(
    "MAVSDK",
    "uploads a mission to `m2pem sim mavlink`",
    kind="MAVLink clients",
    result="is flown to its end",
    package="mavsdk",
)
async def test_a_mission_is_flown_to_its_end(copter: Flown) -> None:
    await copter.up(10.0)
    await copter.missions.upload_mission(items((20.0, 0.0), (20.0, 20.0)))
    assert len(await copter.missions.download_mission()) == 3
    async with asyncio.timeout(WITHIN_S):
        while copter.real.mode != "AUTO.MISSION":
            with suppress(MissionRawError):  # it checks the mission at first
                await copter.missions.start_mission()
    await first(
        copter.missions.subscribe_mission_progress(), lambda each: each.current == each.total == 3
    )
    await copter.mode(FlightMode.HOLD)
    assert copter.real.missions_begun == 1


@pytest.mark.long
async def test_offboard_flies_by_velocity_and_to_a_place(copter: Flown) -> None:
    await copter.up(10.0)
    with pytest.raises(OffboardError, match="NO_SETPOINT_SET"):
        await copter.offboard.start()
    await copter.offboard.set_velocity_ned(VelocityNedYaw(2.0, 0.0, 0.0, 0.0))
    await copter.offboard.start()
    await copter.mode(FlightMode.OFFBOARD)
    await first(
        copter.telemetry.subscribe_position_velocity_ned(), lambda each: each.position.north_m > 5
    )
    await copter.offboard.set_position_ned(PositionNedYaw(10.0, 10.0, -15.0, 0.0))
    await first(
        copter.telemetry.subscribe_position_velocity_ned(),
        lambda each: (
            math.dist(
                (each.position.north_m, each.position.east_m, each.position.down_m), (10, 10, -15)
            )
            < 1
        ),
    )
    await copter.offboard.stop()
    await copter.mode(FlightMode.HOLD)


async def test_its_gimbal_is_listed_taken_and_turned(copter: Flown) -> None:
    listed = await first(copter.gimbal.subscribe_gimbal_list(), lambda each: each.gimbals)
    id_ = listed.gimbals[0].gimbal_id
    await copter.gimbal.take_control(id_, ControlMode.PRIMARY)
    await copter.gimbal.set_angles(id_, 0.0, -45.0, 30.0, GimbalMode.YAW_FOLLOW, SendMode.ONCE)
    await first(
        copter.gimbal.subscribe_attitude(),
        lambda each: (
            abs(each.euler_angle_forward.pitch_deg + 45) < 1
            and abs(each.euler_angle_forward.yaw_deg - 30) < 1
        ),
    )
    await copter.gimbal.release_control(id_)
