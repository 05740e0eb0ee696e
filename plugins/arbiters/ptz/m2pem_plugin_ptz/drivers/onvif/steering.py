"""Where the camera is wanted to look, and how quickly that changes."""

import math
from collections import deque
from dataclasses import dataclass
from itertools import pairwise

from m2pem_plugin_ptz.drivers.onvif.spaces import into
from m2pem_plugin_ptz.gimbal import Reach

WINDOW_S = 0.25
"""Over so long the speed of the target is measured."""

SHORTEST_S = 0.08
"""Over less than this it is not."""

STALE_S = 0.35
"""Who aims at something that moves says where it is more often than that."""

JUMP = 1.3
"""A wish that moves so many times as quickly as the camera can is another target."""

Pair = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Wish:
    """One call of `point`; `rate_rad_s` is already bounded by what the camera can."""

    pan_rad: float
    tilt_rad: float
    rate_rad_s: float
    at_s: float


class Aim:
    """The wishes of late."""

    def __init__(self, reach: Reach) -> None:
        self.reach = reach
        self._wishes: deque[Wish] = deque()

    @property
    def wish(self) -> Wish | None:
        """The last one; None: there is none."""
        return self._wishes[-1] if self._wishes else None

    def want(self, pan_rad: float, tilt_rad: float, rate_rad_s: float | None, now_s: float) -> None:
        """A new wish."""
        reach = self.reach
        pan = into(pan_rad, reach.pan_rad)
        if not reach.endless:
            pan = min(max(pan, reach.pan_rad[0]), reach.pan_rad[1])
        tilt = min(max(tilt_rad, reach.tilt_rad[0]), reach.tilt_rad[1])
        rate = min(rate_rad_s or math.inf, reach.rate_rad_s)
        wish = Wish(pan, tilt, rate, now_s)
        last = self.wish
        if last is not None:
            seconds = max(now_s - last.at_s, SHORTEST_S)
            way = max(map(abs, self.apart((pan, tilt), (last.pan_rad, last.tilt_rad))))
            if way > JUMP * reach.rate_rad_s * seconds or now_s - last.at_s > STALE_S:
                self._wishes.clear()
        self._wishes.append(wish)
        while now_s - self._wishes[0].at_s > WINDOW_S:
            self._wishes.popleft()

    def forget(self) -> None:
        """Nothing is wanted any more."""
        self._wishes.clear()

    def velocity(self, now_s: float) -> Pair:
        """Of what is aimed at, in rad/s."""
        if len(self._wishes) < 2:
            return 0.0, 0.0
        first, last = self._wishes[0], self._wishes[-1]
        seconds = last.at_s - first.at_s
        if seconds < SHORTEST_S or now_s - last.at_s > STALE_S:
            return 0.0, 0.0
        pan, tilt = self.apart((last.pan_rad, last.tilt_rad), (first.pan_rad, first.tilt_rad))
        return pan / seconds, tilt / seconds

    def at(self, time_s: float, now_s: float) -> Pair:
        """Where it will be; there must be a wish."""
        wish = self._wishes[-1]
        ahead = time_s - wish.at_s
        pan_rate, tilt_rate = self.velocity(now_s)
        pan, tilt = wish.pan_rad + pan_rate * ahead, wish.tilt_rad + tilt_rate * ahead
        low, high = self.reach.tilt_rad
        tilt = min(max(tilt, low), high)
        if not self.reach.endless:
            pan = min(max(pan, self.reach.pan_rad[0]), self.reach.pan_rad[1])
        return pan, tilt

    def apart(self, one: Pair, other: Pair) -> Pair:
        """The way from the other to the one, as the camera turns."""
        pan = one[0] - other[0]
        return (math.remainder(pan, math.tau) if self.reach.endless else pan), one[1] - other[1]


STANDS_RAD_S = math.radians(0.15)
"""What moves more slowly is followed by absolute moves."""

FAR_RAD = math.radians(10.0)
NEAR_RAD = math.radians(6.0)
"""From here on it is followed, until it is farther than `FAR_RAD`."""

SAME_RAD = math.radians(0.02)
"""Goals that are nearer to each other are one."""

CAUGHT_RAD = math.radians(1.0)
"""A goal that is to be met on the way may be as much off."""

AGAIN_S = 1.5
"""A camera that does not move to its goal is told so again."""

WORTH_S = 0.3
"""A way that takes less time is gone at the rate that was told."""

ARRIVED_RAD = math.radians(0.1)
STUCK = 3
"""A camera that was told so often again does not turn."""

FIRST_LAG_S = 0.1
TAKES_EFFECT = 0.6
"""At this part of a call, the move begins."""

SHARE_S = 0.45
"""An error is made good in about so long, or in `LAGS` times the delay, if that is longer."""

LAGS = 2.5
HABIT = 0.35
"""How quickly the speed at which the camera really turns is learned, per second."""


@dataclass(frozen=True, slots=True)
class Turn:
    """Turn there and stay, at this speed."""

    pan_rad: float
    tilt_rad: float
    rate_rad_s: float


@dataclass(frozen=True, slots=True)
class Drive:
    """Turn on at this velocity."""

    pan_rad_s: float
    tilt_rad_s: float


