"""Building a vehicle's plan step by step; every step begins and ends at rest."""

import math
from dataclasses import dataclass
from typing import Self

from m2pem.simulation.corners import Bend, Line, Piece, rounded, turned
from m2pem.simulation.domains import STANDING_LOAD, Kinematics
from m2pem.simulation.phases import Curve, Pivot, Pose, Stand, Travel, Vector, VehiclePhase
from m2pem.simulation.speed import Profile, chain, rest_to_rest_length
from m2pem.simulation.track import Plan

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
        """Whether it is in the air."""
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
        """How long it lasts so far."""
        return sum(phase.duration_s for phase in self._phases)

    def plan(self, cycle_from: int | None = None) -> Plan[Pose]:
        """What was built. From step `cycle_from` on it repeats for ever."""
        phases = self._phases or [Stand(self.place, self.yaw, 0.0, 0.0)]
        return Plan(phases, cycle_from)

    def stand(self, seconds: float) -> Self:
        """Stay where it is."""
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
        """Straight up or down."""
        return self.through([(self.place[0], self.place[1], up_m)])

    def through(
        self, points: list[Vector], speed_m_s: float | None = None, radius_m: float | None = None
    ) -> Self:
        """Along straight legs, round corners (`radius_m` 0: stop and turn), to the last point."""
        kinematics = self._craft.kinematics
        limit = min(speed_m_s or self._craft.cruise_m_s, kinematics.max_speed_m_s)
        radius = kinematics.turn_radius_m if radius_m is None else radius_m
        for run in rounded([self.place, *points], radius):
            first = run[0]
            if isinstance(first, Line) and first.level_m > 1e-6:
                self.turn_to(first.yaw_rad)
            pieces = [(piece.length_m, self._limit(piece, limit)) for piece in run]
            profiles = chain(pieces, kinematics.acceleration_m_s2, kinematics.deceleration_m_s2)
            for piece, profile in zip(run, profiles, strict=True):
                self._add(piece, profile)
        return self

    def back_up(self, distance_m: float, speed_m_s: float | None = None) -> Self:
        """Straight back, without turning."""
        kinematics = self._craft.kinematics
        limit = min(speed_m_s or self._craft.cruise_m_s, kinematics.max_speed_m_s)
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
            speed_m_s or self._craft.cruise_m_s,
            kinematics.max_speed_m_s,
            radius * kinematics.turn_rate_rad_s,
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
            limit = min(limit, piece.radius_m * kinematics.turn_rate_rad_s)
        if piece.climb_m and kinematics.climb_rate_m_s:
            limit = min(limit, kinematics.climb_rate_m_s * piece.length_m / abs(piece.climb_m))
        return limit

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
