"""The driver of pan-tilt units and cameras over ROS 2 (docs/ptz.md, "ROS")."""

from m2pem_plugin_ptz.drivers.ros.driver import RosDriver

__all__ = ["RosDriver"]
