"""Operators over ROS 2: services and topics for units such as MOCU (docs/ros-operators.md)."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    from m2pem.api.ocu import Ocu


@hookimpl
def m2pem_register_ocus(register: "Callable[[str, Callable[..., Ocu]], None]") -> None:
    """Register `mocu`."""
    from m2pem_plugin_mocu.ocu import MocuOcu  # noqa: PLC0415  # starting up must be fast

    register("mocu", MocuOcu)
