"""Keeps the members of a march in their places by limiting their speeds.

A member that is ahead of its place waits. All members wait when one falls back too far. No member
comes too near to the member ahead in its lane, even if that one stops at once; and none to any
other in the plane, if that one brakes as vehicles do: one after the other passes a sharp turn.
Pure: the caller passes the poses; the controller uses no clock.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from m2pem.api.telemetry import TeamMemberState
from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polyline import EastNorthUp
from m2pem.mission.catalogue import ResourceId
from m2pem.teams.clearance import NEAREST_SHARE, Clearance, Way
from m2pem.teams.columns import GAP_SHARE, lane_mates
from m2pem.teams.detours import around, comes_near
from m2pem.teams.plan import (
    REACTION_S,
    REACTION_SHARE,
    START_SHARE,
    March,
    Marcher,
    MemberPose,
)

PERIOD_S = 0.25
"""Period of the formation controller."""

_SLACK_S = 1.5
_SILENT_S = 1.0
"""A member of which nothing new is received for so long is not waited for: it may go on."""

_HARD_BRAKING = 2.0
"""Vehicles brake at most so many times as hard as they do at least."""

_LOOK_AHEAD_M = 50.0
_CRAWL_SHARE = 0.1
"""Share of the march's speed: a member stops below it, and starts again at `START_SHARE`."""

_RESTART_SHARE = 0.1
"""Share of the spacing: a member without variable speed restarts when its gap is that much wider
than needed."""


@dataclass(slots=True, eq=False)
class _Track:
    """A member's progress in metres: `along_m` on its own path, `mark_m` on the team's route.

    `stops_m`: the least distance along its path at which it may come to a stop; `room_m`: how far
    it may go on without coming too near to another one, as far as all is well.
    """

    marcher: Marcher
    back_m: float
    stops_m: float = 0.0
    room_m: float = math.inf
    pose: MemberPose | None = None
    unseen_s: float = 0.0
    along_m: float | None = None
    mark_m: float = -math.inf
    off_m: float | None = None
    stands: bool = False
    arrived: bool = False

    def rest(self) -> list[EastNorthUp]:
        """The places ahead of it."""
        path, along_m = self.marcher.path, self.along_m or 0.0
        return path.rest(path.line.at(along_m), along_m)


