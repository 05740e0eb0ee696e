"""The basics of cameras (mavlink.io, "Camera Protocol v2", services/camera.html). A `device` of 0
is a camera with an address of its own; 1 to 6 are cameras behind an autopilot."""

import math
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.commands import Command
from m2pem_plugin_mavlink.microservices.message_requests import RequestMessage
from m2pem_plugin_mavlink.protocol.messages import Address, Message

_NAN = math.nan


@dataclass(frozen=True, slots=True)
class Camera:
    """The content of CAMERA_INFORMATION."""

    address: Address
    device: int
    model: str
    capabilities: int

    def has(self, capability: int) -> bool:
        """Return whether the camera has a capability (CAMERA_CAP_FLAGS)."""
        return bool(self.capabilities & capability)

    @property
    def takes_images(self) -> bool:
        """Whether the camera can take single images."""
        return self.has(dialect.CAMERA_CAP_FLAGS_CAPTURE_IMAGE)

    @property
    def records(self) -> bool:
        """Whether the camera can record videos."""
        return self.has(dialect.CAMERA_CAP_FLAGS_CAPTURE_VIDEO)

    @property
    def zooms(self) -> bool:
        """Whether the camera can zoom."""
        return self.has(dialect.CAMERA_CAP_FLAGS_HAS_BASIC_ZOOM)

    def mode_for(self, video: bool) -> int | None:
        """Return the CAMERA_MODE that recording or taking images requires; None: no certain one."""
        if not self.has(dialect.CAMERA_CAP_FLAGS_HAS_MODES):
            return None
        if video:
            anyway = dialect.CAMERA_CAP_FLAGS_CAN_CAPTURE_VIDEO_IN_IMAGE_MODE
            mode: int = dialect.CAMERA_MODE_VIDEO
        else:
            anyway = dialect.CAMERA_CAP_FLAGS_CAN_CAPTURE_IMAGE_IN_VIDEO_MODE
            mode = dialect.CAMERA_MODE_IMAGE
        return None if self.has(anyway) else mode


@dataclass(frozen=True, slots=True)
class CaptureStatus:
    """The activity of a camera (CAMERA_CAPTURE_STATUS). `images`: taken since its storage was
    formatted."""

    takes_images: bool
    records: bool
    images: int


class FindCamera(RequestMessage[Camera]):
    """Reads the camera of a component."""

    def __init__(self, target: Address, device: int = 0) -> None:
        def read(message: Message) -> Camera | None:
            if device not in (0, message.camera_device_id):
                return None
            return Camera(
                target,
                message.camera_device_id,
                _text(message.model_name),
                message.flags,
            )

        super().__init__(target, "CAMERA_INFORMATION", read)


class ReadCaptureStatus(RequestMessage[CaptureStatus]):
    """Reads the present activity of a camera."""

    def __init__(self, target: Address, device: int = 0) -> None:
        def read(message: Message) -> CaptureStatus | None:
            if device not in (0, message.camera_device_id):
                return None
            return CaptureStatus(
                takes_images=message.image_status != 0,
                records=message.video_status != 0,
                images=message.image_count,
            )

        super().__init__(target, "CAMERA_CAPTURE_STATUS", read)


class ReadZoom(RequestMessage[float]):
    """Reads the zoom of a camera: 0 is wide, 1 is narrow; NaN if the camera does not know it
    (CAMERA_SETTINGS)."""

    def __init__(self, target: Address, device: int = 0) -> None:
        def read(message: Message) -> float | None:
            if device not in (0, message.camera_device_id):
                return None
            return float(message.zoomLevel) / 100.0

        super().__init__(target, "CAMERA_SETTINGS", read)


def take_image(target: Address, sequence: int, device: int = 0) -> Command:
    """Take one image. A camera takes one for each `sequence`, which begins with 1: so a command
    that is sent again takes no second image."""
    params = (device, 0, 1, sequence, 0, 0, _NAN)
    return Command(target, dialect.MAV_CMD_IMAGE_START_CAPTURE, params)


def start_video(target: Address, status_hz: float = 0.0, device: int = 0) -> Command:
    """Start recording; `status_hz`: the rate of CAMERA_CAPTURE_STATUS."""
    params = (0, status_hz, device, _NAN, 0, 0, _NAN)
    return Command(target, dialect.MAV_CMD_VIDEO_START_CAPTURE, params)


def stop_video(target: Address, device: int = 0) -> Command:
    """Stop recording."""
    params = (0, device, _NAN, _NAN, 0, 0, _NAN)
    return Command(target, dialect.MAV_CMD_VIDEO_STOP_CAPTURE, params)


def zoom(target: Address, fraction: float, device: int = 0) -> Command:
    """Zoom to a fraction of the camera's range: 0 is wide, 1 is narrow."""
    params = (dialect.ZOOM_TYPE_RANGE, 100.0 * fraction, device, _NAN, 0, 0, _NAN)
    return Command(target, dialect.MAV_CMD_SET_CAMERA_ZOOM, params)


def stop_zoom(target: Address, device: int = 0) -> Command:
    """Stop zooming."""
    params = (dialect.ZOOM_TYPE_CONTINUOUS, 0.0, device, _NAN, 0, 0, _NAN)
    return Command(target, dialect.MAV_CMD_SET_CAMERA_ZOOM, params)


def camera_mode(target: Address, mode: int, device: int = 0) -> Command:
    """Change to a CAMERA_MODE, which some cameras must be in to take images or to record."""
    params = (device, mode, _NAN, _NAN, 0, 0, _NAN)
    return Command(target, dialect.MAV_CMD_SET_CAMERA_MODE, params)


def _text(characters: tuple[int, ...]) -> str:
    """Return the text in an array of characters."""
    return bytes(characters).partition(b"\0")[0].decode("utf-8", "replace")
