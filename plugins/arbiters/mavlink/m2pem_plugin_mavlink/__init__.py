"""MAVLink vehicles: ArduPilot and PX4, in the air, on land and on water (docs/mavlink.md).

The package is the entry point of the plugin: it has the hooks of `hooks`. Plugins that command a
payload import the other names from here: `open_link` opens a link to a vehicle over the sockets of
its arbiter, and `camera`, `camera_images`, `gimbal` and `gimbal_status` are the modules with the
transactions to perform on it. `signing_of` reads how the vehicle's frames are signed. A name is
loaded when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from m2pem_plugin_mavlink.hooks import (
    m2pem_check_host,
    m2pem_register_arbiters,
    m2pem_register_commands,
    m2pem_register_faces,
)

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.link.routed_link import RoutedLink, open_link
    from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
    from m2pem_plugin_mavlink.microservices import camera, camera_images, gimbal, gimbal_status
    from m2pem_plugin_mavlink.microservices.message_requests import SetMessageInterval
    from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
    from m2pem_plugin_mavlink.protocol.transaction import (
        ExchangeError,
        NoAnswerError,
        RefusedError,
    )
    from m2pem_plugin_mavlink.signing.policy import signing_of

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
    "m2pem_check_host",
    "m2pem_register_arbiters",
    "m2pem_register_commands",
    "m2pem_register_faces",
    "message_type",
    "open_link",
    "signing_of",
]

_MODULES = {
    "link.routed_link": "RoutedLink open_link",
    "link.vehicle_link": "VehicleLink",
    "microservices.message_requests": "SetMessageInterval",
    "protocol.messages": "Address Message message_type",
    "protocol.transaction": "ExchangeError NoAnswerError RefusedError",
    "signing.policy": "signing_of",
}
_LAZY = {name: module for module, names in _MODULES.items() for name in names.split()}
_SERVICES = ("camera", "camera_images", "gimbal", "gimbal_status")


def __getattr__(name: str) -> Any:
    if name in _SERVICES:
        return import_module(f"{__name__}.microservices.{name}")
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LAZY[name]}"), name)
