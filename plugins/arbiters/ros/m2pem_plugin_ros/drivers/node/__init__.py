"""The driver of a vehicle with an m2pem node (docs/ros.md, "Write your own node")."""

from m2pem_plugin_ros.drivers.node.driver import NodeDriver

__all__ = ["NodeDriver"]
