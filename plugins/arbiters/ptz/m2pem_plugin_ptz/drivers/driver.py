"""The interface of drivers. A driver connects to one camera.

A driver imports its transport in `open`. `point`, `zoom` and `halt` return at once, and the last
call counts: they are called repeatedly while a target or the vehicle moves.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from m2pem.api import ArbiterContext, Connection
from m2pem_plugin_ptz.gimbal import CapturedImage, PanTiltZoom, Reach
from m2pem_plugin_ptz.settings import Settings

FOUND_WITHIN_S = 10.0
"""A behavior waits so long for what is not discovered of its camera, in real time."""


class CameraError(Exception):
    """The camera refused, or did not answer; operators read the text. `code` is the error code for
    the mission."""

    def __init__(self, reason: str, code: str = "FAILED") -> None:
        super().__init__(reason)
        self.reason = reason
        self.code = code


@dataclass(frozen=True, slots=True)
class DriverSetup:
    """The arguments of a driver. `on_contact` must be called with each message of the camera;
    a camera that is silent is LOST. `context.clock` is used for all times, except timeouts of
    network calls."""

    connection: Connection
    settings: Settings
    context: ArbiterContext
    on_contact: Callable[[], None]


class CameraDriver(Protocol):
    """The connection to one camera. It is created as `Driver(setup)`."""

    async def open(self) -> None:
        """Connect. The camera need not be there yet.

        Raises:
            PluginError: a library is missing, or the settings are invalid.
        """
        ...

    @property
    def ptz(self) -> PanTiltZoom | None:
        """The last reported pan, tilt and zoom."""
        ...

    @property
    def reach(self) -> Reach:
        """The limits of the camera, within those of the fleet."""
        ...

    def refusal(self, behavior: str) -> str:
        """Return why the camera cannot do a behavior; "" if it can."""
        ...

    def point(self, pan_rad: float, tilt_rad: float, rate_rad_s: float | None = None) -> None:
        """Turn to a direction within `reach`, not faster than `rate_rad_s`, and stay."""
        ...

    def zoom(self, level: float) -> None:
        """Zoom to a level within `reach`."""
        ...

    def halt(self) -> None: ...

    async def take_picture(self) -> CapturedImage:
        """Take one picture.

        Raises:
            CameraError: the camera refused, or did not answer.
        """
        ...

    async def start_recording(self) -> None:
        """Begin a video.

        Raises:
            CameraError: the camera refused, or did not answer.
        """
        ...

    async def stop_recording(self) -> str:
        """End the video, and return its file, or the name that the camera has for it.

        Raises:
            CameraError: the camera refused, or did not answer.
        """
        ...

    async def close(self) -> None:
        """Disconnect. The camera stays as it is."""
        ...


@runtime_checkable
class Discovering(Protocol):
    """A driver whose camera is discovered: what is sent before is dropped."""

    def missing(self, behavior: str) -> str:
        """Return what of the camera a behavior needs that is not there yet; "" if nothing is."""
        ...
