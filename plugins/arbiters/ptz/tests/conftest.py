"""Tests over ROS run where ROS is; they keep DDS on 127.0.0.1, in ROS domains of their own."""

from importlib.util import find_spec

from m2pem_plugin_ros.loopback import keep_on_loopback
from m2pem_plugin_ros.testing import ros_domain

__all__ = ["ros_domain"]

collect_ignore_glob = [] if find_spec("rclpy") else ["test_ptz_ros_*.py"]

keep_on_loopback()
