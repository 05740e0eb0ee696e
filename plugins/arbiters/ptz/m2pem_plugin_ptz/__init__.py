"""Cameras that turn: over ROS, MAVLink and ONVIF (docs/ptz.md)."""

from m2pem_plugin_ptz.hooks import m2pem_register_arbiters, m2pem_register_commands

__all__ = ["m2pem_register_arbiters", "m2pem_register_commands"]
