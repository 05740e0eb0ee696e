"""MAVSDK, an independent client, sees and commands a mixed fleet."""

import asyncio
import math
from pathlib import Path
from typing import Any

import pytest
from mavlink_mavsdk_client import PLACES, ROVER1, UAV1, Client, at, first, fleet_on
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.camera import CameraAsync
from mavsdk.asyncio.plugins.failure import FailureAsync
from mavsdk.asyncio.plugins.follow_me import FollowMeAsync
from mavsdk.asyncio.plugins.gimbal import GimbalAsync
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.action import ActionError, ActionResult
from mavsdk.plugins.camera import CameraError, Mode
from mavsdk.plugins.failure import FailureError, FailureType, FailureUnit
from mavsdk.plugins.follow_me import Config, FollowMeError
from mavsdk.plugins.gimbal import ControlMode, GimbalError, GimbalMode, SendMode
from mavsdk.plugins.mission_raw import MissionRawError
from mavsdk.plugins.offboard import (
    Attitude,
    OffboardError,
    PositionGlobalYaw,
    PositionNedYaw,
    VelocityNedYaw,
)
from mavsdk.plugins.param import ParamError
from mavsdk.plugins.telemetry import FlightMode

from m2pem.testing import scenarios

NEAR = (38.1076, -77.3191)


@pytest.mark.tried_with(
    "MAVSDK",
    "reads the fleet on the MAVLink face",
    kind="MAVLink clients",
    result="finds all vehicles where they are",
    package="mavsdk",
)
def test_mavsdk_lists_all_vehicles_with_their_positions(tmp_path: Path) -> None:
    async def main(_: Any, sdk: Client) -> None:
        for system, place in PLACES.items():
            telemetry = sdk.plugin(TelemetryAsync, system)
            await first(telemetry.subscribe_position(), at(place, 0.1))
            await first(telemetry.subscribe_flight_mode(), lambda each: each is FlightMode.HOLD)
            await first(telemetry.subscribe_battery(), lambda each: each.remaining_percent > 50)

    fleet_on(tmp_path, main)


def test_a_command_of_mavsdk_is_refused(tmp_path: Path) -> None:
    async def main(control: Any, sdk: Client) -> None:
        action, telemetry = sdk.plugin(ActionAsync, ROVER1), sdk.plugin(TelemetryAsync, ROVER1)
        texts = telemetry.subscribe_status_text()
        told = asyncio.create_task(first(texts, lambda each: "faces.mavlink.commands" in each.text))
        with pytest.raises(ActionError) as refused:
            await action.goto_location(*NEAR, 60.0, math.nan)
        assert refused.value.result is ActionResult.COMMAND_DENIED
        await told
        assert not await control.runs()

    fleet_on(tmp_path, main)


def test_an_allowed_command_of_mavsdk_drives_the_rover(tmp_path: Path) -> None:
    async def main(control: Any, sdk: Client) -> None:
        action, telemetry = sdk.plugin(ActionAsync, ROVER1), sdk.plugin(TelemetryAsync, ROVER1)
        await action.goto_location(*NEAR, 60.0, math.nan)
        await first(telemetry.subscribe_position(), at(NEAR, 2.0))
        await first(telemetry.subscribe_flight_mode(), lambda each: each is FlightMode.HOLD)
        (run,) = await control.runs()
        assert run.status == "completed"

    fleet_on(tmp_path, main, commands=["rover1"])


def test_mavsdk_flies_a_copter_of_another_arbiter(tmp_path: Path) -> None:
    async def main(_: Any, sdk: Client) -> None:
        action, telemetry = sdk.plugin(ActionAsync, UAV1), sdk.plugin(TelemetryAsync, UAV1)
        await action.arm()
        await first(telemetry.subscribe_armed(), bool)
        await action.takeoff()
        await first(telemetry.subscribe_position(), lambda each: each.relative_altitude_m > 1)
        await action.goto_location(38.1082, -77.3190, 90.0, math.nan)
        await first(telemetry.subscribe_armed(), bool)
        await first(telemetry.subscribe_position(), at((38.1082, -77.3190), 2.0))
        await action.return_to_launch()
        await first(
            telemetry.subscribe_flight_mode(), lambda each: each is FlightMode.RETURN_TO_LAUNCH
        )
        await action.land()
        await first(telemetry.subscribe_flight_mode(), lambda each: each is FlightMode.LAND)
        await first(telemetry.subscribe_position(), lambda each: each.relative_altitude_m < 0.5)

    fleet_on(tmp_path, main, commands="all")


