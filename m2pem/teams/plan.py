"""The plan of a team behavior: the members' parts and their formation; the context of planning."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from m2pem.api.arbiter import ResolvedValue
from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.fleet.parameters import accepted
from m2pem.geo.fence import Fence
from m2pem.geo.local_frame import EastNorth, LatLon, LocalFrame
from m2pem.geo.polyline import EastNorthUp
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.mission.geometry import Coordinate, Point, Route, VehiclePosition
from m2pem.teams.paths import MemberPath

REACTION_S = 1.0
"""Time from a change of telemetry until the vehicle brakes: telemetry, control, command."""

SOON_S = 0.5
"""The same of a vehicle that nothing disturbs."""

START_SHARE = 0.2
"""Share of the march's speed: slower than that no member starts."""


@dataclass(frozen=True, slots=True)
class Motion:
    """`nominal_m_s`: the default speed of a march. `braking_m_s2`, `hardest_m_s2`: the minimum and
    the maximum deceleration of a vehicle after a command to stop. `settling_s`: how long it goes on
    with its speed, in all, while it slows down to stop at a place: it overshoots, and coasts."""

    nominal_m_s: float
    braking_m_s2: float
    hardest_m_s2: float
    settling_s: float = SOON_S

    def stopping_m(self, speed_m_s: float, reaction_s: float = REACTION_S) -> float:
        """Return the distance that the vehicle needs to stop from that speed."""
        return speed_m_s * reaction_s + speed_m_s**2 / (2 * self.braking_m_s2)

    def hard_stop_m(self, speed_m_s: float) -> float:
        """Return the least distance within which the vehicle may come to a stop."""
        return speed_m_s**2 / (2 * self.hardest_m_s2)

    def short_m(self, march_m_s: float) -> float:
        """Return how far before the place where it must stop the vehicle may come to a stop."""
        return self.stopping_m(START_SHARE * march_m_s, self.settling_s)

    def safe_m_s(self, distance_m: float, reaction_s: float = REACTION_S) -> float:
        """Return the maximum speed from which it stops within the distance; 0 if that is <= 0."""
        if distance_m <= 0:
            return 0.0
        lag = self.braking_m_s2 * reaction_s
        return math.sqrt(lag**2 + 2 * self.braking_m_s2 * distance_m) - lag


MOTIONS: Mapping[str, Motion] = {
    "ground": Motion(5.0, 1.0, 4.0, 2.0),
    "air": Motion(10.0, 2.0, 4.0),
    "surface": Motion(4.0, 0.4, 0.8),
    "subsurface": Motion(1.5, 0.25, 0.5),
}
"""By domain. ArduRovers (4.7) brake with 1 m/s² (`ATC_DECEL_MAX` 0: as `ATC_ACCEL_MAX`), overshoot
when their speed is to fall, and coast in HOLD."""


MAX_RANGE_M = 100_000.0
"""The maximum distance between the places of a team behavior and its members."""

_FLYING_OR_DIVING = ("air", "subsurface")


Meeting: TypeAlias = tuple[str, str, LatLon | None]
"""Where members would come too near to each other: a text, what to do, and the place."""

NO_MEETING: Meeting = "", "", None


class TeamRefusedError(Exception):
    """The team cannot carry the behavior out; the text names the member or the parameter.

    `place`: where, if the text says that.
    """

    def __init__(self, text: str, place: LatLon | None = None) -> None:
        super().__init__(text)
        self.place = place


@dataclass(frozen=True, slots=True)
class Leg:
    """The part of one member. `after`: it begins when that member's part has ended."""

    member: ResourceId
    behavior: str
    parameters: Mapping[str, ResolvedValue]
    after: ResourceId | None = None


@dataclass(frozen=True, slots=True)
class Marcher:
    """A member on the march: `back_m` behind the lead along the route, `left_m` beside it. `fence`:
    where it may be."""

    member: ResourceId
    path: MemberPath
    back_m: float
    left_m: float
    motion: Motion
    fence: Fence


@dataclass(frozen=True, slots=True)
class March:
    """Members that move along one route and keep their places to each other, the lead first.

    `closes`: the members behind a lost one move up. `in_order`: on its way to the route, each goes
    before those behind it.
    """

    marchers: tuple[Marcher, ...]
    spacing_m: float
    speed_m_s: float
    closes: bool
    in_order: bool = False


@dataclass(frozen=True, slots=True)
class Plan:
    """The members' parts of one team behavior.

    `legs`: at most one for each member. `stays`: the behavior goes on when all have ended, for
    `duration_s` if that is given. `shared`: another member takes over what a lost member has not
    done; `takes`: the parameters that each accepts then; `speeds_m_s`: the members' speeds.
    `split`: each member's share.
    """

    legs: tuple[Leg, ...]
    march: March | None = None
    stays: bool = False
    duration_s: float | None = None
    shared: bool = False
    takes: Mapping[ResourceId, frozenset[str]] = field(default_factory=dict)
    speeds_m_s: Mapping[ResourceId, float] = field(default_factory=dict)
    split: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class MemberPose:
    """A vehicle's pose: `place` is east and north in metres in the team's local frame; `yaw_rad`
    from east, counter-clockwise; None: not known. `speed_m_s`: 0 if it is not known.
    `course_rad`: where it moves, from east; None: it stands, or that is not known."""

    place: tuple[float, float]
    yaw_rad: float | None = None
    speed_m_s: float = 0.0
    course_rad: float | None = None


