"""What the arbiter asks of a way to reach one camera.

A driver imports its transport when it is opened. `point`, `zoom` and `halt` return at once, and the
last one called counts: they are called again and again while a target or the vehicle moves.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from m2pem.api import ArbiterContext, Connection
from m2pem_plugin_ptz.gimbal import Look, Picture, Reach
from m2pem_plugin_ptz.settings import Settings


class CameraError(Exception):
    """The camera refused, or did not answer; the text is for the operator. `code`: of the error
    that the mission gets."""

    def __init__(self, reason: str, code: str = "FAILED") -> None:
        super().__init__(reason)
        self.reason = reason
        self.code = code


@dataclass(frozen=True, slots=True)
class Seat:
    """What a driver is given. `heard` is to be called whenever the camera says where it looks, or
    answers in another way; its silence makes it LOST. All time goes through `context.clock`, but
    for what bounds a call on a network."""

    connection: Connection
    settings: Settings
    context: ArbiterContext
    heard: Callable[[], None]


class CameraDriver(Protocol):
    """One way to reach one camera. Constructed as `Driver(seat)`."""

    async def open(self) -> None:
        """Listen; the camera need not be there yet.

        Raises:
            PluginError: what it needs is not installed, or the settings cannot be.
        """
        ...

    @property
    def look(self) -> Look | None:
        """Where it looks, as it said last."""
        ...

    @property
    def reach(self) -> Reach:
        """Where it can look: as the camera says, within what the fleet says."""
        ...

    def refusal(self, behavior: str) -> str:
        """Why the camera cannot do such a behavior, now or ever; "" if it can."""
        ...

    def point(self, pan_rad: float, tilt_rad: float, rate_rad_s: float | None = None) -> None:
        """Turn there, within `reach`, not faster than `rate_rad_s`, and stay."""
        ...

    def zoom(self, level: float) -> None:
        """Zoom there, within `reach`."""
        ...

    def halt(self) -> None:
        """Stop turning and zooming."""
        ...

    async def take_picture(self) -> Picture:
        """Take one picture.

        Raises:
            CameraError: it could not.
        """
        ...

    async def start_recording(self) -> None:
        """Begin a video.

        Raises:
            CameraError: it could not.
        """
        ...

    async def stop_recording(self) -> str:
        """End the video; returns where it is: a file's or the camera's own name for it.

        Raises:
            CameraError: it could not.
        """
        ...

    async def close(self) -> None:
        """Let go. The camera stays as it is."""
        ...
