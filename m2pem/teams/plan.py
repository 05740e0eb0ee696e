"""What each member of a team does, and what the team keeps to meanwhile."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from m2pem.api.arbiter import ResolvedValue
from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.fleet.parameters import accepted
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.polyline import EastNorthUp
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.mission.geometry import Coordinate, Point, Route, VehiclePosition
from m2pem.teams.paths import MemberPath

REACTION_S = 1.0
"""From a change of what is seen to a vehicle that begins to brake: telemetry, thought, command."""


@dataclass(frozen=True, slots=True)
class Motion:
    """`nominal_m_s`: the speed of a march when nobody says. `braking_m_s2`: what a vehicle that is
    told to stop brakes with at least."""

    nominal_m_s: float
    braking_m_s2: float

    def stopping_m(self, speed_m_s: float) -> float:
        """The way from what is seen at that speed to the stand."""
        return speed_m_s * REACTION_S + speed_m_s**2 / (2 * self.braking_m_s2)

    def safe_m_s(self, distance_m: float) -> float:
        """The highest speed from which it stops within the distance; 0 without any."""
        if distance_m <= 0:
            return 0.0
        lag = self.braking_m_s2 * REACTION_S
        return math.sqrt(lag**2 + 2 * self.braking_m_s2 * distance_m) - lag


MOTIONS: Mapping[str, Motion] = {
    "ground": Motion(5.0, 2.0),
    "air": Motion(10.0, 2.0),
    "surface": Motion(4.0, 0.4),
    "subsurface": Motion(1.5, 0.25),
}
"""By domain."""


MAX_RANGE_M = 100_000.0
"""Farther from its members than this a team does not work."""

_FLYING_OR_DIVING = ("air", "subsurface")


class TeamRefusedError(Exception):
    """The team cannot do it; the text says why, naming the member or the parameter."""


@dataclass(frozen=True, slots=True)
class Leg:
    """What one member does. `after`: it begins when that member has ended its own."""

    member: ResourceId
    behavior: str
    parameters: Mapping[str, ResolvedValue]
    after: ResourceId | None = None


@dataclass(frozen=True, slots=True)
class Marcher:
    """A member on the march: `back_m` behind the lead along the route, `left_m` beside it."""

    member: ResourceId
    path: MemberPath
    back_m: float
    left_m: float
    motion: Motion


@dataclass(frozen=True, slots=True)
class March:
    """Members that move along one route and keep their places to each other, the lead first.

    `closes`: who comes behind a lost member moves up to its place.
    """

    marchers: tuple[Marcher, ...]
    spacing_m: float
    speed_m_s: float
    closes: bool = False


@dataclass(frozen=True, slots=True)
class Plan:
    """`legs`: at most one a member. `stays`: it goes on when all have ended, for `duration_s` if
    that is given. `shared`: what a lost member has not done is done by another one; `takes`: the
    parameters that each takes then. `split`: what share of it each member has."""

    legs: tuple[Leg, ...]
    march: March | None = None
    stays: bool = False
    duration_s: float | None = None
    shared: bool = False
    takes: Mapping[ResourceId, frozenset[str]] = field(default_factory=dict)
    split: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class MemberPose:
    """Where a vehicle is on the plane; `yaw_rad` from east, counter-clockwise; None: not known."""

    place: tuple[float, float]
    yaw_rad: float | None = None


@dataclass(frozen=True, slots=True)
class PlanningContext:
    """What a plan is made from. `offered`: each member's own vehicle behaviors, by name.

    `poses`: where each member is. `target`: where the vehicle is that `target` names. `begun`: the
    members are under way already (after a restart), not on their way to the route's start; what
    was split among them then was as `split` says. `cruises_m_s`: how fast members go that the fleet
    says it of. `lasts_s`: how long those can go on that it says that of.
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

    def target_place(self) -> tuple[float, float]:
        """Where `target` is now.

        Raises:
            TeamRefusedError: nobody knows.
        """
        value = self.parameters.target
        if isinstance(value, Point):
            return self.level(value.position)
        if self.target is not None:
            return self.target.place
        what = value.vehicle if isinstance(value, VehiclePosition) else "the target"
        raise TeamRefusedError(f"parameter 'target': the position of {what} is not known")

    def level(self, place: Coordinate) -> tuple[float, float]:
        """A coordinate on the frame.

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
        """A place of the plane as a coordinate, with that altitude."""
        return (*self.frame.to_latlon(place[:2]), up_m)

    def motion(self, member: ResourceId) -> Motion:
        """How a member moves."""
        motion = MOTIONS.get(self.domains[member], MOTIONS["ground"])
        return replace(motion, nominal_m_s=self.cruises_m_s.get(member, motion.nominal_m_s))

    def speed(self) -> float:
        """The speed of all together: as wished, else what the slowest is taken to go.

        Not above what the arbiter of a member allows.
        """
        wished = self.parameters.speed_m_s
        bounds = [self.motion(member).nominal_m_s for member in self.members]
        speed = min(bounds) if wished is None else wished
        for member in self.members:
            spec = self.offered[member].get("single_vehicle_routing")
            limit = spec.by_name["speed"].maximum if spec and "speed" in spec.by_name else None
            speed = speed if limit is None else min(speed, limit)
        return speed

    def leg(
        self,
        member: ResourceId,
        behavior: str,
        wished: Mapping[str, ResolvedValue],
        after: ResourceId | None = None,
    ) -> Leg:
        """A member's part: the wished parameters that it takes, at the team's altitude if any."""
        spec = self.offered[member].get(behavior)
        if spec is None:
            raise TeamRefusedError(f"{member} has no behavior '{behavior}'")
        given = dict(wished)
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
        """A member's way to a place: `goto`, or a route of two points where it has none."""
        there = self.coordinate(place, None)
        speed = self.parameters.speed_m_s
        if "goto" in self.offered[member]:
            wished = {"target": Point(there), "speed": speed, "heading": heading_rad}
            return self.leg(member, "goto", wished, after)
        here = self.coordinate(self.poses[member].place, None)
        wished_route = {"route": Route((here, there)), "speed": speed}
        return self.leg(member, "single_vehicle_routing", wished_route, after)
