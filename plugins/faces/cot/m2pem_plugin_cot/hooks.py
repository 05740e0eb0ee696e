"""The hook of this plugin: the face `cot`."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    from m2pem.api import Face


@hookimpl
def m2pem_register_faces(register: "Callable[[str, Callable[..., Face]], None]") -> None:
    """Register `cot`."""
    from m2pem_plugin_cot.face import CotFace  # noqa: PLC0415  # starting up must be fast

    register("cot", CotFace)
