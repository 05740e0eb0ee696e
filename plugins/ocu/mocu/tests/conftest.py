"""`make test-ros` runs these tests. They keep DDS on 127.0.0.1, in ROS domains of their own."""

from importlib.util import find_spec

import pytest
from m2pem_plugin_ros.loopback import keep_on_loopback

collect_ignore_glob = [] if find_spec("rclpy") else ["test_*.py"]

keep_on_loopback()

pytest.register_assert_rewrite("mocu_world")

if find_spec("rclpy"):
    from mocu_world import client, clients, world

    __all__ = ["client", "clients", "world"]
