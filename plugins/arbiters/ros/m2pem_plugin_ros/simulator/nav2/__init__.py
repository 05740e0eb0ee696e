"""A simulated Nav2 on a simulated base: its actions, and what else of it a client sees."""

from m2pem_plugin_ros.simulator.faults import Faults
from m2pem_plugin_ros.simulator.nav2.server import Nav2Server

__all__ = ["Faults", "Nav2Server"]
