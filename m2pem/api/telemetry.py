"""Telemetry of vehicles, payloads and teams, with frames and units in the names.

Positions are WGS-84 (EPSG:4979): degrees, metres above mean sea level. Local vectors are ENU
(REP-103). `yaw_rad` is from east, counter-clockwise (REP-103); headings for people are made of it.
Positive `roll_rad` is right side down, positive `pitch_rad` is nose down (REP-103; autopilots,
which use NED, have the other sign of pitch).
Telemetry is never journaled; `m2pem.telemetry.link_monitor` makes inputs of lost links and low
batteries.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias, Union

from m2pem.mission.catalogue import ResourceId


@dataclass(frozen=True, slots=True)
class GeoPosition:
    """WGS-84 latitude and longitude in degrees, altitude in metres above mean sea
    level (EGM96)."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float

    @property
    def latlon(self) -> tuple[float, float]:
        """Latitude and longitude in degrees."""
        return self.latitude_deg, self.longitude_deg


class LinkState(StrEnum):
    """The state of the link to a vehicle or payload."""

    CONNECTED = "connected"
    DEGRADED = "degraded"
    LOST = "lost"


@dataclass(frozen=True, slots=True)
class VehicleState:
    """A vehicle at one moment. None: not known. `time_us`: microseconds since the Unix epoch.

    `failsafe_problems`: how its own failsafes differ from what the fleet file says, in words;
    empty: they do not; None: they were not compared.
    `landed`: an aircraft is on the ground, as its autopilot says, which some say of one that was
    disarmed in the air; None also for vehicles that do not fly. `home`: where the vehicle returns
    to, and where heights above home are measured from, as its autopilot reports it.
    """

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
    failsafe_problems: tuple[str, ...] | None = None
    landed: bool | None = None
    home: GeoPosition | None = None


@dataclass(frozen=True, slots=True)
class Detection:
    """An object that a payload detected; the `Detector` service writes it to the data store."""

    type: str
    source: ResourceId
    position: GeoPosition
    time_us: int


@dataclass(frozen=True, slots=True)
class PayloadState:
    """A payload at one moment. `detections`: found since the last state.

    `pan_rad`: clockwise from the vehicle's heading. `tilt_rad`: up from the vehicle's deck, or from
    the horizon, if the payload keeps level by itself. `footprint`: the corners of what it sees of
    the ground, in order; empty if it looks above the horizon, or its vehicle's position is unknown.
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
    """The deviation of a member of a march from its place, in metres. None: not known yet.

    `along_m`: how far it is ahead of its place beside the lead, along the route; below 0: behind.
    `aside_m`: the distance from its own lane. `gap_m`: the way to the next member ahead in its
    lane; None also if there is none.
    """

    resource: ResourceId
    along_m: float | None = None
    aside_m: float | None = None
    gap_m: float | None = None


@dataclass(frozen=True, slots=True)
class TeamState:
    """The members' deviations from their places, while a team behavior marches.

    `behavior`: its id ("r1.b3"); `name`: its name in the catalogue ("road_sweep"). `members`: those
    that are not lost, the lead first. `spacing_m`: the planned spacing.
    """

    behavior: str
    name: str
    time_us: int
    members: tuple[TeamMemberState, ...]
    spacing_m: float


Telemetry: TypeAlias = Union[VehicleState, PayloadState, TeamState]
"""What a bus and MissionControl publish. Ignore kinds that you do not know: more may come."""
