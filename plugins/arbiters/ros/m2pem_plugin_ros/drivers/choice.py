"""Which driver reaches a vehicle: what the fleet says, loaded when it is needed."""

from importlib import import_module
from typing import cast

from m2pem_plugin_ros.drivers.driver import Driver, Seat
from m2pem_plugin_ros.settings import DriverName

_DRIVERS = {
    DriverName.NODE: ("m2pem_plugin_ros.drivers.node", "NodeDriver"),
    DriverName.NAV2: ("m2pem_plugin_ros.drivers.nav2", "Nav2Driver"),
    DriverName.BASE: ("m2pem_plugin_ros.drivers.base", "BaseDriver"),
}


def make_driver(seat: Seat) -> Driver:
    """The driver for a seat; not open yet.

    Raises:
        RosError: it needs a package of ROS that is not installed.
    """
    module, name = _DRIVERS[seat.settings.driver]
    return cast("Driver", getattr(import_module(module), name)(seat))
