"""A plain base: it is driven from here, by velocities (docs/ros.md, "A plain base")."""

from m2pem_plugin_ros.drivers.base.driver import BaseDriver

__all__ = ["BaseDriver"]
