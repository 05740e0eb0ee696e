"""A trajectory: a plan of segments, how its time runs against the clock, and its retiming."""

import bisect
import math
from collections.abc import Iterable, Sequence
from itertools import accumulate
from typing import Generic, Protocol, Self, TypeVar

import msgspec

from m2pem.simulation.kinematics import Kinematics
from m2pem.simulation.segments import (
    Curve,
    Pivot,
    Pose,
    Profile,
    Stand,
    Steer,
    Travel,
    along,
    chain,
    time_scaled,
)
from m2pem.units import US_PER_S

_NOTHING_S = 1e-9
_SOON_S = 0.01
_ROUNDING_S = 1e-3
"""Much more than what rounding may change in the time at which a distance is gone."""


class Slowable(Protocol):
    """A pose or a look."""

    def slowed(self, rate: float, /) -> Self:
        """The same, passed at `rate` times the speed."""
        ...


S = TypeVar("S", bound=Slowable)
S_co = TypeVar("S_co", bound=Slowable, covariant=True)


class Phase(Protocol[S_co]):
    """One phase of a plan; see `m2pem.simulation.segments`."""

    @property
    def duration_s(self) -> float:
        """How long it lasts; may be infinite."""
        ...

    @property
    def load(self) -> float:
        """How fast it drains the battery: 1.0 is what `endurance` means."""
        ...

    def at(self, t: float, /) -> S_co:
        """Where the body is, `t` seconds after the phase's start."""
        ...


class Plan(Generic[S]):
    """Phases in a row. From `cycle_from` on they repeat for ever; None: they end.

    A plan has at least one phase, and each phase begins where the one before it ended.
    """

    def __init__(self, phases: Iterable[Phase[S]], cycle_from: int | None = None) -> None:
        self.phases = tuple(phases)
        self.cycle_from = cycle_from
        self._durations_s = [phase.duration_s for phase in self.phases]
        self._ends: list[float] = []
        self._work: list[float] = []
        self._level_m_after: list[float] = []
        end = work = 0.0
        for phase, duration_s in zip(self.phases, self._durations_s, strict=True):
            end += duration_s
            work += duration_s * phase.load if phase.load else 0.0
            self._ends.append(end)
            self._work.append(work)

    @property
    def duration_s(self) -> float:
        """How long it lasts; infinite when it repeats."""
        return math.inf if self.cycle_from is not None else self._ends[-1]

    def time_scaled(self, factor: float) -> "Plan[S]":
        """Return the same motion, which takes `factor` times as long."""
        phases = [time_scaled(phase, factor) for phase in self.phases]  # type: ignore[arg-type]  # only such phases are made
        return Plan(phases, self.cycle_from)  # type: ignore[arg-type]  # each is of its kind still

    def at(self, t: float) -> S:
        """Where the body is at plan time `t`, in seconds; before and after it stands."""
        index, inside, _ = self._find(t)
        found = self.phases[index].at(inside)
        return found.slowed(0.0) if t >= self.duration_s else found

    def place(self, t: float) -> tuple[int, float]:
        """Which phase plan time `t` is in, and for how long it has been."""
        index, inside, _ = self._find(t)
        return index, inside

    def work(self, t: float) -> float:
        """Seconds of full battery load until plan time `t`."""
        index, inside, laps_work = self._find(t)
        before = self._work[index - 1] if index else 0.0
        load_s = min(inside, self._durations_s[index]) * self.phases[index].load
        return laps_work + before + load_s

    def driven_m(self, t: float) -> float:
        """Return the length in space of the way until plan time `t`."""
        index, inside, _ = self._find(t)
        driven_m = sum(map(_length_m, self.phases[:index], self._durations_s))
        if self.cycle_from is not None and t > self._ends[-1]:
            lap_s = self._ends[-1] - (self._ends[self.cycle_from - 1] if self.cycle_from else 0.0)
            lap = slice(self.cycle_from, None)
            lap_m = sum(map(_length_m, self.phases[lap], self._durations_s[lap]))
            # Whole laps: `inside` is within the phase of the last one.
            done_s = self._ends[index - 1] + inside if index else inside
            driven_m += round((t - done_s) / lap_s) * lap_m
        return driven_m + _length_m(self.phases[index], inside)

    def level_m_left(self, t: float) -> float:
        """Return the length on the map from plan time `t` to the plan's end."""
        after_m = self._level_m_after_each()
        index, inside, _ = self._find(t)
        return _level_m(self.phases[index], inside) + after_m[index]

    def when_level_m_left(self, level_m: float) -> float:
        """Return the plan time from which on the length on the map to the plan's end is no more
        than that; the plan must end."""
        after_m = self._level_m_after_each()
        if level_m < 0:
            return self.duration_s
        # The phase within which it becomes so; before it there is more left, after it less.
        last = len(self.phases) - 1
        within = bisect.bisect_left(after_m, -level_m, key=lambda left_m: -left_m)
        begin_s = self._ends[within - 1] if within else 0.0
        end_s = self._ends[within] if within < last else math.inf
        phase = self.phases[within]
        about_s = begin_s + _when_level_m(phase, level_m - after_m[within])
        low, high = 0.0, self.duration_s
        while high - low > _SOON_S:
            middle = (low + high) / 2
            if abs(middle - about_s) > _ROUNDING_S:
                before = middle < about_s
            else:
                left_m = _level_m(phase, middle - begin_s) + after_m[within]
                before = middle < begin_s or (middle < end_s and left_m > level_m)
            if before:
                low = middle
            else:
                high = middle
        return high

    def _level_m_after_each(self) -> list[float]:
        """Return the length on the map after each phase."""
        if not self._level_m_after:
            lengths = [_level_m(phase, 0.0) for phase in self.phases[:0:-1]]
            self._level_m_after = [*accumulate(lengths, initial=0.0)][::-1]
        return self._level_m_after

    def _find(self, t: float) -> tuple[int, float, float]:
        laps_work = 0.0
        if self.cycle_from is not None and t >= self._ends[-1]:
            start = self._ends[self.cycle_from - 1] if self.cycle_from else 0.0
            work = self._work[self.cycle_from - 1] if self.cycle_from else 0.0
            lap_s = self._ends[-1] - start
            laps = math.floor((t - start) / lap_s)
            t -= laps * lap_s
            laps_work = laps * (self._work[-1] - work)
        index = min(bisect.bisect_right(self._ends, t), len(self._ends) - 1)
        return index, max(0.0, t - (self._ends[index - 1] if index else 0.0)), laps_work


