"""A vehicle that takes part in deconfliction, as it is received, and the parameters of its behavior
as places and heights."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from m2pem.api.arbiter import ResolvedValue
from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.api.telemetry import VehicleState
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.polygon import Hull, convex_hull
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Area, Coordinate, Point, Route, VehiclePosition

GROUNDED_BELOW_M = 1.0
"""Above home; lower than this, what is neither armed nor moving is on the ground."""

STANDS_BELOW_M_S = 0.5
REACTION_S = 1.0
BRAKING_M_S2 = 2.0
"""An aircraft begins to stop within this time, and brakes with at least this deceleration."""

SNAP_M = 2.0
"""Nearer than this to the height that it was sent to, an aircraft is taken to be there: none
hovers to the centimetre."""


@dataclass(frozen=True, slots=True)
class Span:
    """Heights above mean sea level in metres, from the lowest to the highest."""

    low_m: float
    high_m: float

    @property
    def exact(self) -> bool:
        """Whether it is one height."""
        return self.low_m == self.high_m

    def apart_m(self, other: "Span") -> float:
        """The difference of height between two; 0 if they overlap."""
        return max(0.0, self.low_m - other.high_m, other.low_m - self.high_m)

    def to(self, other: "Span") -> "Span":
        """All heights between two."""
        return Span(min(self.low_m, other.low_m), max(self.high_m, other.high_m))


ANY_HEIGHT = Span(-math.inf, math.inf)


@dataclass(frozen=True, slots=True)
class Participant:
    """The last state of a vehicle, in the local frame.

    `stop`: where it may be by the time at which it has stopped, at the heights `span`. `home_m`:
    the height of its home; None: not known. `flies`: whether it is in the air; of a vehicle that
    never flies: True, as it always is in the way of others. `homes`: where a return may lead to.
    """

    vehicle: ResourceId
    place: EastNorth
    stop: Hull
    span: Span
    home_m: float | None
    flies: bool
    stands: bool
    homes: tuple[EastNorth, ...] = ()


def flies(state: VehicleState) -> bool:
    """Whether an aircraft is in the air, or may be in a moment."""
    height_m = state.altitude_above_home_m
    low = height_m is None or height_m < GROUNDED_BELOW_M
    return not (low and not state.armed and stands(state))


def participant_of(
    state: VehicleState,
    frame: LocalFrame,
    nominal_m: float | None,
    homes: tuple[EastNorth, ...],
    *,
    airborne: bool = True,
) -> Participant | None:
    """None: its position is not known. `nominal_m`: the height that it was sent to last.
    `airborne`: whether it can fly; what cannot is at all heights."""
    if state.position is None:
        return None
    place = frame.to_local(state.position.latlon)
    east, north, up = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
    speed, still = _speed_m_s(state), stands(state)
    ahead_s = 0.0 if still else REACTION_S + speed / (2 * BRAKING_M_S2)
    height_m = state.position.altitude_m
    if nominal_m is not None and abs(up) < STANDS_BELOW_M_S and abs(height_m - nominal_m) <= SNAP_M:
        height_m, up = nominal_m, 0.0
    then_m = height_m + up * ahead_s
    above_m = state.altitude_above_home_m
    stop = convex_hull([place, (place[0] + east * ahead_s, place[1] + north * ahead_s)])
    if not airborne:
        return Participant(
            state.resource, place, stop, ANY_HEIGHT, None, flies=True, stands=still, homes=homes
        )
    return Participant(
        state.resource,
        place,
        stop,
        Span(min(height_m, then_m), max(height_m, then_m)),
        None if above_m is None else state.position.altitude_m - above_m,
        flies(state),
        still,
        homes,
    )


def stands(state: VehicleState) -> bool:
    return _speed_m_s(state) < STANDS_BELOW_M_S


def _speed_m_s(state: VehicleState) -> float:
    return math.hypot(*(state.velocity_enu_m_s or (0.0,)))


class FlightParameters(BehaviorParameters):
    """The parameters of a behavior of one aircraft.

    `height_of`: the height of another vehicle now. `unknown`: why a volume has no bounds, set when
    one is made.
    """

    bend_m = 4.0
    """How far from a route's corner a bend may pass it."""

    moves = "flies"

    def __init__(
        self,
        values: Mapping[str, ResolvedValue],
        vehicle: Participant,
        frame: LocalFrame,
        height_of: Callable[[str], float | None],
    ) -> None:
        super().__init__(values)
        self.vehicle = vehicle
        self.frame = frame
        self.unknown = ""
        self._height_of = height_of

    def to_local(self, place: Coordinate) -> EastNorth:
        return self.frame.to_local(place[:2])

    def ring(self, area: Area) -> list[EastNorth]:
        """The corners of an area's outer ring, each once."""
        return [self.to_local(corner) for corner in area.rings[0][:-1]]

    def waypoint_spans(self, route: Route) -> list[Span]:
        return [
            self.span(each[2], frame)
            for each, frame in zip(route.waypoints, route.frames, strict=True)
        ]

    def target_place(self) -> tuple[EastNorth | None, Span]:
        """Where `target` is, None if that is wherever a vehicle goes; and the height to be at."""
        value = self.target
        if isinstance(value, Point):
            return self.to_local(value.position), self.span(value.position[2], value.altitude_frame)
        if not isinstance(value, VehiclePosition):
            self.unknown = "it has no target that is known"
            return None, ANY_HEIGHT
        self.unknown = f"it goes wherever {value.vehicle} goes"
        span = self.span()
        target_m = self._height_of(value.vehicle)
        if self.altitude_m is None and target_m is not None and target_m > span.low_m:
            span = span.to(Span(target_m, target_m))
        return None, span

    def span(self, own_m: float | None = None, own_frame: str = "relative") -> Span:
        """The height to move at: as the parameters say, else as a place does, else as it is."""
        altitude_m = self.altitude_m
        if altitude_m is not None:
            return self._lifted(altitude_m, self.altitude_frame)
        if own_m is not None:
            return self._lifted(own_m, own_frame)
        if self.vehicle.flies:
            return self.vehicle.span
        self.unknown = "how high it is to fly is not known: give it an altitude"
        return Span(self.vehicle.span.low_m, math.inf)

    def _lifted(self, altitude_m: float, frame: str) -> Span:
        home_m = self.vehicle.home_m
        if frame == "terrain":
            self.unknown = "its altitude is above the terrain, whose height is not known here"
            return ANY_HEIGHT
        if frame == "amsl":
            up_m = altitude_m
        elif home_m is None:
            self.unknown = "the height of its home is not known, which its altitude counts from"
            return ANY_HEIGHT
        else:
            up_m = home_m + altitude_m
        # What would be below its home is flown there, or at home's height.
        return Span(up_m, up_m if home_m is None else max(up_m, home_m))


class SurfaceParameters(FlightParameters):
    """The parameters of a behavior of one vehicle that does not fly: it may be at any height."""

    bend_m = 2.0
    moves = "goes"

    def span(self, own_m: float | None = None, own_frame: str = "relative") -> Span:
        """All heights."""
        return ANY_HEIGHT
