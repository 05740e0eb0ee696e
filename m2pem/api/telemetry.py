"""What vehicles and payloads say about themselves, with frames and units in the names.

Positions are WGS-84 (EPSG:4979): degrees, metres above mean sea level. Local vectors are ENU
(REP-103). `yaw_rad` is from east, counter-clockwise (REP-103); headings for people are made of it.
A positive `roll_rad` has the right side down, a positive `pitch_rad` the bow (REP-103; autopilots,
who speak NED, have the other sign of pitch).
Telemetry is never journaled; `m2pem.telemetry.link_monitor` turns what matters into inputs.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias, Union

from m2pem.mission.catalogue import ResourceId


@dataclass(frozen=True, slots=True)
class GeoPosition:
    """WGS-84 latitude and longitude in degrees, altitude in metres above mean sea level."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float

    @property
    def latlon(self) -> tuple[float, float]:
        """Latitude and longitude in degrees."""
        return self.latitude_deg, self.longitude_deg


class LinkState(StrEnum):
    """Whether the vehicle is heard."""

    CONNECTED = "connected"
    DEGRADED = "degraded"
    LOST = "lost"


@dataclass(frozen=True, slots=True)
class VehicleState:
    """A vehicle at one moment. None: not known. `time_us`: microseconds since the Unix epoch."""

    resource: ResourceId
    time_us: int
    position: GeoPosition | None = None
    altitude_above_home_m: float | None = None
    velocity_enu_m_s: tuple[float, float, float] | None = None
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float | None = None
    battery_fraction: float | None = None
    mode: str = ""
    armed: bool | None = None
    ready: bool | None = None
    not_ready_reasons: tuple[str, ...] = ()
    link: LinkState = LinkState.CONNECTED
    behavior: str = ""


@dataclass(frozen=True, slots=True)
class Detection:
    """Something a detector payload found; the `Detector` service writes it to the data store."""

    type: str
    source: ResourceId
    position: GeoPosition
    time_us: int


@dataclass(frozen=True, slots=True)
class PayloadState:
    """A payload at one moment. `detections`: found since the last state.

    `pan_rad`: from the vehicle's bow, clockwise. `tilt_rad`: up from the vehicle's deck, or from
    the horizon, if the payload keeps level by itself. `footprint`: the corners of what it sees of
    the ground, in order; empty if it looks above the horizon, or its vehicle's place is unknown.
    """

    resource: ResourceId
    time_us: int
    pan_rad: float | None = None
    tilt_rad: float | None = None
    zoom: float | None = None
    detections: tuple[Detection, ...] = ()
    link: LinkState = LinkState.CONNECTED
    behavior: str = ""
    footprint: tuple[GeoPosition, ...] = ()


@dataclass(frozen=True, slots=True)
class TeamMemberState:
    """Where a member of a march is, beside where it should be.

    `along_m`: how far it is ahead of its place beside the lead, along the route in metres; below 0:
    behind. `aside_m`: how far off its own lane. `gap_m`: the way to the next one ahead in its lane;
    None: there is none. What was not heard yet is not known: None.
    """

    resource: ResourceId
    along_m: float | None = None
    aside_m: float | None = None
    gap_m: float | None = None


@dataclass(frozen=True, slots=True)
class TeamState:
    """How well the members of a team behavior keep their places, while they march.

    `behavior`: its id ("r1.b3"), `name` what it is ("road_sweep"). `members`: those who are not
    lost, the lead first. `spacing_m`: between two of them.
    """

    behavior: str
    name: str
    time_us: int
    members: tuple[TeamMemberState, ...]
    spacing_m: float


Telemetry: TypeAlias = Union[VehicleState, PayloadState, TeamState]
"""What a bus and MissionControl tell. More kinds may come: pass by what you do not know."""
