"""What other plugins may import, and that it loads no ROS until they use it."""

import subprocess
import sys

import m2pem_plugin_ros
import pytest

LISTED = """
import sys, m2pem_plugin_ros
m2pem_plugin_ros.write_payload_status, m2pem_plugin_ros.read_settings
print([name for name in ("rclpy", "numpy", "m2pem_plugin_ros.runtime") if name in sys.modules])
"""


def test_every_public_name_can_be_loaded() -> None:
    for name in m2pem_plugin_ros.__all__:
        assert getattr(m2pem_plugin_ros, name) is not None


def test_a_name_that_is_not_public_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'nonsense'"):
        _ = m2pem_plugin_ros.nonsense


def test_importing_the_plugin_loads_no_ros() -> None:
    done = subprocess.run(
        [sys.executable, "-c", LISTED], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