async def says(telemetry: Any, part: str) -> None:
    """Wait for a text of the vehicle."""
    await first(telemetry.subscribe_status_text(), lambda each: part in each.text)


@pytest.mark.parametrize("kind", ["position_ned", "velocity_ned", "attitude"])
def test_mavsdks_offboard_is_refused_with_its_cause_and_does_not_send_a_copter_home(
    tmp_path: Path, kind: str
) -> None:
    """MAVSDK 4.1 sets PX4's main mode 6, which is the number of RTL for ArduPilot's copters."""
    setpoints = {
        "position_ned": PositionNedYaw(5.0, 0.0, -5.0, 90.0),
        "velocity_ned": VelocityNedYaw(1.0, 0.0, 0.0, 0.0),
        "attitude": Attitude(0.0, 0.0, 0.0, 0.6),
    }

    async def main(control: Any, sdk: Client) -> None:
        offboard, telemetry = sdk.plugin(OffboardAsync, UAV1), sdk.plugin(TelemetryAsync, UAV1)
        told = asyncio.create_task(says(telemetry, "Offboard needs a target"))
        instead = asyncio.create_task(says(telemetry, "send SET_POSITION_TARGET_GLOBAL_INT"))
        await asyncio.sleep(0)
        await getattr(offboard, f"set_{kind}")(setpoints[kind])
        with pytest.raises(OffboardError, match="COMMAND_DENIED"):
            await offboard.start()
        await asyncio.gather(told, instead)
        assert not await control.runs()

    fleet_on(tmp_path, main, commands="all")


def test_mavsdks_offboard_flies_to_global_positions_until_it_stops(tmp_path: Path) -> None:
    async def main(control: Any, sdk: Client) -> None:
        action, telemetry = sdk.plugin(ActionAsync, UAV1), sdk.plugin(TelemetryAsync, UAV1)
        offboard = sdk.plugin(OffboardAsync, UAV1)
        await action.arm()
        await action.takeoff()
        await first(telemetry.subscribe_in_air(), bool)
        rel_home = PositionGlobalYaw.AltitudeType.REL_HOME
        outside = PositionGlobalYaw(38.2, -77.3190, 8.0, 0.0, rel_home)
        await offboard.set_position_global(outside)
        with pytest.raises(OffboardError, match="COMMAND_DENIED"):
            await offboard.start()
        target = PositionGlobalYaw(38.1081, -77.3190, 8.0, 0.0, rel_home)
        await offboard.set_position_global(target)
        await first(telemetry.subscribe_position(), at((38.1081, -77.3190), 2.0))
        await offboard.start()
        await offboard.set_position_global(PositionGlobalYaw(38.1081, -77.3185, 8.0, 0.0, rel_home))
        await first(telemetry.subscribe_position(), at((38.1081, -77.3185), 2.0))
        await offboard.stop()
        await first(telemetry.subscribe_flight_mode(), lambda each: each is FlightMode.HOLD)

    fleet_on(tmp_path, main, commands="all")


def test_mavsdks_follow_me_and_failures_are_refused_with_their_cause(tmp_path: Path) -> None:
    async def main(control: Any, sdk: Client) -> None:
        follow, telemetry = sdk.plugin(FollowMeAsync, UAV1), sdk.plugin(TelemetryAsync, UAV1)
        failure = sdk.plugin(FailureAsync, UAV1)
        parameters = sdk.plugin(ParamAsync, UAV1)
        parts = ("Follow Me is not carried out", "FLW_TGT_", "INJECT_FAILURE is not carried out")
        told = [asyncio.create_task(says(telemetry, each)) for each in parts]
        await asyncio.sleep(0)
        with pytest.raises(FollowMeError, match="SET_CONFIG_FAILED"):
            await follow.set_config(Config(8.0, 2.0, 0.02, 2, 10.0, 0.0))
        with pytest.raises(FollowMeError, match="COMMAND_DENIED"):
            await follow.start()
        with pytest.raises(FailureError, match="UNSUPPORTED"):
            await failure.inject(FailureUnit.SENSOR_GPS, FailureType.OFF, 0)
        with pytest.raises(ParamError, match="DOES_NOT_EXIST"):
            await parameters.set_param_int("SYS_FAILURE_EN", 1)
        await asyncio.gather(*told)
        assert not await control.runs()

    fleet_on(tmp_path, main, commands="all")


