"""MAVLink vehicles: ArduPilot and PX4, in the air, on land and on water (docs/mavlink.md).

The package is the entry point of the plugin: it has the hooks of `hooks`. Plugins that command a
payload import the other names from here: `open_link` opens a link to a vehicle over the sockets of
its arbiter, and `camera`, `camera_images`, `gimbal` and `gimbal_status` are the modules with the
transactions to perform on it. `signing_of` reads how the vehicle's frames are signed. A name is
loaded when it is first used.
"""

from typing import TYPE_CHECKING

from m2pem.lazy_exports import lazy_exports
from m2pem_plugin_mavlink.hooks import m2pem_check_host as m2pem_check_host
from m2pem_plugin_mavlink.hooks import m2pem_register_arbiters as m2pem_register_arbiters
from m2pem_plugin_mavlink.hooks import m2pem_register_commands as m2pem_register_commands
from m2pem_plugin_mavlink.hooks import m2pem_register_faces as m2pem_register_faces

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.link.routed_link import RoutedLink as RoutedLink
    from m2pem_plugin_mavlink.link.routed_link import open_link as open_link
    from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink as VehicleLink
    from m2pem_plugin_mavlink.microservices import camera as camera
    from m2pem_plugin_mavlink.microservices import camera_images as camera_images
    from m2pem_plugin_mavlink.microservices import gimbal as gimbal
    from m2pem_plugin_mavlink.microservices import gimbal_status as gimbal_status
    from m2pem_plugin_mavlink.microservices.message_requests import (
        SetMessageInterval as SetMessageInterval,
    )
    from m2pem_plugin_mavlink.protocol.messages import Address as Address
    from m2pem_plugin_mavlink.protocol.messages import Message as Message
    from m2pem_plugin_mavlink.protocol.messages import message_type as message_type
    from m2pem_plugin_mavlink.protocol.transaction import ExchangeError as ExchangeError
    from m2pem_plugin_mavlink.protocol.transaction import NoAnswerError as NoAnswerError
    from m2pem_plugin_mavlink.protocol.transaction import RefusedError as RefusedError
    from m2pem_plugin_mavlink.signing.policy import signing_of as signing_of

_LAZY, __getattr__ = lazy_exports(__name__, __file__)

__all__ = list(_LAZY)
