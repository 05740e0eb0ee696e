"""The driver of a plain base, which takes velocities (docs/ros.md, "A plain base")."""

from m2pem_plugin_ros.drivers.base.driver import BaseDriver

__all__ = ["BaseDriver"]
