"""Keeps the members of a march in their places, by nothing but how fast each may go.

Whoever is ahead of its place waits, so does everybody when somebody falls back too far, and nobody
comes too near to the one ahead in its lane, even if that one stops dead.
Pure: it is told what is seen, and knows no clock.
"""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from m2pem.api.telemetry import TeamMemberState
from m2pem.mission.catalogue import ResourceId
from m2pem.teams.columns import GAP_SHARE, lane_mates
from m2pem.teams.plan import March, Marcher, MemberPose

_SLACK_S = 1.5
_LOOK_AHEAD_M = 50.0
_CRAWL_SHARE = 0.1
_START_SHARE = 0.2
"""Of the speed of the march: what is slower stops; what stands goes on at the second."""

_RESTART_SHARE = 0.1
"""Of the spacing: how much wider than needed a gap is when one who can but stop and go goes on."""


@dataclass(slots=True, eq=False)
class _Track:
    """What is known of a member: how far it is, along its own path and the team's route."""

    marcher: Marcher
    back_m: float
    along_m: float | None = None
    mark_m: float = -math.inf
    off_m: float | None = None
    stands: bool = False
    arrived: bool = False


class FormationController:
    """`steady`: members that can go or stop, but not slower; all others take any speed."""

    def __init__(self, march: March, steady: Collection[ResourceId] = ()) -> None:
        self._march = march
        self._steady = frozenset(steady)
        self._tracks = {
            marcher.member: _Track(marcher, marcher.back_m) for marcher in march.marchers
        }
        self._slack_m = max(march.spacing_m / 2, _SLACK_S * march.speed_m_s)

    @property
    def spacing_m(self) -> float:
        """Between two of them."""
        return self._march.spacing_m

    @property
    def floor_m(self) -> float:
        """The least way along the route between two in one lane."""
        return GAP_SHARE * self._march.spacing_m

    @property
    def marks_m(self) -> tuple[float, ...]:
        """How far along the route each was seen last."""
        return tuple(track.mark_m for track in self._tracks.values())

    def drop(self, member: ResourceId) -> None:
        """Go on without a member; in a column, who is behind it moves up."""
        self._tracks.pop(member, None)
        if self._march.closes:
            for rank, track in enumerate(self._tracks.values()):
                track.back_m = rank * self._march.spacing_m

    def step(
        self, seen: Mapping[ResourceId, MemberPose], arrived: Collection[ResourceId] = ()
    ) -> dict[ResourceId, float]:
        """How fast each member may go now, in m/s; 0: it must stand.

        `seen`: where those are of whom it is known. Who was never seen is left alone. `arrived`:
        who is at the end of its way; they are told nothing.
        """
        for member, track in self._tracks.items():
            self._look(track, seen.get(member), member in arrived)
        known = [track for track in self._tracks.values() if track.mark_m > -math.inf]
        if not known:
            return {}
        wanted: dict[ResourceId, float] = {}
        for index, track in enumerate(known):
            if not track.arrived:
                others = [each for each in known if each is not track and not each.arrived]
                waits_m = max((_lag_m(other, track) for other in others), default=0.0)
                speed = self._speed(track, known[:index], waits_m)
                track.stands = speed == 0.0
                wanted[track.marcher.member] = speed
        return wanted

    def kept(self) -> tuple[TeamMemberState, ...]:
        """How well the members keep their places, by what `step` saw last."""
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

    def _look(self, track: _Track, stand: MemberPose | None, arrived: bool) -> None:
        path = track.marcher.path
        if arrived:
            track.arrived, track.mark_m = True, path.end_mark_m
        elif stand is not None:
            found_m = path.find(stand.place, track.along_m, _LOOK_AHEAD_M, stand.yaw_rad)
            track.along_m, track.mark_m = found_m, path.mark_m(found_m)
            track.off_m = path.off_m(stand.place, found_m)

    def _speed(self, track: _Track, before: list[_Track], waits_m: float) -> float:
        """`waits_m`: how far the last of the others has fallen back behind this one."""
        march_m_s, slack = self._march.speed_m_s, self._slack_m
        lag_m = _lag_m(track, before[0]) if before else 0.0
        free_m = self._free_m(track, before)
        motion = track.marcher.motion
        if track.marcher.member not in self._steady:
            speed = min(march_m_s * (1 + lag_m / slack), march_m_s * (2 - waits_m / slack))
            return self._graded(track, min(speed, motion.safe_m_s(free_m)))
        needed_m = motion.stopping_m(march_m_s)
        if track.stands:
            wide = free_m >= needed_m + _RESTART_SHARE * self._march.spacing_m
            goes = wide and lag_m >= -slack / 2 and waits_m <= slack
        else:
            goes = free_m > needed_m and lag_m > -slack and waits_m <= 2 * slack
        return march_m_s if goes else 0.0

    def _free_m(self, track: _Track, before: list[_Track]) -> float:
        """The way that it may go before it is too near to one of its lane, were that to stop."""
        gaps = [
            other.mark_m - track.mark_m
            for other in before
            if lane_mates(other.marcher, track.marcher, self._march.spacing_m)
        ]
        return min(gaps, default=math.inf) - self.floor_m

    def _graded(self, track: _Track, speed_m_s: float) -> float:
        share = _START_SHARE if track.stands else _CRAWL_SHARE
        speed = min(speed_m_s, self._march.speed_m_s)
        return 0.0 if speed < share * self._march.speed_m_s else speed


def _lag_m(track: _Track, other: _Track) -> float:
    """How far one is behind the place that is its own beside the other; less than 0: ahead of it.

    Nobody waits for what lies beyond the end of a way.
    """
    place_m = other.mark_m + other.back_m - track.back_m
    return min(place_m, track.marcher.path.end_mark_m) - track.mark_m