class Steering:
    """One camera's. All times are seconds of one clock. `turns`: it takes absolute moves; `drives`:
    it takes velocities."""

    def __init__(self, reach: Reach, *, turns: bool = True, drives: bool = True) -> None:
        self.aim = Aim(reach)
        self._turns, self._drives = turns, drives
        self._lag_s = FIRST_LAG_S
        self._seen: tuple[float, Pair] | None = None
        self._driven: deque[tuple[float, Pair]] = deque([(-math.inf, (0.0, 0.0))])
        self._turn: Turn | None = None
        self._turned_s = -math.inf
        self._moved_s = -math.inf
        self._bias: Pair = (0.0, 0.0)
        self._bias_s = 0.0
        self._agains = 0

    @property
    def stuck(self) -> bool:
        """It was told again and again, and does not turn."""
        return self._agains >= STUCK

    @property
    def lag_s(self) -> float:
        """How long a call takes."""
        return self._lag_s

    def saw(self, pan_rad: float, tilt_rad: float, at_s: float) -> None:
        """Where the camera looked, at a time."""
        if self._seen is not None:
            way = max(map(abs, self.aim.apart((pan_rad, tilt_rad), self._seen[1])))
            if way > SAME_RAD / 4:
                self._moved_s, self._agains = at_s, 0
        self._seen = at_s, (pan_rad, tilt_rad)

    def took(self, seconds: float) -> None:
        """How long the last call took."""
        self._lag_s += 0.2 * (min(seconds, 2.0) - self._lag_s)

    def told(self, move: Turn | Drive, at_s: float) -> None:
        """The camera was told to; it takes effect at a time."""
        if isinstance(move, Turn):
            self._turn, self._turned_s = move, at_s
            self._driven.append((at_s, (0.0, 0.0)))
        else:
            self._turn = None
            self._driven.append((at_s, (move.pan_rad_s, move.tilt_rad_s)))
        while len(self._driven) > 2 and self._driven[1][0] < at_s - 3.0:
            self._driven.popleft()

    def forget(self) -> None:
        """The camera does something else now, or nothing: what it was told counts no more."""
        self._turn, self._turned_s = None, -math.inf
        self._bias = (0.0, 0.0)
        self._agains = 0
        self._driven.clear()
        self._driven.append((-math.inf, (0.0, 0.0)))

    def next(self, now_s: float) -> Turn | Drive | None:
        """What to tell it now; None: nothing new."""
        wish = self.aim.wish
        if wish is None:
            return None
        effect_s = now_s + TAKES_EFFECT * self._lag_s
        target, velocity = self.aim.at(effect_s, now_s), self.aim.velocity(now_s)
        moving = max(map(abs, velocity)) > STANDS_RAD_S
        if self._seen is None:
            return self._goto(target, wish.rate_rad_s, now_s, SAME_RAD) if self._turns else None
        error = self.aim.apart(target, self._head(effect_s))
        if not self._drives or (self._turns and not moving):
            self._bias = (0.0, 0.0)
            return self._goto(target, wish.rate_rad_s, now_s, SAME_RAD)
        off = max(map(abs, error))
        if self._turns and off > (NEAR_RAD if self._turn is not None else FAR_RAD):
            self._bias = (0.0, 0.0)
            meet_s = effect_s + off / wish.rate_rad_s
            return self._goto(self.aim.at(meet_s, now_s), wish.rate_rad_s, now_s, CAUGHT_RAD)
        return self._follow(error, velocity, wish.rate_rad_s, now_s)

    def _goto(self, goal: Pair, rate_rad_s: float, now_s: float, same_rad: float) -> Turn | None:
        turn = self._turn
        if turn is not None and not self._other_rate(turn, rate_rad_s):
            way = max(map(abs, self.aim.apart(goal, (turn.pan_rad, turn.tilt_rad))))
            if way <= same_rad and not self._idle_elsewhere(turn, now_s):
                return None
        return Turn(*goal, rate_rad_s)

    def _other_rate(self, turn: Turn, rate_rad_s: float) -> bool:
        """Another rate counts while there is a way left for it; who aims at something says another
        one with every look."""
        if rate_rad_s == turn.rate_rad_s or self._seen is None:
            return False
        left = self.aim.apart((turn.pan_rad, turn.tilt_rad), self._seen[1])
        return max(map(abs, left)) > WORTH_S * max(rate_rad_s, turn.rate_rad_s)

    def _idle_elsewhere(self, turn: Turn, now_s: float) -> bool:
        """It neither looks where it was told to, nor turns."""
        if self._seen is None or now_s - max(self._turned_s, self._moved_s) < AGAIN_S:
            return False
        goal = turn.pan_rad, turn.tilt_rad
        if max(map(abs, self.aim.apart(goal, self._seen[1]))) <= ARRIVED_RAD:
            return False
        self._agains += 1
        return True

    def _follow(self, error: Pair, velocity: Pair, rate_rad_s: float, now_s: float) -> Drive:
        share = 1.0 / max(SHARE_S, LAGS * self._lag_s)
        seconds, self._bias_s = min(now_s - self._bias_s, 0.5), now_s
        driven = []
        learned = []
        for axis in (0, 1):
            bias = self._bias[axis] + HABIT * share * error[axis] * seconds
            bound = 0.5 * abs(velocity[axis]) + 0.01
            bias = min(max(bias, -bound), bound)
            learned.append(bias)
            wanted = velocity[axis] + bias + share * error[axis]
            driven.append(min(max(wanted, -rate_rad_s), rate_rad_s))
        self._bias = learned[0], learned[1]
        return Drive(driven[0], driven[1])

    def _head(self, time_s: float) -> Pair:
        """Where the camera will look, by what it was told since it was seen."""
        assert self._seen is not None
        seen_s, (pan, tilt) = self._seen
        ends = [*self._driven, (time_s, (0.0, 0.0))]
        for (begin_s, (pan_rate, tilt_rate)), (end_s, _) in pairwise(ends):
            seconds = min(end_s, time_s) - max(begin_s, seen_s)
            if seconds > 0:
                pan += pan_rate * seconds
                tilt += tilt_rate * seconds
        return pan, tilt
