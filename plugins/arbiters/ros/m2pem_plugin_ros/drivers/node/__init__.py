"""The driver of a vehicle with an m2pem node (docs/ros-nodes.md)."""

from m2pem_plugin_ros.drivers.node.driver import NodeDriver

__all__ = ["NodeDriver"]
