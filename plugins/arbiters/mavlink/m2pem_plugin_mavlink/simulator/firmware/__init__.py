"""Firmwares: how ArduPilot and PX4 differ. All else is the same vehicle."""

from m2pem_plugin_mavlink.simulator.interfaces import Firmware, Tuning
from m2pem_plugin_mavlink.simulator.specification import VehicleSpec

__all__ = ["FIRMWARES", "Firmware", "Tuning", "firmware_of"]

FIRMWARES = ("ardupilot", "px4")


def firmware_of(spec: VehicleSpec) -> Firmware:
    """The firmware that a specification names.

    Raises:
        ValueError: there is none of that name, or not for that kind of vehicle.
    """
    if spec.firmware == "ardupilot":
        from m2pem_plugin_mavlink.simulator.firmware.ardupilot import ArduPilot  # noqa: PLC0415

        return ArduPilot(spec)
    if spec.firmware == "px4":
        from m2pem_plugin_mavlink.simulator.firmware.px4 import Px4  # noqa: PLC0415

        return Px4(spec)
    raise ValueError(f"there is no firmware {spec.firmware!r}; there are: {', '.join(FIRMWARES)}")
