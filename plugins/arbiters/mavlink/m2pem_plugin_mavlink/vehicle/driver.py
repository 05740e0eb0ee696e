"""The interface of drivers: the commands that all autopilots have."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from m2pem.api import LatLon
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem


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


class Driver(Protocol):
    """Each method returns when the vehicle has accepted and its own messages confirm it (HEARTBEAT
    for a mode, not the acknowledgement), after retries; it does not wait until the motion ends.

    Raises:
        ExchangeError: the vehicle refuses (with its STATUSTEXT as the reason) or does not answer.
    """

    name: str
    home_items: int
    """How many items of a stored mission stand before the first real one."""

    def mode_name(self, custom_mode: int) -> str:
        """Return the autopilot's own name of a mode: "GUIDED", "AUTO.MISSION"."""
        ...

    def flight_mode(self, custom_mode: int) -> FlightMode:
        """Return the purpose of a mode."""
        ...

    def readiness(self) -> Readiness:
        """Return whether the vehicle may be armed now."""
        ...

    async def set_mode(self, mode: FlightMode) -> None:
        """Change the mode."""
        ...

    async def arm(self) -> None:
        """Wait until it is ready (within a bound), and arm. An armed vehicle is left as it is."""
        ...

    async def disarm(self) -> None:
        """Disarm; refused in flight."""
        ...

    async def take_off(self, altitude_m: float) -> None:
        """Arm where needed, and climb to a height above home."""
        ...

    async def go_to(self, place: TargetPosition, speed_m_s: float | None = None) -> None:
        """Go to a place and stay there (DO_REPOSITION or its equivalent)."""
        ...

    async def orbit(self, center: TargetPosition, radius_m: float, speed_m_s: float | None) -> bool:
        """Circle a place without end; return False if the autopilot has no command for it."""
        ...

    async def set_speed(self, speed_m_s: float) -> None:
        """Set the speed over ground of the following motion."""
        ...

    async def command(self, command: int, *params: float) -> None:
        """Send a command (a MAV_CMD with up to seven parameters) that has no method of its own."""
        ...

    async def move(self, velocity_ned_m_s: tuple[float, float, float]) -> None:
        """Send one velocity setpoint; repeat it twice a second, or the vehicle stops."""
        ...

    async def upload(self, items: Sequence[MissionItem]) -> None:
        """Store a mission; an empty one clears it. Item 0 is the first real one: home, where the
        autopilot requires it as item 0, is added here, and left out of `downloaded` and
        `current_item`."""
        ...

    async def downloaded(self) -> tuple[MissionItem, ...]:
        """Return the stored mission, in the form that `upload` takes."""
        ...

    async def rally_points(self) -> Sequence[LatLon]:
        """Return the places where the vehicle may land instead of at home: latitudes and longitudes
        in degrees."""
        ...

    async def start_mission(self, first: int = 0) -> None:
        """Execute the stored mission from an item on (numbered as in `upload`), arming where
        needed."""
        ...

    @property
    def current_item(self) -> int | None:
        """The item that the vehicle moves to, numbered as in `upload`."""
        ...

    @property
    def reached_item(self) -> int | None:
        """The item reached last since the mission was started."""
        ...

    async def stop(self) -> None:
        """Stop at once (HOLD, LOITER, BRAKE) from any motion; idempotent."""
        ...

    async def return_home(self) -> None:
        """Return to launch."""
        ...

    async def land(self) -> None:
        """Land at the present position."""
        ...