def _length_m(phase: object, until_s: float) -> float:
    """Return the length in space of a phase until a time after its start."""
    match phase:
        case Travel() | Curve():
            return phase.profile.at(until_s)[0]
        case Steer():
            until_s = min(until_s, phase.duration_s)
            first, middle, last = (phase.at(until_s * part).speed for part in (0.0, 0.5, 1.0))
            return until_s * (first + 4 * middle + last) / 6  # by Simpson's rule
        case _:
            return 0.0


def _level_m(phase: object, from_s: float) -> float:
    """Return the length on the map of a phase from a time after its start."""
    if not isinstance(phase, Travel | Curve):
        return 0.0
    return _level_share(phase) * (phase.profile.length - phase.profile.at(from_s)[0])


def _when_level_m(phase: object, level_m: float) -> float:
    """Return the time after a phase's start at which its length on the map from there is that, but
    for rounding."""
    if not isinstance(phase, Travel | Curve) or not (share := _level_share(phase)):
        return 0.0
    return phase.profile.when(phase.profile.length - level_m / share)


def _level_share(phase: Travel | Curve) -> float:
    """Return which part of a way's length is its length on the map."""
    if isinstance(phase, Travel):
        return math.hypot(*phase.direction[:2])
    return phase.radius * abs(phase.sweep) / phase.profile.length


