"""MAVSDK, another ground station, sees the simulated camera do what the driver asked."""

import asyncio
import json
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import aclosing, asynccontextmanager
from typing import Any

import mavsdk
import pytest
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavsdk.asyncio import Configuration, Mavsdk
from mavsdk.asyncio.plugins.camera import CameraAsync
from mavsdk.asyncio.plugins.gimbal import GimbalAsync
from mavsdk.asyncio.plugins.mavlink_direct import (
    MavlinkDirectAsync,
    MavlinkMessage,
)
from mavsdk.component_type import ComponentType
from mavsdk.plugins.gimbal import ControlMode, GimbalMode, SendMode
from ptz_mavlink_world import AMPLE_S, World, until, world

SET_MESSAGE_INTERVAL = 511
GIMBAL_MANAGER_STATUS, GIMBAL_DEVICE_ATTITUDE_STATUS = 281, 285
OWN_SYSTEM = 245
"""MAVSDK's own."""


@asynccontextmanager
async def watched(kind: Kind = Kind.COPTER) -> AsyncIterator[tuple[World, Any]]:
    """A world, and the vehicle in it as MAVSDK has found it."""
    mavsdk.logging.log_subscribe(lambda *_: True)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    kind_of = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    station = Mavsdk(kind_of)
    try:
        await station.add_any_connection(f"udpin://127.0.0.1:{port}")
        async with world(kind, to=("127.0.0.1", port)) as it:
            async with asyncio.timeout(AMPLE_S):
                while not (systems := await station.get_systems()):  # noqa: ASYNC110
                    await asyncio.sleep(0.02)
            yield it, systems[0]
    finally:
        station.destroy()


async def ask_for_gimbal(system: Any) -> None:
    """ArduPilot speaks for its gimbal, and only to whom has asked."""
    direct = MavlinkDirectAsync(system)
    try:
        for message in (GIMBAL_DEVICE_ATTITUDE_STATUS, GIMBAL_MANAGER_STATUS):
            wanted = {"command": SET_MESSAGE_INTERVAL, "param1": message, "param2": 200_000}
            fields = json.dumps({"target_system": 1, "target_component": 1, **wanted})
            ack = await direct.send_command(MavlinkMessage("COMMAND_LONG", fields_json=fields))
            assert json.loads(ack.fields_json)["result"] == 0
    finally:
        direct.destroy()


async def first(stream: Any, true: Callable[[Any], bool]) -> Any:
    async with asyncio.timeout(AMPLE_S), aclosing(stream) as values:
        async for value in values:
            if true(value):
                return value


@pytest.mark.parametrize("kind", [Kind.COPTER, Kind.ROVER])
async def test_where_it_points_and_who_controls_it(kind: Kind) -> None:
    async with watched(kind) as (it, system):
        await it.ready()
        await ask_for_gimbal(system)
        gimbal = GimbalAsync(system)
        try:
            it.point(35.0, -20.0)

            def points(each: Any) -> bool:
                angles = each.euler_angle_forward
                near = pytest.approx((-20.0, 35.0), abs=1.0)
                return (angles.pitch_deg, angles.yaw_deg) == near

            await first(gimbal.subscribe_attitude(), points)

            def is_ours(each: Any) -> bool:
                return (each.sysid_primary_control, each.compid_primary_control) == (255, 191)

            assert await first(gimbal.subscribe_control_status(), is_ours)
        finally:
            gimbal.destroy()


async def test_a_station_that_takes_control_is_left_alone() -> None:
    async with watched() as (it, system):
        await it.ready()
        await ask_for_gimbal(system)
        it.point(35.0, -20.0)
        await until(lambda: it.is_at(35.0, -20.0))
        gimbal = GimbalAsync(system)
        try:
            found = await first(gimbal.subscribe_gimbal_list(), lambda each: each.gimbals)
            id_ = found.gimbals[0].gimbal_id
            await gimbal.take_control(id_, ControlMode.PRIMARY)
            await until(lambda: f"system {OWN_SYSTEM}" in it.driver.refusal("ptz_point_at"))
            await gimbal.set_angles(id_, 0, -45, 0, GimbalMode.YAW_FOLLOW, SendMode.ONCE)
            it.point(35.0, -20.0)
            await until(lambda: it.is_at(0.0, -45.0))
            await gimbal.release_control(id_)
            await until(lambda: it.driver.refusal("ptz_point_at") == "")
            it.point(10.0, 0.0)
            await until(lambda: it.is_at(10.0, 0.0))
        finally:
            gimbal.destroy()


async def test_pictures_and_videos() -> None:
    async with watched() as (it, system):
        await it.ready("take_picture")
        camera = CameraAsync(system)
        try:
            await first(camera.subscribe_camera_list(), lambda each: each.cameras)
            captured = camera.subscribe_capture_info()
            heard = asyncio.ensure_future(first(captured, lambda each: each.index == 0))
            await asyncio.sleep(0.1)
            picture = await it.driver.take_picture()
            info = await heard
            assert (info.file_url, info.is_success) == (picture.reference, True)
            await it.driver.start_recording()
            await first(camera.subscribe_storage(), lambda each: each.storage.video_on)
            await it.driver.stop_recording()
            await first(camera.subscribe_storage(), lambda each: not each.storage.video_on)
        finally:
            camera.destroy()
