"""Cameras that turn: over ROS, MAVLink and ONVIF (docs/ptz.md)."""
