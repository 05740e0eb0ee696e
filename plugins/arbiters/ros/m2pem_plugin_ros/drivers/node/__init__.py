"""A vehicle on which an m2pem node runs (docs/ros.md, "A vehicle with an m2pem node")."""

from m2pem_plugin_ros.drivers.node.node_driver import NodeDriver

__all__ = ["NodeDriver"]
