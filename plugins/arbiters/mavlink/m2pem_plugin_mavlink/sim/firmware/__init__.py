"""Firmwares: how ArduPilot and PX4 differ. All else is the same vehicle."""

from m2pem_plugin_mavlink.sim.firmware.firmware import Firmware, Tuning
from m2pem_plugin_mavlink.sim.specification import VehicleSpec

__all__ = ["FIRMWARES", "Firmware", "Tuning", "firmware_of"]

FIRMWARES = ("ardupilot",)


def firmware_of(spec: VehicleSpec) -> Firmware:
    """The firmware that a specification names.

    Raises:
        ValueError: there is none of that name.
    """
    if spec.firmware == "ardupilot":
        from m2pem_plugin_mavlink.sim.firmware.ardupilot import ArduPilot  # noqa: PLC0415

        return ArduPilot(spec)
    raise ValueError(f"there is no firmware {spec.firmware!r}; there are: {', '.join(FIRMWARES)}")
