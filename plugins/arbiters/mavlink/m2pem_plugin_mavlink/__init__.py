"""MAVLink vehicles: ArduPilot and PX4, in the air, on land and on water (docs/mavlink.md).

For plugins that command what a vehicle carries: `open_link` reaches it over the sockets that its
arbiter uses, too, and the modules `camera`, `camera_images`, `gimbal` and `gimbal_status` have the
exchanges to perform there. They are loaded when they are asked for.
"""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from m2pem import hookimpl

if TYPE_CHECKING:
    import click

    from m2pem.api import Arbiter
    from m2pem_plugin_mavlink.link.routed_link import RoutedLink, open_link
    from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
    from m2pem_plugin_mavlink.microservices import camera, camera_images, gimbal, gimbal_status
    from m2pem_plugin_mavlink.microservices.intervals import SetMessageInterval
    from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
    from m2pem_plugin_mavlink.protocol.transaction import (
        ExchangeError,
        NoAnswerError,
        RefusedError,
    )

__all__ = [
    "Address",
    "ExchangeError",
    "Message",
    "NoAnswerError",
    "RefusedError",
    "RoutedLink",
    "SetMessageInterval",
    "VehicleLink",
    "camera",
    "camera_images",
    "gimbal",
    "gimbal_status",
    "message_type",
    "open_link",
]

_MODULES = {
    "link.routed_link": "RoutedLink open_link",
    "link.vehicle_link": "VehicleLink",
    "microservices.intervals": "SetMessageInterval",
    "protocol.messages": "Address Message message_type",
    "protocol.transaction": "ExchangeError NoAnswerError RefusedError",
}
_LAZY = {name: module for module, names in _MODULES.items() for name in names.split()}
_SERVICES = ("camera", "camera_images", "gimbal", "gimbal_status")


def __getattr__(name: str) -> Any:
    if name in _SERVICES:
        return import_module(f"{__name__}.microservices.{name}")
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LAZY[name]}"), name)


@hookimpl
def m2pem_register_arbiters(register: "Callable[[str, Callable[..., Arbiter]], None]") -> None:
    """Register `mavlink`."""
    from m2pem_plugin_mavlink.arbiter import MavlinkArbiter  # noqa: PLC0415  # starting up must be fast

    register("mavlink", MavlinkArbiter)


@hookimpl
def m2pem_register_commands(cli: "click.Group") -> None:
    """Add what commands.py has."""
    from m2pem_plugin_mavlink.commands import add_to  # noqa: PLC0415  # starting up must be fast

    add_to(cli.commands)
