"""The driver of vehicles with Nav2. It uses the actions of Nav2, its state and its speed limit."""

from m2pem_plugin_ros.drivers.nav2.driver import Nav2Driver

__all__ = ["Nav2Driver"]
