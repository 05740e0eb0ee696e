"""Keeps the members of a march in their places by limiting their speeds.

A member that is ahead of its place waits. All members wait when one falls back too far. No member
comes too near to the member ahead in its lane, even if that one stops at once; and none to any
other in the plane, if that one brakes as vehicles do: one after the other passes a sharp turn.
Pure: the caller passes the poses; the controller uses no clock.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from m2pem.api.telemetry import TeamMemberState
from m2pem.geo.lazy_imports import shapely
from m2pem.geo.polyline import EastNorthUp
from m2pem.mission.catalogue import ResourceId
from m2pem.teams.clearance import NEAREST_SHARE, Clearance
from m2pem.teams.columns import GAP_SHARE, lane_mates
from m2pem.teams.paths import lead_around
from m2pem.teams.plan import SOON_S, START_SHARE, March, Marcher, MemberPose

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

PERIOD_S = 0.25
"""Period of the formation controller."""

_SLACK_S = 1.5
_SILENT_S = 1.0
"""A member of which nothing new is received for so long is not waited for, as it may go on; those
behind it may come to its place."""


_LOOK_AHEAD_M = 50.0
_HERE_M = 1.0

_CRAWL_SHARE = 0.1
"""Share of the march's speed: a member stops below it, and starts again at `START_SHARE`."""

_RESTART_SHARE = 0.1
"""Share of the spacing: a member without variable speed restarts when its gap is that much wider
than needed."""


