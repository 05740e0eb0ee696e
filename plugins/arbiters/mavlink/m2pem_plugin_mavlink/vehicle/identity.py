"""The autopilot and the kind of a vehicle, from its HEARTBEAT."""

from dataclasses import dataclass
from enum import StrEnum

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.parameters import ParameterEncoding


class Firmware(StrEnum):
    """The firmware of the autopilot (MAV_AUTOPILOT)."""

    ARDUPILOT = "ArduPilot"
    PX4 = "PX4"

    @property
    def encoding(self) -> ParameterEncoding:
        """The encoding of its parameters."""
        return ParameterEncoding.BYTEWISE if self is Firmware.PX4 else ParameterEncoding.C_CAST


class Kind(StrEnum):
    """The kind of vehicle, as far as autopilots control kinds differently (MAV_TYPE)."""

    COPTER = "copter"
    PLANE = "plane"
    VTOL = "vtol"
    ROVER = "rover"
    BOAT = "boat"
    SUB = "sub"


ON_THE_GROUND = frozenset({Kind.ROVER, Kind.BOAT, Kind.SUB})
"""Kinds that never fly."""

_FIRMWARES = {
    dialect.MAV_AUTOPILOT_ARDUPILOTMEGA: Firmware.ARDUPILOT,
    dialect.MAV_AUTOPILOT_PX4: Firmware.PX4,
}
_KINDS = {
    **dict.fromkeys(
        (
            dialect.MAV_TYPE_QUADROTOR,
            dialect.MAV_TYPE_COAXIAL,
            dialect.MAV_TYPE_HELICOPTER,
            dialect.MAV_TYPE_HEXAROTOR,
            dialect.MAV_TYPE_OCTOROTOR,
            dialect.MAV_TYPE_TRICOPTER,
            dialect.MAV_TYPE_DODECAROTOR,
            dialect.MAV_TYPE_DECAROTOR,
        ),
        Kind.COPTER,
    ),
    dialect.MAV_TYPE_FIXED_WING: Kind.PLANE,
    **dict.fromkeys(
        range(dialect.MAV_TYPE_VTOL_DUOROTOR, dialect.MAV_TYPE_VTOL_RESERVED5 + 1), Kind.VTOL
    ),
    dialect.MAV_TYPE_GROUND_ROVER: Kind.ROVER,
    dialect.MAV_TYPE_SURFACE_BOAT: Kind.BOAT,
    dialect.MAV_TYPE_SUBMARINE: Kind.SUB,
}


@dataclass(frozen=True, slots=True)
class Identity:
    """Firmware and kind, as a heartbeat reports them."""

    firmware: Firmware
    kind: Kind

    def __str__(self) -> str:
        return f"{self.firmware} {self.kind}"


def kind_of(type_: int) -> Kind:
    """Return the kind of a MAV_TYPE; a copter, if autopilots do not control it in its own way."""
    return _KINDS.get(type_, Kind.COPTER)


def identity(autopilot: int, type_: int) -> Identity | None:
    """Return the identity in a HEARTBEAT with these fields; None if drivers do not support it."""
    firmware, kind = _FIRMWARES.get(autopilot), _KINDS.get(type_)
    return None if firmware is None or kind is None else Identity(firmware, kind)
