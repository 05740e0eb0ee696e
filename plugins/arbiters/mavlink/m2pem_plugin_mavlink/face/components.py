"""Payloads as MAVLink components: cameras, and the gimbals that the autopilot manages for them
(mavlink.io, "Camera Protocol" and "Gimbal Protocol v2")."""

import math
from collections.abc import Callable, Collection, Mapping

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import Fleet, PayloadState, ResourceId
from m2pem_plugin_mavlink.face.telemetry import MAVLINK_VERSION
from m2pem_plugin_mavlink.face.vehicle import CAMERA, MOST_CAMERAS, Camera
from m2pem_plugin_mavlink.protocol.messages import Message, message_type

VENDOR = b"m2pem"
MOST_GIMBALS = 6
"""GIMBAL_DEVICE ids 1 to 6 are those that a gimbal manager speaks for."""

_GIMBAL_CAPABILITIES = (
    dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_PITCH_AXIS
    | dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_AXIS
    | dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_FOLLOW
    | dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_LOCK
    | dialect.GIMBAL_MANAGER_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL
)
_DEVICE_FLAGS = 4 | 8 | 32
"""GIMBAL_DEVICE_FLAGS: roll and pitch from the horizon, yaw from the vehicle."""

PITCH_RAD = (-math.pi / 2, math.pi / 2)
YAW_RAD = (-math.pi, math.pi)

Makers = Mapping[int, Callable[[Camera], Message]]


def cameras_of(
    vehicle: ResourceId, fleet: Fleet, behaviors: Mapping[ResourceId, Collection[str]]
) -> list[Camera]:
    """Return the payloads of a vehicle that are cameras or turn, as components."""
    cameras: list[Camera] = []
    gimbals = 0
    for payload in fleet.vehicles[vehicle].payloads:
        own = behaviors.get(payload, ())
        turns = "ptz_point_at" in own and gimbals < MOST_GIMBALS
        if len(cameras) == MOST_CAMERAS or not (turns or "take_picture" in own):
            continue
        gimbals += turns
        cameras.append(
            Camera(
                payload,
                CAMERA + len(cameras),
                gimbals if turns else 0,
                "take_picture" in own,
            )
        )
    return cameras


def camera_heartbeat() -> Message:
    """HEARTBEAT of a camera."""
    return message_type("HEARTBEAT").make(
        type=dialect.MAV_TYPE_CAMERA,
        autopilot=dialect.MAV_AUTOPILOT_INVALID,
        system_status=dialect.MAV_STATE_ACTIVE,
        mavlink_version=MAVLINK_VERSION,
    )


def _text(text: str, size: int) -> bytes:
    return text.encode("ascii", "replace")[: size - 1]


def _camera_information(camera: Camera) -> Message:
    name = camera.resource.partition("/")[2]
    return message_type("CAMERA_INFORMATION").make(
        time_boot_ms=_ms(camera),
        vendor_name=_array(VENDOR, 32),
        model_name=_array(_text(name, 32), 32),
        focal_length=math.nan,
        sensor_size_h=math.nan,
        sensor_size_v=math.nan,
        flags=dialect.CAMERA_CAP_FLAGS_CAPTURE_IMAGE if camera.takes_pictures else 0,
        gimbal_device_id=camera.gimbal_device,
    )


def _camera_settings(camera: Camera) -> Message:
    return message_type("CAMERA_SETTINGS").make(
        time_boot_ms=_ms(camera), zoomLevel=math.nan, focusLevel=math.nan
    )


def _capture_status(camera: Camera) -> Message:
    return message_type("CAMERA_CAPTURE_STATUS").make(
        time_boot_ms=_ms(camera), image_count=camera.pictures
    )


def _storage(camera: Camera) -> Message:
    return message_type("STORAGE_INFORMATION").make(
        time_boot_ms=_ms(camera),
        storage_id=1,
        storage_count=1,
        status=dialect.STORAGE_STATUS_NOT_SUPPORTED,
    )


CAMERA_MAKERS: Makers = {
    message_type("CAMERA_INFORMATION").id: _camera_information,
    message_type("CAMERA_SETTINGS").id: _camera_settings,
    message_type("CAMERA_CAPTURE_STATUS").id: _capture_status,
    message_type("STORAGE_INFORMATION").id: _storage,
}
"""What a camera sends on request."""


def _manager_information(camera: Camera) -> Message:
    return message_type("GIMBAL_MANAGER_INFORMATION").make(
        time_boot_ms=_ms(camera),
        cap_flags=_GIMBAL_CAPABILITIES,
        gimbal_device_id=camera.gimbal_device,
        pitch_min=PITCH_RAD[0],
        pitch_max=PITCH_RAD[1],
        yaw_min=YAW_RAD[0],
        yaw_max=YAW_RAD[1],
    )


def _manager_status(camera: Camera) -> Message:
    return message_type("GIMBAL_MANAGER_STATUS").make(
        time_boot_ms=_ms(camera),
        flags=_DEVICE_FLAGS,
        gimbal_device_id=camera.gimbal_device,
        primary_control_sysid=camera.controller.system,
        primary_control_compid=camera.controller.component,
    )


def _device_information(camera: Camera) -> Message:
    name = _text(camera.resource.partition("/")[2], 32)
    return message_type("GIMBAL_DEVICE_INFORMATION").make(
        time_boot_ms=_ms(camera),
        vendor_name=VENDOR,
        model_name=name,
        custom_name=name,
        cap_flags=_GIMBAL_CAPABILITIES & 0xFFFF,
        pitch_min=PITCH_RAD[0],
        pitch_max=PITCH_RAD[1],
        yaw_min=YAW_RAD[0],
        yaw_max=YAW_RAD[1],
        gimbal_device_id=camera.gimbal_device,
    )


def _device_attitude(camera: Camera) -> Message:
    state = camera.state
    pan_rad = state.pan_rad if state is not None and state.pan_rad is not None else 0.0
    tilt_rad = state.tilt_rad if state is not None and state.tilt_rad is not None else 0.0
    cp, sp = math.cos(tilt_rad / 2), math.sin(tilt_rad / 2)
    cy, sy = math.cos(pan_rad / 2), math.sin(pan_rad / 2)
    return message_type("GIMBAL_DEVICE_ATTITUDE_STATUS").make(
        time_boot_ms=_ms(camera),
        flags=_DEVICE_FLAGS,
        q=(cp * cy, -sp * sy, sp * cy, cp * sy),
        angular_velocity_x=math.nan,
        angular_velocity_y=math.nan,
        angular_velocity_z=math.nan,
        delta_yaw=math.nan,
        delta_yaw_velocity=math.nan,
        gimbal_device_id=camera.gimbal_device,
    )


GIMBAL_MAKERS: Makers = {
    message_type("GIMBAL_MANAGER_INFORMATION").id: _manager_information,
    message_type("GIMBAL_MANAGER_STATUS").id: _manager_status,
    message_type("GIMBAL_DEVICE_INFORMATION").id: _device_information,
    message_type("GIMBAL_DEVICE_ATTITUDE_STATUS").id: _device_attitude,
}
"""What the autopilot sends of each gimbal that it manages."""


def _ms(camera: Camera) -> int:
    state: PayloadState | None = camera.state
    return state.time_us // 1000 & 0xFFFFFFFF if state is not None else 0


def _array(text: bytes, size: int) -> tuple[int, ...]:
    return tuple(text.ljust(size, b"\0"))