@dataclass(frozen=True, slots=True)
class PlanningContext:
    """The input of a plan. `offered`: each member's own vehicle behaviors, by name.

    `poses`: the members' poses. `target`: the pose of the vehicle that the parameter `target`
    names. `begun`: the members are on the route already (after a restart), with the shares of
    `split`. `cruises_m_s`: the members' cruise speeds that the fleet states. `lasts_s`: the time
    that members can still move, where the fleet states their endurance. `fences`: where members
    may be, if there is a limit.
    """

    members: tuple[ResourceId, ...]
    domains: Mapping[ResourceId, str]
    offered: Mapping[ResourceId, Mapping[str, BehaviorSpec]]
    parameters: BehaviorParameters
    frame: LocalFrame
    poses: Mapping[ResourceId, MemberPose] = field(default_factory=dict)
    target: MemberPose | None = None
    begun: bool = False
    cruises_m_s: Mapping[ResourceId, float] = field(default_factory=dict)
    lasts_s: Mapping[ResourceId, float] = field(default_factory=dict)
    split: tuple[float, ...] = ()
    fences: Mapping[ResourceId, Fence | None] = field(default_factory=dict)

    def fence(self, member: ResourceId) -> Fence:
        """Return where a member may be, in the local frame."""
        fence = self.fences.get(member)
        return Fence.around(()) if fence is None else fence.in_frame(self.frame)

    def target_place(self) -> tuple[float, float]:
        """Return the present place of `target`, east and north in metres.

        Raises:
            TeamRefusedError: its position is not known.
        """
        value = self.parameters.target
        if isinstance(value, Point):
            return self.level(value.position)
        if self.target is not None:
            return self.target.place
        what = value.vehicle if isinstance(value, VehiclePosition) else "the target"
        raise TeamRefusedError(f"parameter 'target': the position of {what} is not known")

    def level(self, place: Coordinate) -> tuple[float, float]:
        """Return a coordinate as east and north in metres in the local frame.

        Raises:
            TeamRefusedError: it is too far away.
        """
        east, north = self.frame.to_local(place[:2])
        if max(abs(east), abs(north)) > MAX_RANGE_M:
            raise TeamRefusedError(
                f"[{place[0]}, {place[1]}] is more than {MAX_RANGE_M / 1000:.0f} km away"
            )
        return east, north

    def coordinate(self, place: EastNorthUp | EastNorth, up_m: float | None) -> Coordinate:
        """Return a place of the local frame as a coordinate with that altitude."""
        return (*self.frame.to_latlon(place[:2]), up_m)

    def begin(self, member: ResourceId) -> EastNorth | None:
        """Return where a member comes from; None: it is on the route."""
        return None if self.begun else self.poses[member].place

    def motion(self, member: ResourceId) -> Motion:
        """Return the speed and the braking of a member."""
        motion = MOTIONS.get(self.domains[member], MOTIONS["ground"])
        return replace(motion, nominal_m_s=self.cruises_m_s.get(member, motion.nominal_m_s))

    def speed(self) -> float:
        """Return the team's speed in m/s: as requested, else the nominal speed of the slowest.

        It is at most the maximum that the arbiter of each member allows.
        """
        requested_m_s = self.parameters.speed_m_s
        bounds = [self.motion(member).nominal_m_s for member in self.members]
        speed = min(bounds) if requested_m_s is None else requested_m_s
        for member in self.members:
            spec = self.offered[member].get("single_vehicle_routing")
            limit = spec.by_name["speed"].maximum if spec and "speed" in spec.by_name else None
            speed = speed if limit is None else min(speed, limit)
        return speed

    def leg(
        self,
        member: ResourceId,
        behavior: str,
        parameters: Mapping[str, ResolvedValue],
        after: ResourceId | None = None,
    ) -> Leg:
        """Return a member's part: the parameters that it accepts, at the team's altitude if any."""
        spec = self.offered[member].get(behavior)
        if spec is None:
            raise TeamRefusedError(f"{member} has no behavior '{behavior}'")
        given = dict(parameters)
        if self.domains[member] in _FLYING_OR_DIVING:
            given = {**self.parameters.only("altitude", "altitude_frame"), **given}
        taken = {
            name: value
            for name, value in given.items()
            if value is not None and name in accepted(spec)
        }
        return Leg(member, behavior, taken, after)

    def to_place(
        self,
        member: ResourceId,
        place: EastNorthUp | EastNorth,
        heading_rad: float | None = None,
        after: ResourceId | None = None,
    ) -> Leg:
        """Return a member's way to a place: `goto`, or else a route of two points."""
        there = self.coordinate(place, None)
        speed = self.parameters.speed_m_s
        if "goto" in self.offered[member]:
            target = {"target": Point(there), "speed": speed, "heading": heading_rad}
            return self.leg(member, "goto", target, after)
        here = self.coordinate(self.poses[member].place, None)
        route = {"route": Route((here, there)), "speed": speed}
        return self.leg(member, "single_vehicle_routing", route, after)
