"""The specification of a simulated vehicle: kind, system id, home, parameters."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from m2pem_plugin_mavlink.simulator.geometry import Location

ZURICH = Location(47.397742, 8.545594, 488.0)
"""A meadow in Zurich."""


class Kind(StrEnum):
    """The kind of vehicle."""

    COPTER = "copter"
    ROVER = "rover"
    PLANE = "plane"
    BOAT = "boat"


SURFACE = (Kind.ROVER, Kind.BOAT)
"""What drives or floats."""


@dataclass(frozen=True, slots=True)
class VehicleSpec:
    """One simulated vehicle.

    `firmware`: a name in `simulator.autopilot.FIRMWARES`; `estimator_s`: how long the position is
    unknown after the start, in seconds of simulated time;
    `parameters`: what differs from the firmware's defaults; `battery_s`: how long a full battery
    lasts in motion; `gimbal`: it has one (None: if it is a copter); `camera`: it has one, as a
    component of its own; `signing_key`: with which it signs its frames from the start.
    """

    kind: Kind = Kind.COPTER
    system: int = 1
    home: Location = ZURICH
    heading_deg: float = 0.0
    firmware: str = "ardupilot"
    estimator_s: float = 41.0
    parameters: Mapping[str, float] = field(default_factory=dict)
    battery_s: float = 1800.0
    gimbal: bool | None = None
    camera: bool = False
    signing_key: bytes | None = field(default=None, repr=False)

    @property
    def heading_rad(self) -> float:
        """The way it faces at first, from north clockwise."""
        return math.radians(self.heading_deg)
