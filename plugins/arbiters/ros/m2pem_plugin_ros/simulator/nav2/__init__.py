"""A simulated Nav2 on a simulated base: its actions, its lifecycle state and its speed limit."""

from m2pem_plugin_ros.simulator.faults import Nav2Faults
from m2pem_plugin_ros.simulator.nav2.server import Nav2Server

__all__ = ["Nav2Faults", "Nav2Server"]
