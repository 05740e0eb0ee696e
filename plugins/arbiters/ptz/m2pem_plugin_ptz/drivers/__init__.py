"""The ways to reach a camera that turns: over ROS, MAVLink and ONVIF."""

from importlib import import_module
from typing import cast

from m2pem_plugin_ptz.drivers.driver import CameraDriver, Seat
from m2pem_plugin_ptz.settings import DriverName

# Loaded for the camera that needs it: not everyone has the library of each.
_DRIVERS = {
    DriverName.ONVIF: ("onvif", "OnvifDriver"),
    DriverName.MAVLINK: ("mavlink", "MavlinkDriver"),
    DriverName.ROS: ("ros", "RosDriver"),
}


def make_driver(seat: Seat) -> CameraDriver:
    """The driver that the fleet names for a camera."""
    module, name = _DRIVERS[seat.settings.driver]
    make = getattr(import_module(f"m2pem_plugin_ptz.drivers.{module}"), name)
    return cast(CameraDriver, make(seat))
