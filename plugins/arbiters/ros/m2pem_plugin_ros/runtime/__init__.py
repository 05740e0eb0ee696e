"""rclpy within asyncio. The import raises RosError where ROS 2 cannot be used, and says why."""

from m2pem_plugin_ros.installation import RosError, require_ros

require_ros()

from m2pem_plugin_ros.runtime import qos  # noqa: E402  # rclpy is there, as was just checked
from m2pem_plugin_ros.runtime.calls import RosTimeoutError  # noqa: E402
from m2pem_plugin_ros.runtime.ros_runtime import Inbox, RosRuntime, own_nodes  # noqa: E402

__all__ = ["Inbox", "RosError", "RosRuntime", "RosTimeoutError", "own_nodes", "qos"]
