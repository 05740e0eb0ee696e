"""Building a vehicle's plan step by step, with rounded turning points."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Self, TypeAlias, Union

from m2pem.geo.polyline import bend
from m2pem.simulation.kinematics import STANDING_LOAD, Kinematics
from m2pem.simulation.segments import (
    Curve,
    Pivot,
    Pose,
    Profile,
    Stand,
    Travel,
    Vector,
    VehiclePhase,
    chain,
    rest_to_rest_length,
)
from m2pem.simulation.trajectory import Plan

_NOTHING_M = 1e-3


@dataclass(frozen=True, slots=True)
class Line:
    """A straight piece. `leg`: which one it is on, from 0."""

    start: Vector
    end: Vector
    leg: int = field(default=0, compare=False)

    @property
    def level_m(self) -> float:
        """Length on the map."""
        return math.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    @property
    def climb_m(self) -> float:
        return self.end[2] - self.start[2]

    @property
    def length_m(self) -> float:
        return math.hypot(self.level_m, self.climb_m)

    @property
    def yaw_rad(self) -> float:
        """Direction on the map, from east counter-clockwise."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])

    def point(self, level_m: float) -> Vector:
        """The point that far from the start on the map."""
        part = level_m / self.level_m
        return (
            self.start[0] + (self.end[0] - self.start[0]) * part,
            self.start[1] + (self.end[1] - self.start[1]) * part,
            self.start[2] + self.climb_m * part,
        )


@dataclass(frozen=True, slots=True)
class Bend:
    """An arc around `centre`; `sweep_rad` is counter-clockwise. `leg`: that which it leads to."""

    centre: tuple[float, float]
    radius_m: float
    angle_rad: float
    sweep_rad: float
    up_m: float
    climb_m: float
    leg: int = field(default=0, compare=False)

    @property
    def level_m(self) -> float:
        """Length on the map."""
        return self.radius_m * abs(self.sweep_rad)

    @property
    def length_m(self) -> float:
        return math.hypot(self.level_m, self.climb_m)


Piece: TypeAlias = Union[Line, Bend]


def turned(start_rad: float, end_rad: float) -> float:
    """The short way from one direction to the other, in -pi to pi."""
    return math.remainder(end_rad - start_rad, math.tau)


def rounded(points: list[Vector], radius_m: float) -> list[list[Piece]]:
    """Runs of pieces that are driven without a stop, through `points`.

    A corner gets a bend of `radius_m`, smaller where the legs are short. Between two runs the
    vehicle stops and turns: at sharp corners, and where a leg goes straight up or down.
    """
    legs = [
        Line(a, b, leg)
        for leg, (a, b) in enumerate(pairwise(points))
        if math.dist(a, b) > _NOTHING_M
    ]
    runs: list[list[Piece]] = [[]]
    arc: Bend | None = None
    cut_m = 0.0
    for index, leg in enumerate(legs):
        start = leg.start
        if index:
            if arc is not None:
                runs[-1].append(arc)
                start = leg.point(cut_m)
            elif cut_m < 0:
                runs.append([])
        end = leg.end
        if index + 1 < len(legs):
            arc, cut_m = _bend(leg, legs[index + 1], radius_m)
            if arc is not None:
                end = leg.point(leg.level_m - cut_m)
        if math.dist(start, end) > _NOTHING_M:
            runs[-1].append(Line(start, end, leg.leg))
    return [run for run in runs if run]


def _bend(before: Line, after: Line, radius_m: float) -> tuple[Bend | None, float]:
    """The bend between two legs and how much it cuts off each; no bend and -1: stop and turn."""
    before_m, after_m = before.level_m, after.level_m
    if before_m < _NOTHING_M or after_m < _NOTHING_M:
        return None, -1.0
    before_rad = before.yaw_rad
    sweep = turned(before_rad, after.yaw_rad)
    if abs(sweep) < 1e-6:
        return None, 0.0
    found = bend(sweep, before_m, after_m, radius_m)
    if found is None:
        return None, -1.0
    radius_m, cut_m = found
    start, end = before.point(before_m - cut_m), after.point(cut_m)
    aside = before_rad + math.copysign(math.pi / 2, sweep)
    centre = (start[0] + radius_m * math.cos(aside), start[1] + radius_m * math.sin(aside))
    climb_m = end[2] - start[2]
    made = Bend(centre, radius_m, aside + math.pi, sweep, start[2], climb_m, after.leg)
    return made, cut_m


_LOOK_RAD = math.radians(3)


