"""The drivers of cameras that turn: over ROS, MAVLink and ONVIF."""

from importlib import import_module
from typing import cast

from m2pem_plugin_ptz.drivers.driver import CameraDriver, DriverSetup
from m2pem_plugin_ptz.settings import DriverName

# A driver is imported when a camera needs it: its library may not be installed.
_DRIVERS = {
    DriverName.ONVIF: ("onvif", "OnvifDriver"),
    DriverName.MAVLINK: ("mavlink", "MavlinkDriver"),
    DriverName.ROS: ("ros", "RosDriver"),
}


def make_driver(setup: DriverSetup) -> CameraDriver:
    """Make the driver that the fleet names."""
    module, name = _DRIVERS[setup.settings.driver]
    make = getattr(import_module(f"m2pem_plugin_ptz.drivers.{module}"), name)
    return cast(CameraDriver, make(setup))
