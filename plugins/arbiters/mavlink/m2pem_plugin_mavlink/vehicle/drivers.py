"""The driver of each make of autopilot."""

from typing import TYPE_CHECKING

from m2pem_plugin_mavlink.vehicle.ardupilot import ArdupilotDriver
from m2pem_plugin_mavlink.vehicle.driver import Driver
from m2pem_plugin_mavlink.vehicle.identity import Firmware, Identity
from m2pem_plugin_mavlink.vehicle.px4 import Px4Driver

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle


def driver_of(vehicle: "Vehicle", identity: Identity) -> Driver:
    """The driver for a vehicle."""
    if identity.firmware is Firmware.PX4:
        return Px4Driver(vehicle, identity)
    return ArdupilotDriver(vehicle, identity)