def track_of(plan: Plan[Pose]) -> list[tuple[float, float]]:
    """Return the places on the map that a plan passes, with many of a curve."""
    track = []
    for phase in plan.phases:
        if not isinstance(phase, Curve):
            track.append(phase.at(0.0).place[:2])
            continue
        # Every turn of a circle is the same: one is looked at, and what goes beyond whole turns.
        sweep, turn = abs(phase.sweep), math.tau
        looked_rad = sweep if sweep <= turn else turn + sweep % turn
        steps = max(1, math.ceil(looked_rad / _LOOK_RAD))
        step_rad = math.copysign(looked_rad / steps, phase.sweep)
        track += [phase.place(step * step_rad) for step in range(steps)]
    return [*track, plan.phases[-1].at(plan.phases[-1].duration_s).place[:2]]


class RefusedError(Exception):
    """The behavior cannot be done; the text says why, `code` is that of the report."""

    def __init__(self, reason: str, code: str = "REJECTED") -> None:
        self.reason = reason
        self.code = code
        super().__init__(reason)


SLOWEST_M_S = 0.5
"""A vehicle that the wind lets go no faster than this does not get there."""

ALOFT_M = 0.5
"""Higher above its ground than this, a flying vehicle is in the air."""


@dataclass(frozen=True, slots=True)
class Craft:
    """A vehicle as a manoeuvre sees it: what it can do, and how it moves now."""

    name: str
    domain: str
    kinematics: Kinematics
    pose: Pose
    cruise_m_s: float
    home: Vector

    @property
    def flies(self) -> bool:
        """Whether it must take off to move."""
        return self.domain == "air"

    @property
    def aloft(self) -> bool:
        return self.flies and self.pose.place[2] - self.home[2] > ALOFT_M