class FormationController:
    """Computes the speed of each member of a march.

    `steady`: members that can only move at the march's speed or stop; all others take any speed.
    """

    def __init__(self, march: March, steady: Collection[ResourceId] = ()) -> None:
        self._march = march
        self._steady = frozenset(steady)
        self._tracks = {
            marcher.member: _Track(marcher, marcher.back_m) for marcher in march.marchers
        }
        self._nearest_m = NEAREST_SHARE * march.spacing_m
        self._lost: list[list[EastNorth]] = []
        self._clearance = self._clear()
        self._slack_m = max(march.spacing_m / 2, _SLACK_S * march.speed_m_s)

    @property
    def spacing_m(self) -> float:
        """The spacing between two members in a row."""
        return self._march.spacing_m

    @property
    def floor_m(self) -> float:
        """The minimum distance along the route between two members in one lane."""
        return GAP_SHARE * self._march.spacing_m

    @property
    def marks_m(self) -> tuple[float, ...]:
        """The last known progress of each member along the team's route."""
        return tuple(track.mark_m for track in self._tracks.values())

    def drop(self, member: ResourceId) -> list[ResourceId]:
        """Go on without a member; in a column, the members behind it move up.

        Return the members whose ways lead too near to where the lost one may be: it went on until
        its loss was noticed, and needs its way to stop.
        """
        lost = self._tracks.pop(member, None)
        self._clearance = self._clear()
        if lost is not None and lost.along_m is not None:
            line, from_m = lost.marcher.path.line, lost.along_m
            speed_m_s = lost.pose.speed_m_s if lost.pose is not None else 0.0
            goes_m = speed_m_s * lost.unseen_s + lost.marcher.motion.stopping_m(speed_m_s)
            corners = [
                point
                for point, mark_m in zip(line.points, line.marks_m, strict=True)
                if from_m < mark_m < from_m + goes_m
            ]
            self._lost.append([line.at(from_m), *corners, line.at(from_m + goes_m)])
        if self._march.closes:
            for rank, track in enumerate(self._tracks.values()):
                track.back_m = rank * self._march.spacing_m
        if lost is None or lost.along_m is None:
            return []
        return [
            name
            for name, track in self._tracks.items()
            if not track.arrived and comes_near(track.rest(), self._lost[-1], self._nearest_m)
        ]

    def lead_around(self, member: ResourceId, place: EastNorth) -> Sequence[EastNorthUp]:
        """Return the places to which a member goes that is at `place`, around all lost ones."""
        track = self._tracks[member]
        path = track.marcher.path
        places = path.rest(place, path.find(place, track.along_m, _LOOK_AHEAD_M))
        for lost in self._lost:
            places = around(places, lost, self._march.spacing_m)
        path = path.onward(places)
        track.marcher, track.along_m, track.stops_m = replace(track.marcher, path=path), 0.0, 0.0
        self._clearance = self._clear()
        return places[1:]

    def step(
        self, seen: Mapping[ResourceId, MemberPose], arrived: Collection[ResourceId] = ()
    ) -> dict[ResourceId, float]:
        """Return the maximum speed of each member now, in m/s; 0: it must stand.

        `seen`: the known poses; a member without any pose so far gets no speed. `arrived`: members
        at the end of their way; they get no speed either.
        """
        for member, track in self._tracks.items():
            self._look(track, seen.get(member), member in arrived)
        known = [track for track in self._tracks.values() if track.mark_m > -math.inf]
        if not known:
            return {}
        for track in known:
            self._measure_room(track)
        wanted: dict[ResourceId, float] = {}
        for index, track in enumerate(known):
            if not track.arrived:
                others = [
                    each
                    for each in known
                    if each is not track and not each.arrived and each.unseen_s < _SILENT_S
                ]
                waits_m = max((self._delay_m(other, track) for other in others), default=0.0)
                speed = self._speed(track, known[:index], waits_m)
                track.stands = speed == 0.0
                wanted[track.marcher.member] = speed
        return wanted

    def kept(self) -> tuple[TeamMemberState, ...]:
        """Return the members' deviations from their places, by the last `step`."""
        known = [track for track in self._tracks.values() if track.mark_m > -math.inf]
        states = []
        for track in self._tracks.values():
            member = track.marcher.member
            if track not in known:
                states.append(TeamMemberState(member))
                continue
            gap_m = self._free_m(track, known[: known.index(track)]) + self.floor_m
            states.append(
                TeamMemberState(
                    member,
                    -_lag_m(track, known[0]),
                    track.off_m,
                    gap_m if math.isfinite(gap_m) else None,
                )
            )
        return tuple(states)

    def stuck(self) -> ResourceId | None:
        """Return a member that cannot get to its end any more; None: all can."""
        tracks = list(self._tracks.values())
        at_m = [track.along_m or 0.0 for track in tracks]
        ends_m = [track.marcher.path.line.length_m for track in tracks]
        short_m = max(track.marcher.motion.short_m(self._march.speed_m_s) for track in tracks)
        reached_m = self._clearance.reached_m(at_m, ends_m, short_m)
        stuck = (t for t, end, at in zip(tracks, ends_m, reached_m, strict=True) if at < end)
        return next((track.marcher.member for track in stuck), None)

    def _clear(self) -> Clearance:
        marchers = [track.marcher for track in self._tracks.values()]
        return Clearance(
            [Way(each.path, each.back_m, each.left_m) for each in marchers], self._nearest_m
        )

    def _look(self, track: _Track, stand: MemberPose | None, arrived: bool) -> None:
        path = track.marcher.path
        if arrived:
            track.arrived, track.mark_m = True, path.end_mark_m
            track.along_m = track.stops_m = path.line.length_m
        elif stand is None or (stand.speed_m_s > 0 and stand == track.pose):
            track.unseen_s += PERIOD_S
        else:
            track.pose, track.unseen_s = stand, 0.0
            found_m = path.find(
                stand.place, track.along_m, _LOOK_AHEAD_M, stand.yaw_rad, stand.course_rad
            )
            track.along_m, track.mark_m = found_m, path.mark_m(found_m)
            track.off_m = path.off_m(stand.place, found_m)
            braking_m_s2 = _HARD_BRAKING * track.marcher.motion.braking_m_s2
            track.stops_m = found_m + stand.speed_m_s**2 / (2 * braking_m_s2)

    def _measure_room(self, track: _Track) -> None:
        others = list(self._tracks.values())
        limit_m = self._clearance.limit_m(others.index(track), lambda index: others[index].stops_m)
        ends = limit_m >= track.marcher.path.line.length_m
        track.room_m = math.inf if ends else limit_m - (track.along_m or 0.0)

    def _delay_m(self, track: _Track, other: _Track) -> float:
        """How far a member that can go on has fallen behind another one."""
        needed_m = track.marcher.motion.short_m(self._march.speed_m_s)
        if track.marcher.member in self._steady:
            needed_m = self._all_well_m(track) + _RESTART_SHARE * self._march.spacing_m
        return min(_lag_m(track, other), 0.0 if track.room_m <= needed_m else math.inf)

    def _all_well_m(self, track: _Track) -> float:
        """The room that a member without variable speed needs to go on."""
        stopping_m = track.marcher.motion.stopping_m(
            self._march.speed_m_s, REACTION_S * REACTION_SHARE
        )
        return stopping_m / _HARD_BRAKING

    def _speed(self, track: _Track, before: list[_Track], waits_m: float) -> float:
        """`waits_m`: how far the slowest other member has fallen back behind this one."""
        march_m_s, slack = self._march.speed_m_s, self._slack_m
        lag_m = _lag_m(track, before[0]) if before else 0.0
        if lag_m < 0:  # it does not wait for one that cannot go on
            lag_m = -self._delay_m(before[0], track)
        free_m = self._free_m(track, before)
        motion = track.marcher.motion
        if track.marcher.member not in self._steady:
            speed = min(march_m_s * (1 + lag_m / slack), march_m_s * (2 - waits_m / slack))
            room_m_s = motion.safe_m_s(track.room_m, REACTION_S * REACTION_SHARE)
            return self._graded(track, min(speed, motion.safe_m_s(free_m), room_m_s))
        needed_m = motion.stopping_m(march_m_s)
        free_m = min(free_m, track.room_m - self._all_well_m(track) + needed_m)
        if track.stands:
            wide = free_m >= needed_m + _RESTART_SHARE * self._march.spacing_m
            goes = wide and lag_m >= -slack / 2 and waits_m <= slack
        else:
            goes = free_m > needed_m and lag_m > -slack and waits_m <= 2 * slack
        return march_m_s if goes else 0.0

    def _free_m(self, track: _Track, before: list[_Track]) -> float:
        """The distance to go until it is too near to a member ahead in its lane that stops now."""
        gaps = [
            other.mark_m - track.mark_m
            for other in before
            if lane_mates(other.marcher, track.marcher, self._march.spacing_m)
        ]
        return min(gaps, default=math.inf) - self.floor_m

    def _graded(self, track: _Track, speed_m_s: float) -> float:
        share = START_SHARE if track.stands else _CRAWL_SHARE
        speed = min(speed_m_s, self._march.speed_m_s)
        return 0.0 if speed < share * self._march.speed_m_s else speed


def _lag_m(track: _Track, other: _Track) -> float:
    """Return how far `track` is behind its place relative to `other`, in metres; below 0: ahead.

    A place beyond the end of the member's path counts as the end.
    """
    place_m = other.mark_m + other.back_m - track.back_m
    return min(place_m, track.marcher.path.end_mark_m) - track.mark_m