def test_mavsdk_takes_a_picture_and_points_the_gimbal(tmp_path: Path) -> None:
    async def main(control: Any, sdk: Client) -> None:
        camera, gimbal = sdk.plugin(CameraAsync, UAV1), sdk.plugin(GimbalAsync, UAV1)
        telemetry = sdk.plugin(TelemetryAsync, UAV1)
        eye = (await first(camera.subscribe_camera_list(), lambda each: each.cameras)).cameras[0]
        await camera.set_mode(eye.component_id, Mode.PHOTO)
        with pytest.raises(CameraError, match="DENIED"):
            await camera.set_mode(eye.component_id, Mode.VIDEO)
        await camera.take_photo(eye.component_id)
        listed = await first(gimbal.subscribe_gimbal_list(), lambda each: each.gimbals)
        own = listed.gimbals[0].gimbal_id
        await gimbal.take_control(own, ControlMode.PRIMARY)
        follows = GimbalMode.YAW_FOLLOW
        await gimbal.set_angles(own, 0.0, -60.0, 30.0, follows, SendMode.ONCE)
        looks = lambda each: (  # noqa: E731
            abs(each.euler_angle_forward.pitch_deg + 60.0) < 1.0
            and abs(each.euler_angle_forward.yaw_deg - 30.0) < 1.0
        )
        await first(gimbal.subscribe_attitude(), looks)
        cause = asyncio.create_task(says(telemetry, "pointed by a pitch and a yaw angle"))
        await asyncio.sleep(0)
        with pytest.raises(GimbalError):
            await gimbal.set_angular_rates(own, 0.0, 5.0, 0.0, follows, SendMode.ONCE)
        await cause
        await gimbal.release_control(own)
        began = [each.mission for each in await control.runs()]
        assert sorted(began) == ["ptz_point_at of uav1/eye", "take_picture of uav1/eye"]

    fleet_on(tmp_path, main, commands="all")


@pytest.mark.tried_with(
    "MAVSDK",
    "downloads the plan of a run on the MAVLink face, and uploads one",
    kind="MAVLink clients",
    result="reads it; the upload is refused",
    package="mavsdk",
)
def test_mavsdk_downloads_the_plan_and_may_not_upload_one(tmp_path: Path) -> None:
    async def main(control: Any, sdk: Client) -> None:
        missions = sdk.plugin(MissionRawAsync, ROVER1)
        telemetry = sdk.plugin(TelemetryAsync, ROVER1)
        assert await missions.download_mission() == []
        route = scenarios.one_behavior("single_vehicle_routing", "rover1", route="round")
        run = await control.start(route)
        await first(telemetry.subscribe_flight_mode(), lambda each: each is FlightMode.MISSION)
        items = await missions.download_mission()
        places = [(each.x / 1e7, each.y / 1e7) for each in items]
        assert places == [(38.1075, -77.3190), (38.1075, -77.3180), (38.1085, -77.3180)]
        assert len(await missions.download_geofence()) == 4
        with pytest.raises(MissionRawError):
            await missions.upload_mission(items)
        await control.stop(run)

    fleet_on(tmp_path, main, speed=1.0)


@pytest.mark.tried_with(
    "MAVSDK",
    "looks for cameras and gimbals on the MAVLink face",
    kind="MAVLink clients",
    result="finds both",
    package="mavsdk",
)
def test_mavsdk_finds_the_camera_and_the_gimbal(tmp_path: Path) -> None:
    async def main(_: Any, sdk: Client) -> None:
        gimbal, camera = sdk.plugin(GimbalAsync, UAV1), sdk.plugin(CameraAsync, UAV1)
        listed = await first(gimbal.subscribe_gimbal_list(), lambda each: each.gimbals)
        assert listed.gimbals[0].vendor_name == "m2pem"
        cameras = await first(camera.subscribe_camera_list(), lambda each: each.cameras)
        assert cameras.cameras[0].model_name == "eye"

    fleet_on(tmp_path, main)
