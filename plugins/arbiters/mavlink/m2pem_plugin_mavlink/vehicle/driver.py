"""What drivers are commanded with, and what they report, whatever the autopilot."""

from dataclasses import dataclass
from enum import StrEnum

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import LatLon


class FlightMode(StrEnum):
    """The purpose of a mode; autopilots have more modes, and their own names for these."""

    GUIDED = "guided"  # ArduPilot GUIDED; PX4 HOLD (DO_REPOSITION) or OFFBOARD
    MISSION = "mission"  # AUTO; PX4 AUTO.MISSION
    HOLD = "hold"  # copter LOITER or BRAKE, rover HOLD, plane LOITER; PX4 AUTO.LOITER
    RETURN = "return"  # RTL
    LAND = "land"
    TAKEOFF = "takeoff"
    ORBIT = "orbit"  # CIRCLE; PX4 ORBIT
    MANUAL = "manual"  # all modes of manual control
    OTHER = "other"


RELATIVE, AMSL, TERRAIN = "relative", "amsl", "terrain"
FRAMES = {
    RELATIVE: dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT,
    AMSL: dialect.MAV_FRAME_GLOBAL,
    TERRAIN: dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT,
}
"""The MAV_FRAME of each frame of altitudes."""


@dataclass(frozen=True, slots=True)
class TargetPosition:
    """A place to go to, in WGS-84 degrees; `altitude_m` in `altitude_frame` (of `FRAMES`), None:
    the present one. `heading_rad` from true north, clockwise; None: the present one."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float | None = None
    altitude_frame: str = RELATIVE
    heading_rad: float | None = None

    @property
    def latlon(self) -> LatLon:
        """Latitude and longitude in degrees."""
        return self.latitude_deg, self.longitude_deg


@dataclass(frozen=True, slots=True)
class Readiness:
    """Whether a vehicle may be armed, and the reasons if not: "EKF: no position yet, 12 s"."""

    ready: bool
    reasons: tuple[str, ...] = ()
