"""Cameras over MAVLink: gimbal manager and camera protocol (docs/ptz.md, "MAVLink")."""

from m2pem_plugin_ptz.drivers.mavlink.driver import MavlinkDriver

__all__ = ["MavlinkDriver"]
