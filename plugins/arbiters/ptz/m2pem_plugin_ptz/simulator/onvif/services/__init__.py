"""The services of the simulated camera, one module for each."""

from collections.abc import Callable, Mapping
from typing import TypeAlias

from m2pem_plugin_ptz.simulator.onvif.camera import Camera
from m2pem_plugin_ptz.simulator.onvif.soap import Element, FaultError

PROFILE = "profile_1"
CONFIGURATION = "ptz_1"
NODE = "node_1"
SOURCE = "video_1"

Operation: TypeAlias = Callable[[Camera, Element, str], str]
"""Returns the content of the response for the camera, the request, and the camera's own URL."""

Operations: TypeAlias = Mapping[str, Operation]


def know(asked: str, *tokens: str, what: str = "profile") -> None:
    """Check that a token is known.

    Raises:
        FaultError: it is not.
    """
    if asked not in tokens:
        raise FaultError(f"there is no {what} {asked!r}", "InvalidArgVal", "NoEntity")
