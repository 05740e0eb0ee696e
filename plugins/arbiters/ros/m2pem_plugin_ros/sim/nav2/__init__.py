"""A simulated Nav2 on a simulated base: its actions, and what else of it a client sees."""

from m2pem_plugin_ros.sim.nav2.faults import Faults
from m2pem_plugin_ros.sim.nav2.server import Nav2Server

__all__ = ["Faults", "Nav2Server"]
