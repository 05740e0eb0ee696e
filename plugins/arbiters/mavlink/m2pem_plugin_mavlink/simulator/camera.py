"""A camera: a component of its own (mavlink.io, "Camera Protocol"), with a heartbeat, that takes
pictures and videos and zooms. It needs no autopilot but to know where it is."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.commands import CommandServer
from m2pem_plugin_mavlink.simulator.identity import EPOCH_S
from m2pem_plugin_mavlink.simulator.interfaces import (
    AutopilotInterface,
    CommandHandler,
    Component,
    MessageHandler,
    ReportMaker,
)
from m2pem_plugin_mavlink.simulator.messages import Command, Result, Sender

HEARTBEAT_S = 1.0
CAPACITY_MIB = 32_768.0
PICTURE_MIB, VIDEO_MIB_PER_S = 8.0, 2.0
SHORTEST_S = 0.5
"""Pictures are not taken faster."""
CAPABILITIES = (
    dialect.CAMERA_CAP_FLAGS_CAPTURE_VIDEO
    | dialect.CAMERA_CAP_FLAGS_CAPTURE_IMAGE
    | dialect.CAMERA_CAP_FLAGS_CAN_CAPTURE_IMAGE_IN_VIDEO_MODE
    | dialect.CAMERA_CAP_FLAGS_CAN_CAPTURE_VIDEO_IN_IMAGE_MODE
    | dialect.CAMERA_CAP_FLAGS_HAS_BASIC_ZOOM
)
IMAGE_MODE = 0


@dataclass(slots=True)
class Series:
    """Pictures that are still to be taken; `left` None: until it is stopped."""

    every_s: float
    left: int | None
    next_s: float


class Camera(Component):
    """`pictures`: how many it has taken; `zoom`: 0 to 100; `recording`: it takes a video.

    `untold`: so many more pictures are reported only on request. `spoilt`: so many more
    pictures cannot be taken, which is reported. `command_server`: its handlers of commands may be
    replaced by those of another camera.
    """

    component_id = dialect.MAV_COMP_ID_CAMERA

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self.pictures = 0
        self.zoom = 0.0
        self.recording = False
        self.untold = self.spoilt = 0
        self._taken: dict[int, Any] = {}
        self._last: dict[Sender, float] = {}
        self._recorded_s = 0.0
        self._used_mib = 0.0
        self._zoom_rate = 0.0
        self._series: Series | None = None
        self._beat_s = autopilot.now_s
        self._makers = self._reports()
        self.command_server = CommandServer(autopilot, self.component_id)
        self.command_server.handlers.update(self._commands())

    def messages(self) -> Mapping[str, MessageHandler]:
        """Commands that are sent to the camera."""
        return self.command_server.messages()

    def _send(self, message: Any, to: Any = None) -> None:
        self.autopilot.send(message, to, self.component_id)

    def step(self, dt_s: float) -> None:
        """Its heartbeat, the pictures that are due, the video and the zoom."""
        now_s = self.autopilot.now_s
        if now_s >= self._beat_s:
            self._beat_s = now_s + HEARTBEAT_S
            self._send(
                dialect.MAVLink_heartbeat_message(
                    dialect.MAV_TYPE_CAMERA,
                    dialect.MAV_AUTOPILOT_INVALID,
                    0,
                    0,
                    dialect.MAV_STATE_ACTIVE,
                    3,
                )
            )
        self.zoom = max(0.0, min(100.0, self.zoom + self._zoom_rate * dt_s))
        if self.recording:
            self._recorded_s += dt_s
            self._used_mib += VIDEO_MIB_PER_S * dt_s
        series = self._series
        if series is not None and now_s >= series.next_s:
            self._take_picture()
            series.next_s += series.every_s
            if series.left is not None:
                series.left -= 1
                if series.left <= 0:
                    self._series = None

    # --- commands ---------------------------------------------------------------------------------

    def _commands(self) -> Mapping[int, CommandHandler]:
        return {
            dialect.MAV_CMD_REQUEST_MESSAGE: self._request,
            dialect.MAV_CMD_IMAGE_START_CAPTURE: self._start_pictures,
            dialect.MAV_CMD_IMAGE_STOP_CAPTURE: self._stop_pictures,
            dialect.MAV_CMD_VIDEO_START_CAPTURE: lambda _: self._record(True),
            dialect.MAV_CMD_VIDEO_STOP_CAPTURE: lambda _: self._record(False),
            dialect.MAV_CMD_SET_CAMERA_ZOOM: self._set_zoom,
        }

    @property
    def _free_mib(self) -> float:
        full = self.autopilot.injected_faults.camera_full
        return 0.0 if full else max(0.0, CAPACITY_MIB - self._used_mib)

    def _request(self, command: Command) -> Result:
        if command.param1 == dialect.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED:
            taken = self._taken.get(int(command.param2))
            if taken is None:
                return Result.DENIED
            self._send(taken, command.sender.peer)
            return Result.ACCEPTED
        maker = self._makers.get(int(command.param1))
        if maker is None:
            return Result.UNSUPPORTED
        self._send(maker(), command.sender.peer)
        return Result.ACCEPTED

    def _start_pictures(self, command: Command) -> Result:
        """Parameter 2: seconds between them; 3: how many, 0 for as long as it goes; 4: of a single
        one its number, so that it is not taken twice."""
        number = command.param4 if command.param3 == 1 else 0.0
        if number and self._last.get(command.sender) == number:
            return Result.ACCEPTED
        if self._free_mib < PICTURE_MIB:
            return self._full()
        count, every_s = int(command.param3), command.param2
        if count < 0 or (count != 1 and not every_s >= SHORTEST_S):
            return Result.DENIED
        if self._series is not None:
            return Result.TEMPORARILY_REJECTED
        if number:
            self._last[command.sender] = number
        left = count if count else None
        self._series = Series(max(every_s, SHORTEST_S), left, self.autopilot.now_s)
        return Result.ACCEPTED

    def _full(self) -> Result:
        self.autopilot.warn("Camera: storage full")
        return Result.FAILED

    def _stop_pictures(self, command: Command) -> Result:
        self._series = None
        return Result.ACCEPTED

    def _record(self, on: bool) -> Result:
        if on and self._free_mib < VIDEO_MIB_PER_S:
            return self._full()
        if on and not self.recording:
            self._recorded_s = 0.0
        self.recording = on
        self._send(self._capture_status())
        return Result.ACCEPTED

    def _set_zoom(self, command: Command) -> Result:
        value = command.param2
        if not math.isfinite(value):
            return Result.DENIED
        match int(command.param1):  # CAMERA_ZOOM_TYPE: a step, continuously, to a part of its range
            case 0:
                self.zoom, self._zoom_rate = max(0.0, min(100.0, self.zoom + 10 * value)), 0.0
            case 1:
                self._zoom_rate = 20.0 * max(-1.0, min(1.0, value))
            case 2 if 0 <= value <= 100:
                self.zoom, self._zoom_rate = value, 0.0
            case _:
                return Result.DENIED
        return Result.ACCEPTED

    # --- pictures ---------------------------------------------------------------------------------

    def _take_picture(self) -> None:
        """Take a picture, and report its position to all peers."""
        if self.spoilt:
            self.spoilt -= 1
            self._tell_of_picture(taken=False)
            return
        self._used_mib += PICTURE_MIB
        self._tell_of_picture(taken=True)
        self.pictures += 1
        self.autopilot.log_event("picture", str(self.pictures))

    def _tell_of_picture(self, *, taken: bool) -> None:
        autopilot, body = self.autopilot, self.autopilot.body
        place = autopilot.frame.to_location(autopilot.position)
        half = body.yaw_rad / 2
        message = dialect.MAVLink_camera_image_captured_message(
            autopilot.boot_ms,
            int((EPOCH_S + autopilot.now_s) * 1e6),
            0,
            *place.scaled,
            round((body.up_m - autopilot.home.point.up_m) * 1e3),
            [math.cos(half), 0.0, 0.0, math.sin(half)],
            self.pictures,
            int(taken),
            f"/{self.pictures:05d}.jpg".encode() if taken else b"",
        )
        if taken:
            self._taken[self.pictures] = message
        if taken and self.untold:
            self.untold -= 1
        else:
            self._send(message)

    # --- telemetry --------------------------------------------------------------------------------

    def _reports(self) -> Mapping[int, ReportMaker]:
        return {
            dialect.MAVLINK_MSG_ID_CAMERA_INFORMATION: self._information,
            dialect.MAVLINK_MSG_ID_CAMERA_SETTINGS: self._settings,
            dialect.MAVLINK_MSG_ID_STORAGE_INFORMATION: self._storage,
            dialect.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS: self._capture_status,
        }

    def _information(self) -> Any:
        return dialect.MAVLink_camera_information_message(
            self.autopilot.boot_ms,
            list(b"m2pem".ljust(32, b"\0")),
            list(b"simulated camera".ljust(32, b"\0")),
            1,
            8.0,
            6.4,
            4.8,
            4000,
            3000,
            0,
            CAPABILITIES,
            0,
            b"",
        )

    def _settings(self) -> Any:
        return dialect.MAVLink_camera_settings_message(
            self.autopilot.boot_ms, IMAGE_MODE, self.zoom, math.nan
        )

    def _storage(self) -> Any:
        return dialect.MAVLink_storage_information_message(
            self.autopilot.boot_ms,
            1,
            1,
            dialect.STORAGE_STATUS_READY,
            CAPACITY_MIB,
            CAPACITY_MIB - self._free_mib,
            self._free_mib,
            math.nan,
            math.nan,
        )

    def _capture_status(self) -> Any:
        """Image status: 0 idle, 2 a series, of which each is taken at once."""
        series = self._series
        return dialect.MAVLink_camera_capture_status_message(
            self.autopilot.boot_ms,
            0 if series is None else 2,
            int(self.recording),
            0.0 if series is None else series.every_s,
            int(self._recorded_s * 1000) if self.recording else 0,
            self._free_mib,
            self.pictures,
        )