class Warp(msgspec.Struct, frozen=True):
    """Plan time as a function of the clock: from `tau` at `since_us`, its rate goes evenly from
    `rate` to `target` within `ramp_s`, and stays."""

    since_us: int
    tau: float = 0.0
    rate: float = 1.0
    target: float = 1.0
    ramp_s: float = 0.0

    def at(self, now_us: int) -> tuple[float, float]:
        """Plan time in seconds, and its rate."""
        t = max(0, now_us - self.since_us) / US_PER_S
        if t >= self.ramp_s:
            ramp = (self.rate + self.target) / 2 * self.ramp_s
            return self.tau + ramp + self.target * (t - self.ramp_s), self.target
        rate = self.rate + (self.target - self.rate) * t / self.ramp_s
        return self.tau + (self.rate + rate) / 2 * t, rate

    def when(self, tau: float) -> int | None:
        """The first microsecond at which plan time has reached `tau`; None: never."""
        missing = tau - self.tau
        if missing <= _NOTHING_S:
            return self.since_us
        ramp = (self.rate + self.target) / 2 * self.ramp_s
        if missing > ramp + _NOTHING_S:
            if self.target <= 0 or math.isinf(missing):
                return None
            return self._us(self.ramp_s + (missing - ramp) / self.target)
        slope = (self.target - self.rate) / self.ramp_s
        root = math.sqrt(max(0.0, self.rate**2 + 2 * slope * missing))
        return self._us(2 * missing / (self.rate + root))

    def turned(self, now_us: int, target: float, ramp_s: float) -> "Warp":
        """Heading for another rate from now on."""
        tau, rate = self.at(now_us)
        return Warp(now_us, tau, rate, target, ramp_s)

    @property
    def settled_us(self) -> int:
        """When its rate has become `target`."""
        return self._us(self.ramp_s)

    def _us(self, seconds: float) -> int:
        # A ten-thousandth of a microsecond of float noise must not cost a whole one.
        return self.since_us + math.ceil(seconds * US_PER_S - 1e-4)


class Track(Generic[S]):
    """A plan in the time of the clock. `counted_us`: battery load is counted from then on."""

    def __init__(
        self,
        plan: Plan[S],
        started_us: int,
        warp: Warp | None = None,
        counted_us: int | None = None,
    ) -> None:
        self.plan = plan
        self.started_us = started_us
        self.warp = warp or Warp(started_us)
        self.counted_us = started_us if counted_us is None else counted_us
        self._counted_tau = 0.0 if counted_us is None else self._tau(counted_us)
        self._counted_work = plan.work(self._counted_tau)

    def at(self, now_us: int) -> S:
        tau, rate = self.warp.at(now_us)
        found = self.plan.at(tau)
        return found if rate == 1.0 else found.slowed(rate)

    @property
    def end_us(self) -> int | None:
        """When the plan ends; None: never, as things stand."""
        return self.warp.when(self.plan.duration_s)

    def load_s(self, now_us: int, standing_load: float) -> float:
        """Seconds of full battery load since `counted_us`; of `standing_load` while it stands."""
        tau = self._tau(now_us)
        moving_s = tau - self._counted_tau
        standing_s = max(0.0, (now_us - self.counted_us) / US_PER_S - moving_s)
        work = self.plan.work(tau) - self._counted_work
        return work + standing_s * standing_load

    def driven_m(self, now_us: int) -> float:
        """Return the length in space of the way since the plan began."""
        return self.plan.driven_m(self._tau(now_us))

    def count_from(self, now_us: int) -> None:
        """Count battery load from now on."""
        self.counted_us = now_us
        self._counted_tau = self._tau(now_us)
        self._counted_work = self.plan.work(self._counted_tau)

    def hold(self, now_us: int, braking_s: float) -> None:
        """Slow to a stop within `braking_s`."""
        self.warp = self.warp.turned(now_us, 0.0, braking_s)

    def go_on(self, now_us: int) -> None:
        """Undo `hold`: speed up as long as braking took."""
        braked_s = min(self.warp.ramp_s, (now_us - self.warp.since_us) / US_PER_S)
        self.warp = self.warp.turned(now_us, 1.0, braked_s)

    def _tau(self, now_us: int) -> float:
        return min(self.warp.at(now_us)[0], self.plan.duration_s)


_NOTHING = 1e-9


def retimed(
    plan: Plan[Pose], tau: float, speed_m_s: float, limit_m_s: float, kinematics: Kinematics
) -> Plan[Pose] | None:
    """A plan that goes on from plan time `tau`, at which the vehicle goes `speed_m_s`.

    `limit_m_s`: how fast it may go from now on; it brakes if it is faster. None: it has arrived, or
    its plan repeats without a stop.
    """
    limit = min(limit_m_s, kinematics.max_speed_m_s)
    index, inside = plan.place(tau)
    first = plan.cycle_from
    lap = () if first is None else plan.phases[first:]
    if tau >= plan.duration_s or (lap and _moves_at_first(lap[0])):
        return None
    rest = [_remaining(plan.phases[index], inside), *plan.phases[index + 1 :]]
    if first is not None and index < first:
        rest = rest[: first - index]
    timed = _timed(rest, speed_m_s, limit, kinematics)
    if not lap:
        return Plan(timed) if timed else None
    return Plan([*timed, *_timed(lap, 0.0, limit, kinematics)], cycle_from=len(timed))


