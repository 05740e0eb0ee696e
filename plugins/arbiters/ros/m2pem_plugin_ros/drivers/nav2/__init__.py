"""Vehicles that Nav2 steers: its actions are given goals, and nothing else of it is touched."""

from m2pem_plugin_ros.drivers.nav2.driver import Nav2Driver

__all__ = ["Nav2Driver"]
