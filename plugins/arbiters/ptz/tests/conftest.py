"""Tests over ROS run where ROS is; they keep DDS on 127.0.0.1, in ROS domains of their own."""

from importlib.util import find_spec

import pytest
from m2pem_plugin_ros.loopback import keep_on_loopback
from m2pem_plugin_ros.testing import ros_domain

__all__ = ["ros_domain"]

collect_ignore_glob = [] if find_spec("rclpy") else ["test_ptz_ros_*.py"]

keep_on_loopback()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of a contract that says which of its tests are `quick`, the others are long."""
    for item in items:
        if isinstance(item, pytest.Function) and item.name not in getattr(
            item.cls, "quick", (item.name,)
        ):
            item.add_marker(pytest.mark.long)
