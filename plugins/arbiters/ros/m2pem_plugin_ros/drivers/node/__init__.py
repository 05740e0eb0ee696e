"""A vehicle on which an m2pem node runs (docs/ros.md, "Write your own node")."""

from m2pem_plugin_ros.drivers.node.driver import NodeDriver

__all__ = ["NodeDriver"]
