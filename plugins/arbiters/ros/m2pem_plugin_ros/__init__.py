"""ROS 2 vehicles: on land and on water (docs/ros.md).

Other plugins import only what `__all__` lists. Each name is loaded when it is used, so that this
package can be imported where there is no ROS. `RosRuntime`, `qos` and `messages` need rclpy.
"""

from typing import TYPE_CHECKING

from m2pem.lazy_exports import lazy_exports
from m2pem_plugin_ros.hooks import m2pem_check_host as m2pem_check_host
from m2pem_plugin_ros.hooks import m2pem_register_arbiters as m2pem_register_arbiters
from m2pem_plugin_ros.hooks import m2pem_register_commands as m2pem_register_commands
from m2pem_plugin_ros.hooks import m2pem_register_faces as m2pem_register_faces

if TYPE_CHECKING:
    from m2pem_plugin_ros.drivers.driver import DriverEvents as DriverEvents
    from m2pem_plugin_ros.frames import to_local as to_local
    from m2pem_plugin_ros.installation import RosError as RosError
    from m2pem_plugin_ros.installation import require_interfaces as require_interfaces
    from m2pem_plugin_ros.interfaces import messages as messages
    from m2pem_plugin_ros.interfaces import set_stamp as set_stamp
    from m2pem_plugin_ros.interfaces.data_values import check_float as check_float
    from m2pem_plugin_ros.interfaces.data_values import decode_data as decode_data
    from m2pem_plugin_ros.interfaces.data_values import mission_of as mission_of
    from m2pem_plugin_ros.interfaces.texts import asker as asker
    from m2pem_plugin_ros.interfaces.texts import bounded as bounded
    from m2pem_plugin_ros.interfaces.texts import named as named
    from m2pem_plugin_ros.interfaces.texts import one_line as one_line
    from m2pem_plugin_ros.interfaces.texts import sendable as sendable
    from m2pem_plugin_ros.interfaces.vehicle_status import (
        write_payload_status as write_payload_status,
    )
    from m2pem_plugin_ros.loopback import keep_on_loopback as keep_on_loopback
    from m2pem_plugin_ros.loopback import stays_on_loopback as stays_on_loopback
    from m2pem_plugin_ros.onboard.arbiter_driver import ArbiterDriver as ArbiterDriver
    from m2pem_plugin_ros.onboard.node import OnboardNode as OnboardNode
    from m2pem_plugin_ros.onboard.target_bus import TargetBus as TargetBus
    from m2pem_plugin_ros.runtime import RosRuntime as RosRuntime
    from m2pem_plugin_ros.runtime import qos as qos
    from m2pem_plugin_ros.sensors.health import OWN_STATUS as OWN_STATUS
    from m2pem_plugin_ros.settings import read_payloads as read_payloads
    from m2pem_plugin_ros.settings import read_settings as read_settings

_LAZY, __getattr__ = lazy_exports(__name__, __file__)

__all__ = list(_LAZY)
