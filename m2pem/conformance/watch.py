"""What telemetry shows of one vehicle in one behavior: deviations at once, evidence at its end.

A `Watch` is pure: it gets the states of a vehicle one after the other, and no clock. What a state
does not have is not judged.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from m2pem.api.commanded import Commanded, ExpectedEnd
from m2pem.api.telemetry import LinkState, VehicleState
from m2pem.conformance.bounds import LOOKS, SEEN_WITHIN_S, Bounds, turn_m
from m2pem.conformance.coverage import Coverage
from m2pem.conformance.way import Way
from m2pem.geo.fence import Fence
from m2pem.geo.local_frame import EastNorth, LatLon, LocalFrame
from m2pem.mission.values import Value
from m2pem.units import US_PER_S

FENCE_EVERY_US = 1_000_000
"""A distance from a fence takes long to find, and no vehicle is far outside within this time."""

FASTEST_M_S = 100.0
"""A speed above this is not believed."""

USUAL_M_S = 20.0
"""How fast a vehicle may have been while it was not seen, at least."""

STOPS_WITHIN_S = 20.0
"""A vehicle that is to stay where it is may take so long to stop."""

HIGH_M = 3.0
"""Aircraft that are commanded to be no higher are not missed there."""


@dataclass(frozen=True, slots=True)
class Deviation:
    """A vehicle does not do what it is commanded. `text`: what was measured, and the bound, for
    people; `since_us`: when it began. `ends`: whether its behavior is ended for it; else operators
    are alerted only."""

    what: str
    text: str
    measured: float
    bound: float
    since_us: int
    ends: bool = True


class _Lasting:
    """Since when something is so, and in how many states in a row."""

    __slots__ = ("looks", "since_us")

    def __init__(self) -> None:
        self.since_us, self.looks = 0, 0

    def lasts(self, wrong: bool, now_us: int, for_s: float, looks: int = LOOKS) -> bool:
        if not wrong:
            self.looks = 0
            return False
        if self.looks == 0:
            self.since_us = now_us
        self.looks += 1
        return self.looks >= looks and now_us - self.since_us >= for_s * US_PER_S


class Watch:
    """`flies`: it is an aircraft. `fences`: where it may be. `start`: its state at the begin, if it
    is known; `adopted`: the behavior began before it was watched."""

    def __init__(
        self,
        commanded: Commanded,
        bounds: Bounds,
        *,
        flies: bool = False,
        fences: Sequence[Fence] = (),
        start: VehicleState | None = None,
        adopted: bool = False,
    ) -> None:
        self.commanded = commanded
        self._bounds = bounds
        self._flies = flies
        self._fences = list(fences)
        self._adopted = adopted
        self._frame: LocalFrame | None = None
        self._way: Way | None = None
        self._coverage: Coverage | None = None
        self._start: EastNorth | None = None
        self._start_height_m: float | None = None
        self._state: VehicleState | None = None
        self._here: EastNorth | None = None
        self._speed_m_s = 0.0
        self._armed = self._aloft = self._was_fast = False
        self._highest_m = -math.inf
        self._sink_m_s = 0.0
        self._height_error_m = 0.0
        self._farthest_m = 0.0
        self._fence_us = self._began_us = 0
        self._stays_at: EastNorth | None = None
        self._last: dict[str, _Lasting] = {}
        self._progress: tuple[float, int] | None = None
        self.states = 0
        if start is not None:
            self.observe(start)

    # --- states -----------------------------------------------------------------------------------

    def observe(self, state: VehicleState) -> Deviation | None:
        """Take the next state of the vehicle; return how it deviates, if it does."""
        before = self._state
        if state.link is not LinkState.CONNECTED:
            return None
        if before is not None and state.time_us <= before.time_us:
            return None
        self.states += 1
        self._state = state
        found = self._in_the_air(state)
        if state.position is None:
            self._here = None
            return found
        if self._frame is None:
            self._begin(state, state.position.latlon)
        assert self._frame is not None
        here = self._frame.to_local(state.position.latlon)
        seen_from, gap_s = self._here, math.inf
        if before is not None:
            gap_s = (state.time_us - before.time_us) / US_PER_S
        fastest_m_s = self._speed_m_s
        self._speed_m_s = _speed_m_s(state, seen_from, here, gap_s)
        self._here = here
        if self._start is None:
            self._start = here
            self._start_height_m = state.altitude_above_home_m
        if gap_s > SEEN_WITHIN_S:
            seen_from = None
        elif found is None and seen_from is not None:
            found = self._jump(state, seen_from, here, gap_s, max(fastest_m_s, self._speed_m_s))
        self._farthest_m = max(self._farthest_m, math.dist(self._start, here))
        unseen_m = 0.0 if before is None else gap_s * max(USUAL_M_S, fastest_m_s, self._speed_m_s)
        off = self._along(state, seen_from, here, unseen_m)
        return found or off or self._outside(state) or self._too_fast(state) or self._drift(state)

    def _begin(self, state: VehicleState, place: LatLon) -> None:
        """Lay the frame at the first position, and find what it may leave from there."""
        self._frame = LocalFrame(place)
        commanded = self.commanded
        if commanded.way:
            points = [self._frame.to_local(each[:2]) for each in commanded.way]
            self._way = Way(points, loop=commanded.loop, anywhere=self._adopted)
        if commanded.lines:
            lines = [(self._frame.to_local(a), self._frame.to_local(b)) for a, b in commanded.lines]
            self._coverage = Coverage(lines, commanded.reach_m)
        self._fences = [each for each in self._fences if each.outside_m(place) <= 0]
        self._fence_us = self._began_us = state.time_us

    # --- safety -----------------------------------------------------------------------------------

    def _in_the_air(self, state: VehicleState) -> Deviation | None:
        up_m, bounds = state.altitude_above_home_m, self._bounds
        if not self._flies:
            return None
        was_armed, self._armed = self._armed, self._armed or state.armed is True
        was_aloft, self._aloft = self._aloft, self._aloft or state.landed is False
        if up_m is not None:
            self._highest_m = max(self._highest_m, up_m)
        lands = self.commanded.end is ExpectedEnd.LANDED  # perhaps on a hill
        if was_armed and state.armed is False and up_m is not None and not lands:
            high = up_m > bounds.disarmed_above_m
            if self._lasts("disarmed", high, state, 0.0, 1):
                text = f"disarmed {up_m:.0f} m above home"
                return self._deviation("disarmed", text, up_m, bounds.disarmed_above_m)
        if state.velocity_enu_m_s is not None:
            sinks_m_s = -state.velocity_enu_m_s[2]
            self._sink_m_s = sinks_m_s if sinks_m_s > 0 else self._sink_m_s
            if self._lasts("falling", sinks_m_s > bounds.fall_m_s, state, 0.0, 2):
                text = f"falls at {sinks_m_s:.0f} m/s (bound: {bounds.fall_m_s:g} m/s)"
                return self._deviation("falling", text, sinks_m_s, bounds.fall_m_s)
        grounded = was_aloft and state.landed is True and self.commanded.in_air
        if self._lasts("on the ground", grounded, state, 0.0, 2):
            text = "on the ground, and commanded to be in the air"
            return self._deviation("on the ground", text, up_m or 0.0, 0.0)
        return None

    def _jump(
        self, state: VehicleState, was: EastNorth, here: EastNorth, gap_s: float, speed_m_s: float
    ) -> Deviation | None:
        bound_m = self._bounds.jump_m + 1.5 * speed_m_s * gap_s
        jump_m = math.dist(was, here)
        if not self._lasts("jump", jump_m > bound_m, state, 0.0, 1):
            return None
        text = f"its position has jumped by {jump_m:.0f} m in {gap_s:.1f} s"
        return self._deviation("jump", text, jump_m, bound_m)

    def _outside(self, state: VehicleState) -> Deviation | None:
        """Where fences hold; a vehicle on its way home may leave them (`Fence.way_home`)."""
        if not self._fences or state.position is None:
            return None
        if (
            self.commanded.end is ExpectedEnd.HOME
            or state.time_us - self._fence_us < FENCE_EVERY_US
        ):
            return None
        self._fence_us = state.time_us
        place, bound_m = state.position.latlon, self._bounds.fence_m + self._speed_m_s
        out_m = max(each.outside_m(place) for each in self._fences)
        if not self._lasts("fence", out_m > bound_m, state, 0.0, 2):
            return None
        text = f"{out_m:.0f} m outside of its fence (bound: {bound_m:.0f} m)"
        return self._deviation("fence", text, out_m, bound_m)

    # --- the way ----------------------------------------------------------------------------------

    def _along(
        self, state: VehicleState, seen_from: EastNorth | None, here: EastNorth, unseen_m: float
    ) -> Deviation | None:
        speed_m_s, bounds = self._speed_m_s, self._bounds
        slack_m = turn_m(speed_m_s)
        done = None
        found: Deviation | None = None
        if self._coverage is not None:
            self._coverage.moved(seen_from, here, unseen_m)
            done = self._coverage.share
        if self._way is not None:
            assert self._start is not None
            way = self._way
            bound_m = bounds.cross_track_m + slack_m
            off_m = way.moved(seen_from, here, self._start, self._reach_m(), bound_m)
            done = way.done_m
            wrong = self.commanded.straight and off_m > bound_m
            if self._lasts("cross-track", wrong, state, bounds.cross_track_s):
                text = (
                    f"{off_m:.0f} m off the way to {way.where} for "
                    f"{self._for_s('cross-track', state):.0f} s (bound: {bound_m:.0f} m)"
                )
                found = self._deviation("cross-track", text, off_m, bound_m)
        return (
            found
            or self._too_low(state)
            or self._stuck(state, done, was_seen=seen_from is not None)
        )

    def _reach_m(self) -> float:
        own_m = self.commanded.tolerance_m
        reach_m = self._bounds.waypoint_m + turn_m(self._speed_m_s)
        return reach_m if own_m is None else max(reach_m, own_m + self._bounds.waypoint_m / 2)

    def _too_low(self, state: VehicleState) -> Deviation | None:
        if not (self._flies and self.commanded.in_air):
            return None
        heights = self._heights(state)
        if heights is None:
            return None
        up_m, low_m, high_m = heights
        error_m = low_m - up_m if up_m < low_m else max(0.0, up_m - high_m)
        self._height_error_m = max(self._height_error_m, error_m)
        above_home_m = state.altitude_above_home_m
        low_above_home_m = low_m if above_home_m is None else low_m - up_m + above_home_m
        bound_m = max(HIGH_M, min(self._bounds.height_m, low_above_home_m / 2))
        if not self._lasts("height", error_m > bound_m, state, self._bounds.height_s):
            return None
        wanted = f"{low_m:.0f} m" if low_m == high_m else f"{low_m:.0f} to {high_m:.0f} m"
        text = (
            f"at {up_m:.0f} m instead of {wanted} for {self._for_s('height', state):.0f} s "
            f"(bound: {bound_m:.0f} m)"
        )
        return self._deviation("height", text, error_m, bound_m)

    def _heights(self, state: VehicleState) -> tuple[float, float, float] | None:
        """The vehicle's height, and the lowest and greatest of where it may be, in one frame; None:
        they cannot be compared."""
        commanded, way = self.commanded, self._way
        near = []
        if way is not None:
            near = [(commanded.way[at][2], commanded.frames[at]) for at in way.around]
        elif self._coverage is not None and self._coverage.entered:
            near = [(commanded.height_m, commanded.height_frame)]
        if not near or any(up_m is None or frame != near[0][1] for up_m, frame in near):
            return None
        frame, heights = near[0][1], [up_m for up_m, _ in near if up_m is not None]
        up_m = _height_m(state, frame)
        if up_m is None:
            return None
        if way is not None and way.approaches:
            if self._start_height_m is None or state.altitude_above_home_m is None:
                return None
            heights.append(self._start_height_m + up_m - state.altitude_above_home_m)
        return up_m, min(heights), max(heights)

    def _stuck(
        self, state: VehicleState, done: float | None, *, was_seen: bool
    ) -> Deviation | None:
        """Whether it rests on its way; unless `was_seen`, it may have moved meanwhile."""
        if done is None or self.commanded.end in (ExpectedEnd.NONE, ExpectedEnd.REST):
            return None
        reached, since_us = self._progress or (done, state.time_us)
        rests = was_seen and done <= reached and self._speed_m_s <= self._bounds.rest_m_s
        if self._progress is None or not rests:
            self._progress = max(done, reached), state.time_us
            return None
        still_s = (state.time_us - since_us) / US_PER_S
        if still_s < self._bounds.stuck_s:
            return None
        self._progress = reached, state.time_us
        text = f"has made no progress for {still_s:.0f} s"
        return Deviation("stuck", text, still_s, self._bounds.stuck_s, since_us, ends=False)

    def _too_fast(self, state: VehicleState) -> Deviation | None:
        if self.commanded.speed_m_s is None:
            return None
        bound_m_s = self._bounds.over_speed * self.commanded.speed_m_s + self._bounds.rest_m_s
        fast = self._speed_m_s > bound_m_s
        if not self._lasts("speed", fast, state, self._bounds.over_speed_s) or self._was_fast:
            return None
        self._was_fast = True  # which is said once
        text = f"moves at {self._speed_m_s:.1f} m/s (bound: {bound_m_s:.1f} m/s)"
        return self._deviation("speed", text, self._speed_m_s, bound_m_s, ends=False)

    def _drift(self, state: VehicleState) -> Deviation | None:
        if self.commanded.end is not ExpectedEnd.REST or self._here is None:
            return None
        if self._stays_at is None:
            stops = state.time_us - self._began_us < STOPS_WITHIN_S * US_PER_S
            if not (stops and self._speed_m_s > self._bounds.rest_m_s):
                self._stays_at = self._here
            return None
        # Wings circle around the place: twice the diameter of their turn.
        bound_m = self._bounds.drift_m + 2 * turn_m(self._speed_m_s)
        drift_m = math.dist(self._stays_at, self._here)
        if not self._lasts("drift", drift_m > bound_m, state, 0.0):
            return None
        text = f"{drift_m:.0f} m from where it is to stay (bound: {bound_m:.0f} m)"
        return self._deviation("drift", text, drift_m, bound_m)

    def _lasts(
        self, what: str, wrong: bool, state: VehicleState, for_s: float, looks: int = LOOKS
    ) -> bool:
        lasting = self._last.get(what)
        if lasting is None:
            if not wrong:
                return False
            lasting = self._last[what] = _Lasting()
        return lasting.lasts(wrong, state.time_us, for_s, looks)

    def _for_s(self, what: str, state: VehicleState) -> float:
        return (state.time_us - self._last[what].since_us) / US_PER_S

    def _deviation(
        self, what: str, text: str, measured: float, bound: float, *, ends: bool = True
    ) -> Deviation:
        return Deviation(what, text, measured, bound, self._last[what].since_us, ends)

    # --- the end ----------------------------------------------------------------------------------

    @property
    def at_rest(self) -> bool | None:
        """Whether the vehicle was at rest in its last state; None: that is not known."""
        if self._state is None or self._here is None:
            return None
        velocity = self._state.velocity_enu_m_s
        if velocity is None:
            return None
        return math.hypot(*velocity) <= self._bounds.rest_m_s

    def goes_on_from(self, place: EastNorth | None) -> str:
        """Return how the vehicle goes on although it was to stop, at a place of its frame; "": it
        does not. Aircraft with wings circle, within twice the diameter of their turn."""
        if place is None or self._here is None or self.at_rest is not False:
            return ""
        away_m, bound_m = math.dist(place, self._here), self._bounds.drift_m
        if away_m <= bound_m + 2 * turn_m(self._speed_m_s):
            return ""
        return f"it moves at {self._speed_m_s:.1f} m/s, {away_m:.0f} m from where it was to stop"

    @property
    def here(self) -> EastNorth | None:
        """Where the vehicle was last, in metres of a frame of the watch; None: not known."""
        return self._here

    def missing(self) -> str:
        """Return what a success promises that was not seen; "": nothing, or telemetry says nothing
        of it."""
        state, commanded = self._state, self.commanded
        if state is None:
            return ""
        match commanded.end:
            case ExpectedEnd.PLACE if self._way is not None:
                return self._way.missing()
            case ExpectedEnd.COVERED if self._coverage is not None:
                share, bound = self._coverage.share, self._bounds.covered
                if share < bound:
                    return f"only {share:.0%} of its lines were covered (bound: {bound:.0%})"
            case ExpectedEnd.MOVED:
                if self._farthest_m < commanded.distance_m / 2:
                    return f"it has moved by {self._farthest_m:.1f} m of {commanded.distance_m:g} m"
            case ExpectedEnd.HEIGHT:
                return self._missing_height(state)
            case ExpectedEnd.LANDED:
                if state.landed is False:
                    return "it is not on the ground"
                if state.landed is None and self.at_rest is False and state.armed is not False:
                    return "it still moves"
            case ExpectedEnd.HOME:
                return self._missing_home(state)
            case _:
                pass
        return ""

    def _missing_height(self, state: VehicleState) -> str:
        up_m, wanted_m = _height_m(state, self.commanded.height_frame), self.commanded.height_m
        if up_m is None or wanted_m is None:
            return ""
        bound_m = max(HIGH_M, min(self._bounds.height_m, abs(wanted_m) / 4))
        if abs(up_m - wanted_m) <= bound_m:
            return ""
        return f"it is at {up_m:.0f} m instead of {wanted_m:.0f} m"

    def _missing_home(self, state: VehicleState) -> str:
        if state.home is None or self._frame is None or self._here is None:
            return ""
        away_m = math.dist(self._frame.to_local(state.home.latlon), self._here)
        if away_m <= self._bounds.drift_m + 2 * turn_m(self._speed_m_s):
            return ""
        return f"it is {away_m:.0f} m from its home"

    def evidence(self) -> dict[str, Value]:
        """Return what was seen, as values of JSON: distances in metres, `covered` as a share."""
        state, seen = self._state, dict[str, Value]()
        if state is None or state.position is None:
            return {"seen": False}
        if self._way is not None:
            seen |= self._way.evidence()
        if self._coverage is not None:
            seen["covered"] = round(self._coverage.share, 3)
        if self._height_error_m:
            seen["height_error_m"] = round(self._height_error_m, 1)
        if self.commanded.end is ExpectedEnd.LANDED and self._sink_m_s:
            seen["touch_down_m_s"] = round(self._sink_m_s, 1)
        latitude, longitude = (round(degrees, 7) for degrees in state.position.latlon)
        seen["ended"] = [latitude, longitude, round(state.position.altitude_m, 1)]
        return seen


def _height_m(state: VehicleState, frame: str) -> float | None:
    if frame == "relative":
        return state.altitude_above_home_m
    return state.position.altitude_m if frame == "amsl" and state.position is not None else None


def _speed_m_s(state: VehicleState, was: EastNorth | None, here: EastNorth, gap_s: float) -> float:
    if state.velocity_enu_m_s is not None:
        speed_m_s = math.hypot(*state.velocity_enu_m_s[:2])
    elif was is not None and 0 < gap_s <= SEEN_WITHIN_S:
        speed_m_s = math.dist(was, here) / gap_s
    else:
        return 0.0
    return min(speed_m_s, FASTEST_M_S)
