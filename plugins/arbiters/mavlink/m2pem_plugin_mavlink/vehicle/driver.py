"""What drivers are commanded with, and what they report, whatever the autopilot."""

from dataclasses import dataclass
from enum import StrEnum


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


@dataclass(frozen=True, slots=True)
class TargetPosition:
    """A place to go to, in WGS-84 degrees; `altitude_m` in `altitude_frame` ("relative" to home,
    "amsl", "terrain"), None: the present one. `heading_rad` from true north, clockwise; None: the
    present one."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float | None = None
    altitude_frame: str = "relative"
    heading_rad: float | None = None


@dataclass(frozen=True, slots=True)
class Readiness:
    """Whether a vehicle may be armed, and the reasons if not: "EKF: no position yet, 12 s"."""

    ready: bool
    reasons: tuple[str, ...] = ()