def _moves_at_first(phase: Phase[Pose]) -> bool:
    return isinstance(phase, Travel | Curve) and phase.profile.v_in > _NOTHING


def _remaining(phase: Phase[Pose], inside_s: float) -> Phase[Pose]:
    match phase:
        case Travel() | Curve():
            gone = phase.profile.at(inside_s)[0]
            return _part(phase, gone, phase.profile.length, phase.profile)
        case Pivot():
            left_s = phase.duration_s - inside_s
            share = left_s / phase.duration_s if phase.duration_s > 0 else 0.0
            return Pivot(phase.place, phase.at(inside_s).yaw, phase.sweep * share, left_s)
        case Stand():
            return msgspec.structs.replace(phase, duration_s=phase.duration_s - inside_s)
        case _:
            return phase


def _part(phase: Travel | Curve, from_m: float, to_m: float, profile: Profile) -> Travel | Curve:
    """A piece of a way; the profile gets its length."""
    length = to_m - from_m
    profile = msgspec.structs.replace(profile, length=length)
    if isinstance(phase, Travel):
        return Travel(
            along(phase.start, phase.direction, from_m), phase.direction, phase.yaw, profile
        )
    whole = phase.profile.length
    return Curve(
        phase.centre,
        phase.radius,
        phase.angle + phase.sweep * from_m / whole,
        phase.sweep * length / whole,
        phase.up + phase.climb * from_m / whole,
        phase.climb * length / whole,
        profile,
    )


def _timed(
    phases: Sequence[Phase[Pose]], speed: float, limit: float, kinematics: Kinematics
) -> list[Phase[Pose]]:
    """Stretches between two stops, each timed anew; `speed`: at the beginning of the first."""
    found: list[Phase[Pose]] = []
    run: list[Travel | Curve] = []
    for phase in phases:
        if isinstance(phase, Travel | Curve):
            run.append(phase)
            if phase.profile.v_out > _NOTHING:
                continue
        found += _stretch(run, speed, limit, kinematics)
        run = []
        speed = 0.0
        if not isinstance(phase, Travel | Curve):
            found.append(phase)
    return found


def _stretch(
    run: Sequence[Travel | Curve], speed: float, limit: float, kinematics: Kinematics
) -> list[Phase[Pose]]:
    """One stretch, to its stop. First of all it brakes, if it is too fast."""
    accel, decel = kinematics.acceleration_m_s2, kinematics.deceleration_m_s2
    found: list[Phase[Pose]] = []
    left: list[Travel | Curve] = []
    for phase in run:
        length = phase.profile.length
        if length <= _NOTHING:
            continue
        brakes_m = max(0.0, speed**2 - limit**2) / (2 * decel) if not left else 0.0
        braked_m = min(length, brakes_m)
        if braked_m > _NOTHING:
            slower = math.sqrt(max(0.0, speed**2 - 2 * decel * braked_m))
            found.append(
                _part(phase, 0.0, braked_m, Profile(braked_m, speed, speed, slower, accel, decel))
            )
            speed = slower
        if length - braked_m > _NOTHING:
            left.append(_part(phase, braked_m, length, phase.profile))
    pieces = [(phase.profile.length, _bound(phase, limit, kinematics)) for phase in left]
    profiles = chain(pieces, accel, decel, v_in=speed)
    return [
        *found,
        *(
            _part(phase, 0.0, phase.profile.length, profile)
            for phase, profile in zip(left, profiles, strict=True)
        ),
    ]


def _bound(phase: Travel | Curve, limit: float, kinematics: Kinematics) -> float:
    """How fast its shape lets it be."""
    length = phase.profile.length
    if isinstance(phase, Curve):
        climb_m = abs(phase.climb)
        limit = min(limit, phase.radius * kinematics.turn_rate_rad_s, kinematics.upwind_m_s)
    else:
        if math.hypot(*phase.direction[:2]) > _NOTHING:
            limit = min(limit, kinematics.ground_speed_m_s(*phase.direction[:2]))
        climb_m = abs(phase.direction[2]) * length
    if climb_m > _NOTHING and kinematics.climb_rate_m_s:
        limit = min(limit, kinematics.climb_rate_m_s * length / climb_m)
    return limit