class Course:
    """A plan in the making. A craft that moves is first braked, straight on."""

    def __init__(self, craft: Craft) -> None:
        self._craft = craft
        self._phases: list[VehiclePhase] = []
        self.place = craft.pose.place
        self.yaw = craft.pose.yaw
        speed = craft.pose.speed
        if speed > 1e-6:
            ve, vn, vu = craft.pose.velocity
            decel = craft.kinematics.deceleration_m_s2
            brake = Profile(speed**2 / (2 * decel), speed, speed, 0.0, 1.0, decel)
            self._travel(self.place, (ve / speed, vn / speed, vu / speed), brake)

    @property
    def steps(self) -> int:
        """How many phases there are, for `plan(cycle_from)`."""
        return len(self._phases)

    @property
    def duration_s(self) -> float:
        return sum(phase.duration_s for phase in self._phases)

    def plan(self, cycle_from: int | None = None) -> Plan[Pose]:
        """What was built. From step `cycle_from` on it repeats for ever."""
        phases = self._phases or [Stand(self.place, self.yaw, 0.0, 0.0)]
        return Plan(phases, cycle_from)

    def stand(self, seconds: float) -> Self:
        aloft = self._craft.flies and self.place[2] - self._craft.home[2] > ALOFT_M
        if seconds > 0:
            load = 1.0 if aloft else STANDING_LOAD
            self._phases.append(Stand(self.place, self.yaw, seconds, load))
        return self

    def turn_to(self, yaw_rad: float) -> Self:
        """Turn on the spot, the short way."""
        sweep = turned(self.yaw, yaw_rad)
        if abs(sweep) > 1e-9:
            seconds = abs(sweep) / self._craft.kinematics.turn_rate_rad_s
            self._phases.append(Pivot(self.place, self.yaw, sweep, seconds))
            self.yaw += sweep
        return self

    def climb_to(self, up_m: float) -> Self:
        return self.through([(self.place[0], self.place[1], up_m)])

    def through(
        self,
        points: list[Vector],
        speed_m_s: float | None = None,
        radius_m: float | None = None,
        leg_speeds_m_s: Sequence[float | None] = (),
    ) -> Self:
        """Along straight legs, round corners (`radius_m` 0: stop and turn), to the last point.

        `leg_speeds_m_s`: to each of the points, in place of `speed_m_s`; None: that.
        """
        kinematics = self._craft.kinematics
        limit = min(speed_m_s or self._craft.cruise_m_s, kinematics.max_speed_m_s)
        limits = [min(each or limit, kinematics.max_speed_m_s) for each in leg_speeds_m_s]
        radius = kinematics.turn_radius_m if radius_m is None else radius_m
        for run in rounded([self.place, *points], radius):
            first = run[0]
            if isinstance(first, Line) and first.level_m > 1e-6:
                self.turn_to(first.yaw_rad)
            pieces = [
                (piece.length_m, self._limit(piece, limits[piece.leg] if limits else limit))
                for piece in run
            ]
            profiles = chain(pieces, kinematics.acceleration_m_s2, kinematics.deceleration_m_s2)
            for piece, profile in zip(run, profiles, strict=True):
                self._add(piece, profile)
        return self

    def back_up(self, distance_m: float, speed_m_s: float | None = None) -> Self:
        """Straight back, without turning."""
        kinematics = self._craft.kinematics
        limit = min(speed_m_s or self._craft.cruise_m_s, self._upwind())
        if distance_m > 0:
            [profile] = chain(
                [(distance_m, limit)], kinematics.acceleration_m_s2, kinematics.deceleration_m_s2
            )
            back = self.yaw + math.pi
            self._travel(self.place, (math.cos(back), math.sin(back), 0.0), profile)
        return self

    def circle(
        self,
        centre: tuple[float, float],
        speed_m_s: float | None = None,
        *,
        sweep_rad: float | None = None,
        seconds: float | None = None,
    ) -> Self:
        """Counter-clockwise around `centre` at the present distance from it.

        `sweep_rad`, or as far as it gets in `seconds`; neither: one lap at even speed, after
        getting up to speed, for a plan that repeats its last step.
        """
        kinematics = self._craft.kinematics
        east, north = self.place[0] - centre[0], self.place[1] - centre[1]
        radius, angle = math.hypot(east, north), math.atan2(north, east)
        accel, decel = kinematics.acceleration_m_s2, kinematics.deceleration_m_s2
        limit = min(
            speed_m_s or self._craft.cruise_m_s, self._upwind(), radius * kinematics.turn_rate_rad_s
        )
        self.turn_to(angle + math.pi / 2)
        if sweep_rad is None and seconds is None:
            run_up = limit**2 / (2 * accel)
            self._arc(centre, radius, angle, Profile(run_up, 0.0, limit, limit, accel, decel))
            lap = Profile(math.tau * radius, limit, limit, limit, accel, decel)
            self._arc(centre, radius, angle + run_up / radius, lap)
            return self
        if seconds is not None:
            length = rest_to_rest_length(seconds, limit, accel, decel)
        else:
            length = radius * (sweep_rad or 0.0)
        if length > 0:
            self._arc(centre, radius, angle, chain([(length, limit)], accel, decel)[0])
        return self

    def _limit(self, piece: Piece, limit: float) -> float:
        kinematics = self._craft.kinematics
        if isinstance(piece, Bend):
            limit = min(limit, piece.radius_m * kinematics.turn_rate_rad_s, self._upwind())
        elif piece.level_m > 1e-6:
            east, north = piece.end[0] - piece.start[0], piece.end[1] - piece.start[1]
            limit = min(limit, self._in_wind(kinematics.ground_speed_m_s(east, north)))
        if piece.climb_m and kinematics.climb_rate_m_s:
            limit = min(limit, kinematics.climb_rate_m_s * piece.length_m / abs(piece.climb_m))
        return limit

    def _upwind(self) -> float:
        return self._in_wind(self._craft.kinematics.upwind_m_s)

    def _in_wind(self, speed_m_s: float) -> float:
        if speed_m_s < SLOWEST_M_S:
            wind_m_s = math.hypot(*self._craft.kinematics.wind_m_s)
            raise RefusedError(
                f"{self._craft.name} makes no headway in a wind of {wind_m_s:.1f} m/s", "WIND"
            )
        return speed_m_s

    def _add(self, piece: Piece, profile: Profile) -> None:
        if isinstance(piece, Line):
            length = piece.length_m
            direction = (
                (piece.end[0] - piece.start[0]) / length,
                (piece.end[1] - piece.start[1]) / length,
                piece.climb_m / length,
            )
            if piece.level_m > 1e-6:
                self.yaw += turned(self.yaw, piece.yaw_rad)
            self._travel(piece.start, direction, profile)
            self.place = piece.end
        else:
            self._arc(
                piece.centre,
                piece.radius_m,
                piece.angle_rad,
                profile,
                sweep=piece.sweep_rad,
                climb=piece.climb_m,
            )

    def _travel(self, start: Vector, direction: Vector, profile: Profile) -> None:
        phase = Travel(start, direction, self.yaw, profile)
        self._phases.append(phase)
        self.place = phase.at(profile.duration_s).place

    def _arc(
        self,
        centre: tuple[float, float],
        radius: float,
        angle: float,
        profile: Profile,
        *,
        sweep: float | None = None,
        climb: float = 0.0,
    ) -> None:
        sweep = profile.length / radius if sweep is None else sweep
        phase = Curve(centre, radius, angle, sweep, self.place[2], climb, profile)
        self._phases.append(phase)
        end = phase.at(profile.duration_s)
        self.place, self.yaw = end.place, end.yaw
