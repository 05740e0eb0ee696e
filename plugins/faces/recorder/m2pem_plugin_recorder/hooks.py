"""The hooks of this plugin: the faces `recorder` and `foxglove`, and the formats of exports."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    from m2pem.api import Face


@hookimpl
def m2pem_register_faces(register: "Callable[[str, Callable[..., Face]], None]") -> None:
    """Register `recorder` and `foxglove`."""
    from m2pem_plugin_recorder.faces import FoxgloveFace, RecorderFace  # noqa: PLC0415

    register("recorder", RecorderFace)
    register("foxglove", FoxgloveFace)