@dataclass(slots=True, eq=False)
class _Track:
    """A member's progress in metres: `along_m` on its own path, `mark_m` on the team's route.

    `stops_m`: the least distance along its path at which it may come to a stop. How far it may go
    on without coming too near to another one: `room_m` if that one brakes as vehicles do, with
    `settling_s` to stop there; `free_m` if it stops at once, at a distance that is less.
    """

    marcher: Marcher
    back_m: float
    stops_m: float = 0.0
    room_m: float = math.inf
    free_m: float = math.inf
    settling_s: float = SOON_S
    pose: MemberPose | None = None
    unseen_s: float = 0.0
    along_m: float | None = None
    mark_m: float = -math.inf
    off_m: float | None = None
    stands: bool = False
    arrived: bool = False

    def find(self, pose: MemberPose) -> float:
        """Return how far along its path the member is: at the beginning, if it begins there."""
        near_m, first = self.along_m, self.marcher.path.places[0]
        if near_m is None and math.dist(pose.place, first[:2]) < _HERE_M:
            near_m = 0.0
        moved_m = math.dist(pose.place, self.pose.place) if self.pose is not None else 0.0
        if pose.course_rad is None:
            return self.marcher.path.find(pose.place, near_m, 2 * moved_m + 1, pose.yaw_rad)
        return self.marcher.path.find(pose.place, near_m, _LOOK_AHEAD_M, pose.course_rad)

    def ahead(self, way_m: float = math.inf) -> "BaseGeometry":
        """Return its path from where it is, as far as that."""
        from shapely.ops import substring  # noqa: PLC0415  # slow to load

        from_m = self.along_m or 0.0
        return substring(shapely.LineString(self.marcher.path.line.points), from_m, from_m + way_m)


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
        self._lost: list[BaseGeometry] = []
        self._clearance = self._clear()
        self._slack_m = max(march.spacing_m / 2, _SLACK_S * march.speed_m_s)

    @property
    def spacing_m(self) -> float:
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
        if self._march.closes:
            for rank, track in enumerate(self._tracks.values()):
                track.back_m = rank * self._march.spacing_m
        self._clearance = self._clear()
        if lost is None or lost.along_m is None:
            return []
        speed_m_s = lost.pose.speed_m_s if lost.pose is not None else 0.0
        if lost.unseen_s and not lost.stands:
            speed_m_s = max(speed_m_s, self._march.speed_m_s)
        goes_m = speed_m_s * lost.unseen_s + lost.marcher.motion.stopping_m(speed_m_s)
        where = lost.ahead(goes_m)
        self._lost.append(where)
        return [
            name
            for name, track in self._tracks.items()
            if not track.arrived and track.ahead().distance(where) < self._nearest_m
        ]

    def lead_around(self, member: ResourceId, pose: MemberPose) -> Sequence[EastNorthUp]:
        """Return the places to which a member goes that is at `pose`, around all lost ones and
        those behind it, and within the fence; none: there is no way.

        A way that would end too near to a lost one ends beside it.
        """
        track, tracks = self._tracks[member], list(self._tracks.values())
        path = track.marcher.path
        behind = [each.pose.place for each in tracks[tracks.index(track) + 1 :] if each.pose]
        where = (*self._lost, *map(shapely.Point, behind))
        fence = track.marcher.fence.apart_from([each.buffer(self.spacing_m) for each in where])
        places = lead_around(path.rest(pose.place, track.find(pose)), fence)
        if not places:
            return []
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
        for track in known:
            if not track.arrived:
                others = [
                    each
                    for each in known
                    if each is not track and not each.arrived and each.unseen_s < _SILENT_S
                ]
                waits_m = max((self._delay_m(other, track) for other in others), default=0.0)
                speed = self._speed(track, known[0], waits_m)
                track.stands = speed == 0.0
                wanted[track.marcher.member] = speed
        return wanted

    def kept(self) -> tuple[TeamMemberState, ...]:
        """Return the members' deviations from their places, by the last `step`."""
        known: list[_Track] = []
        states = []
        for member, track in self._tracks.items():
            if track.mark_m == -math.inf:
                states.append(TeamMemberState(member))
                continue
            gaps_m = (
                other.mark_m - track.mark_m
                for other in known
                if lane_mates(other.marcher, track.marcher, self.spacing_m)
            )
            gap_m = min(gaps_m, default=None)
            known.append(track)
            states.append(TeamMemberState(member, -_lag_m(track, known[0]), track.off_m, gap_m))
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
        return Clearance(marchers, self._nearest_m, self._march.in_order)

    def _look(self, track: _Track, stand: MemberPose | None, arrived: bool) -> None:
        path = track.marcher.path
        if arrived:
            track.arrived, track.mark_m = True, path.marks_m[-1]
            track.along_m = track.stops_m = path.line.length_m
        elif stand is None or (stand.speed_m_s > 0 and stand == track.pose):
            track.unseen_s += PERIOD_S
            if track.unseen_s >= _SILENT_S and track.along_m is not None:
                track.stops_m = track.along_m  # it may stand there
        else:
            found_m = track.find(stand)
            track.pose, track.unseen_s = stand, 0.0
            track.along_m, track.mark_m = found_m, path.mark_m(found_m)
            track.off_m = math.dist(stand.place, path.line.at(found_m))
            track.stops_m = found_m + track.marcher.motion.hard_stop_m(stand.speed_m_s)

    def _measure_room(self, track: _Track) -> None:
        """Measure the room if the others brake, and if they stop where they are now."""
        others, along_m = list(self._tracks.values()), track.along_m or 0.0
        limits_m = (
            self._clearance.limit_m(others.index(track), at.__getitem__)
            for at in ([each.stops_m for each in others], [each.along_m or 0.0 for each in others])
        )
        then_m, now_m = (
            math.inf if limit_m >= track.marcher.path.line.length_m else limit_m - along_m
            for limit_m in limits_m
        )
        soon_m = track.marcher.motion.stopping_m(max(0.0, now_m) / SOON_S, SOON_S)
        track.room_m = min(then_m, soon_m)
        # Those that move go on meanwhile.
        track.settling_s = track.marcher.motion.settling_s if then_m == now_m else SOON_S
        track.free_m = now_m + self._nearest_m - self.floor_m

    def _delay_m(self, track: _Track, other: _Track) -> float:
        """How far a member that can go on has fallen behind another one."""
        motion, march_m_s = track.marcher.motion, self._march.speed_m_s
        goes = track.room_m > motion.short_m(march_m_s)
        if track.marcher.member in self._steady:
            needed_m = motion.stopping_m(march_m_s) + _RESTART_SHARE * self.spacing_m
            goes = self._steady_free_m(track) >= needed_m
        return min(_lag_m(track, other), math.inf if goes else 0.0)

    def _steady_free_m(self, track: _Track) -> float:
        """How far a member without variable speed may go on, to stop from the march's speed."""
        motion, march_m_s = track.marcher.motion, self._march.speed_m_s
        braked_m = march_m_s * SOON_S + motion.hard_stop_m(march_m_s)
        return min(track.free_m, track.room_m - braked_m + motion.stopping_m(march_m_s))

    def _speed(self, track: _Track, lead: _Track, waits_m: float) -> float:
        """`waits_m`: how far the slowest other member has fallen back behind this one."""
        march_m_s, slack = self._march.speed_m_s, self._slack_m
        lag_m = _lag_m(track, lead)
        if lag_m < 0:  # it does not wait for one that cannot go on
            lag_m = -self._delay_m(lead, track)
        motion = track.marcher.motion
        if track.marcher.member not in self._steady:
            speed = min(march_m_s * (1 + lag_m / slack), march_m_s * (2 - waits_m / slack))
            room_m_s = motion.safe_m_s(track.room_m, track.settling_s)
            return self._graded(track, min(speed, motion.safe_m_s(track.free_m), room_m_s))
        needed_m = motion.stopping_m(march_m_s)
        free_m = self._steady_free_m(track)
        if track.stands:
            wide = free_m >= needed_m + _RESTART_SHARE * self._march.spacing_m
            goes = wide and lag_m >= -slack / 2 and waits_m <= slack
        else:
            goes = free_m > needed_m and lag_m > -slack and waits_m <= 2 * slack
        return march_m_s if goes else 0.0

    def _graded(self, track: _Track, speed_m_s: float) -> float:
        share = START_SHARE if track.stands else _CRAWL_SHARE
        speed = min(speed_m_s, self._march.speed_m_s)
        return 0.0 if speed < share * self._march.speed_m_s else speed


def _lag_m(track: _Track, other: _Track) -> float:
    """Return how far `track` is behind its place relative to `other`, in metres; below 0: ahead.

    A place beyond the end of the member's path counts as the end.
    """
    place_m = other.mark_m + other.back_m - track.back_m
    return min(place_m, track.marcher.path.marks_m[-1]) - track.mark_m
