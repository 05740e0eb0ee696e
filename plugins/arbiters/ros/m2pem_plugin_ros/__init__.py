"""ROS 2 vehicles: on land and on water (docs/ros.md).

Other plugins import only what `__all__` lists. Each name is loaded when it is used, so that this
package can be imported where there is no ROS. `RosRuntime`, `qos` and `messages` need rclpy.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from m2pem_plugin_ros.hooks import (
    m2pem_check_host,
    m2pem_register_arbiters,
    m2pem_register_commands,
    m2pem_register_faces,
)

if TYPE_CHECKING:
    from m2pem_plugin_ros.drivers.driver import DriverEvents
    from m2pem_plugin_ros.frames import to_local
    from m2pem_plugin_ros.installation import RosError, require_interfaces
    from m2pem_plugin_ros.interfaces import messages, set_stamp
    from m2pem_plugin_ros.interfaces.data_values import decode_data, mission_of
    from m2pem_plugin_ros.interfaces.texts import asker, bounded, named, one_line, sendable
    from m2pem_plugin_ros.interfaces.vehicle_status import write_payload_status
    from m2pem_plugin_ros.loopback import keep_on_loopback, stays_on_loopback
    from m2pem_plugin_ros.onboard.arbiter_driver import ArbiterDriver
    from m2pem_plugin_ros.onboard.node import OnboardNode
    from m2pem_plugin_ros.onboard.target_bus import TargetBus
    from m2pem_plugin_ros.runtime import RosRuntime, qos
    from m2pem_plugin_ros.settings import read_payloads, read_settings

__all__ = [
    "ArbiterDriver",
    "OnboardNode",
    "RosError",
    "RosRuntime",
    "TargetBus",
    "DriverEvents",
    "asker",
    "bounded",
    "decode_data",
    "keep_on_loopback",
    "m2pem_check_host",
    "m2pem_register_arbiters",
    "m2pem_register_commands",
    "m2pem_register_faces",
    "messages",
    "mission_of",
    "named",
    "one_line",
    "qos",
    "read_payloads",
    "read_settings",
    "require_interfaces",
    "sendable",
    "set_stamp",
    "stays_on_loopback",
    "to_local",
    "write_payload_status",
]

_MODULES = {
    "drivers.driver": "DriverEvents",
    "frames": "to_local",
    "installation": "RosError require_interfaces",
    "interfaces": "set_stamp",
    "interfaces.data_values": "decode_data mission_of",
    "interfaces.texts": "asker bounded named one_line sendable",
    "interfaces.vehicle_status": "write_payload_status",
    "loopback": "keep_on_loopback stays_on_loopback",
    "onboard.arbiter_driver": "ArbiterDriver",
    "onboard.node": "OnboardNode",
    "onboard.target_bus": "TargetBus",
    "runtime": "RosRuntime qos",
    "settings": "read_payloads read_settings",
}
_SUBMODULES = {"messages": "interfaces.messages"}
_LAZY = {name: module for module, names in _MODULES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name in _SUBMODULES:
        return import_module(f"{__name__}.{_SUBMODULES[name]}")
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LAZY[name]}"), name)
