"""The moves that make a camera with slow answers point at its target.

A target at rest gets an absolute move. A moving target is first met by absolute moves to where
it will be, and then followed by velocities: that of the target plus a part of the error. Error and
part are computed for the time when the move takes effect; `measure_call` measures the delay.
"""

import math
from collections import deque
from dataclasses import dataclass
from itertools import pairwise

from m2pem_plugin_ptz.drivers.onvif.spaces import wrap_into
from m2pem_plugin_ptz.gimbal import Reach

WINDOW_S = 0.25
"""The speed of the target is measured over this time."""

SHORTEST_S = 0.08
"""The speed is not measured over less than this."""

STALE_S = 0.35
"""A moving target is updated more often than this."""

JUMP = 1.3
"""A request that moves this many times faster than the camera can is another target."""

Pair = tuple[float, float]


@dataclass(frozen=True, slots=True)
class PointRequest:
    """One call of `point`. `rate_rad_s` is bounded by the limit of the camera."""

    pan_rad: float
    tilt_rad: float
    rate_rad_s: float
    at_s: float


class MovingTarget:
    """The target of the last requests, and its velocity."""

    def __init__(self, reach: Reach) -> None:
        self.reach = reach
        self._requests: deque[PointRequest] = deque()

    @property
    def request(self) -> PointRequest | None:
        """The last request; None if there is none."""
        return self._requests[-1] if self._requests else None

    def add(self, pan_rad: float, tilt_rad: float, rate_rad_s: float | None, now_s: float) -> None:
        """Add a request."""
        reach = self.reach
        pan = wrap_into(pan_rad, reach.pan_rad)
        if not reach.endless:
            pan = min(max(pan, reach.pan_rad[0]), reach.pan_rad[1])
        tilt = min(max(tilt_rad, reach.tilt_rad[0]), reach.tilt_rad[1])
        rate = min(rate_rad_s or math.inf, reach.rate_rad_s)
        request = PointRequest(pan, tilt, rate, now_s)
        last = self.request
        if last is not None:
            seconds = max(now_s - last.at_s, SHORTEST_S)
            way = max(map(abs, self.apart((pan, tilt), (last.pan_rad, last.tilt_rad))))
            if way > JUMP * reach.rate_rad_s * seconds or now_s - last.at_s > STALE_S:
                self._requests.clear()
        self._requests.append(request)
        while now_s - self._requests[0].at_s > WINDOW_S:
            self._requests.popleft()

    def forget(self) -> None:
        """Drop all requests."""
        self._requests.clear()

    def velocity(self, now_s: float) -> Pair:
        """Return the velocity of the target, in rad/s."""
        if len(self._requests) < 2:
            return 0.0, 0.0
        first, last = self._requests[0], self._requests[-1]
        seconds = last.at_s - first.at_s
        if seconds < SHORTEST_S or now_s - last.at_s > STALE_S:
            return 0.0, 0.0
        pan, tilt = self.apart((last.pan_rad, last.tilt_rad), (first.pan_rad, first.tilt_rad))
        return pan / seconds, tilt / seconds

    def at(self, time_s: float, now_s: float) -> Pair:
        """Return the predicted direction at a time. There must be a request."""
        request = self._requests[-1]
        ahead = time_s - request.at_s
        pan_rate, tilt_rate = self.velocity(now_s)
        pan, tilt = request.pan_rad + pan_rate * ahead, request.tilt_rad + tilt_rate * ahead
        low, high = self.reach.tilt_rad
        tilt = min(max(tilt, low), high)
        if not self.reach.endless:
            pan = min(max(pan, self.reach.pan_rad[0]), self.reach.pan_rad[1])
        return pan, tilt

    def apart(self, one: Pair, other: Pair) -> Pair:
        """Return the difference of two directions, as the camera turns."""
        pan = one[0] - other[0]
        return (math.remainder(pan, math.tau) if self.reach.endless else pan), one[1] - other[1]


STANDS_RAD_S = math.radians(0.15)
"""A slower target is followed by absolute moves."""

FAR_RAD = math.radians(10.0)
NEAR_RAD = math.radians(6.0)
"""A nearer target is followed by velocities, until it is farther than `FAR_RAD`."""

SAME_RAD = math.radians(0.02)
"""Goals closer to each other than this count as one."""

CAUGHT_RAD = math.radians(1.0)
"""Tolerance of a goal that meets a moving target."""

AGAIN_S = 1.5
"""After this time without a move towards its goal, the camera is commanded again."""

WORTH_S = 0.3
"""A turn shorter than this is finished at the old rate."""

ARRIVED_RAD = math.radians(0.1)
STUCK = 3
"""A camera that was commanded this often again is stuck."""

FIRST_LAG_S = 0.1
TAKES_EFFECT = 0.6
"""A move takes effect at this part of its call."""

SHARE_S = 0.45
"""Time constant of the correction of errors, or `LAGS` times the delay, if that is longer."""

LAGS = 2.5
HABIT = 0.35
"""How fast the real speed of the camera is learned, per second."""


@dataclass(frozen=True, slots=True)
class AbsoluteMove:
    """Turn to a direction at this rate, and stay."""

    pan_rad: float
    tilt_rad: float
    rate_rad_s: float


@dataclass(frozen=True, slots=True)
class ContinuousMove:
    """Turn at this velocity."""

    pan_rad_s: float
    tilt_rad_s: float


class Steering:
    """The moves of one camera. All times are seconds of one clock. `turns`: it takes absolute
    moves. `drives`: it takes velocities."""

    def __init__(self, reach: Reach, *, turns: bool = True, drives: bool = True) -> None:
        self.target = MovingTarget(reach)
        self._turns, self._drives = turns, drives
        self.lag_s = FIRST_LAG_S
        """The duration of a call."""
        self._seen: tuple[float, Pair] | None = None
        self._driven: deque[tuple[float, Pair]] = deque([(-math.inf, (0.0, 0.0))])
        self._turn: AbsoluteMove | None = None
        self._turned_s = -math.inf
        self._moved_s = -math.inf
        self._bias: Pair = (0.0, 0.0)
        self._bias_s = 0.0
        self._agains = 0

    @property
    def stuck(self) -> bool:
        """Whether the camera was commanded repeatedly and does not turn."""
        return self._agains >= STUCK

    def observe(self, pan_rad: float, tilt_rad: float, at_s: float) -> None:
        """Process the direction of the camera at a time."""
        if self._seen is not None:
            way = max(map(abs, self.target.apart((pan_rad, tilt_rad), self._seen[1])))
            if way > SAME_RAD / 4:
                self._moved_s, self._agains = at_s, 0
        self._seen = at_s, (pan_rad, tilt_rad)

    def measure_call(self, seconds: float) -> None:
        """Process the duration of the last call."""
        self.lag_s += 0.2 * (min(seconds, 2.0) - self.lag_s)

    def sent(self, move: AbsoluteMove | ContinuousMove, at_s: float) -> None:
        """Process a command that takes effect at a time."""
        if isinstance(move, AbsoluteMove):
            self._turn, self._turned_s = move, at_s
            self._driven.append((at_s, (0.0, 0.0)))
        else:
            self._turn = None
            self._driven.append((at_s, (move.pan_rad_s, move.tilt_rad_s)))
        while len(self._driven) > 2 and self._driven[1][0] < at_s - 3.0:
            self._driven.popleft()

    def forget(self) -> None:
        """Drop the last commands, as the camera does something else now."""
        self._turn, self._turned_s = None, -math.inf
        self._bias = (0.0, 0.0)
        self._agains = 0
        self._driven.clear()
        self._driven.append((-math.inf, (0.0, 0.0)))

    def next(self, now_s: float) -> AbsoluteMove | ContinuousMove | None:
        """Return the next move; None if there is nothing new."""
        request = self.target.request
        if request is None:
            return None
        effect_s = now_s + TAKES_EFFECT * self.lag_s
        target, velocity = self.target.at(effect_s, now_s), self.target.velocity(now_s)
        moving = max(map(abs, velocity)) > STANDS_RAD_S
        if self._seen is None:
            return (
                self._absolute_move(target, request.rate_rad_s, now_s, SAME_RAD)
                if self._turns
                else None
            )
        error = self.target.apart(target, self._predict(effect_s))
        if not self._drives or (self._turns and not moving):
            self._bias = (0.0, 0.0)
            return self._absolute_move(target, request.rate_rad_s, now_s, SAME_RAD)
        off = max(map(abs, error))
        if self._turns and off > (NEAR_RAD if self._turn is not None else FAR_RAD):
            self._bias = (0.0, 0.0)
            meet_s = effect_s + off / request.rate_rad_s
            return self._absolute_move(
                self.target.at(meet_s, now_s), request.rate_rad_s, now_s, CAUGHT_RAD
            )
        return self._continuous_move(error, velocity, request.rate_rad_s, now_s)

    def _absolute_move(
        self, goal: Pair, rate_rad_s: float, now_s: float, same_rad: float
    ) -> AbsoluteMove | None:
        turn = self._turn
        if turn is not None and not self._other_rate(turn, rate_rad_s):
            way = max(map(abs, self.target.apart(goal, (turn.pan_rad, turn.tilt_rad))))
            if way <= same_rad and not self._idle_elsewhere(turn, now_s):
                return None
        return AbsoluteMove(*goal, rate_rad_s)

    def _other_rate(self, turn: AbsoluteMove, rate_rad_s: float) -> bool:
        """Whether another rate matters for the rest of the turn. A moving target has a new rate in
        each request."""
        if rate_rad_s == turn.rate_rad_s or self._seen is None:
            return False
        left = self.target.apart((turn.pan_rad, turn.tilt_rad), self._seen[1])
        return max(map(abs, left)) > WORTH_S * max(rate_rad_s, turn.rate_rad_s)

    def _idle_elsewhere(self, turn: AbsoluteMove, now_s: float) -> bool:
        """Whether the camera neither points at its goal nor turns."""
        if self._seen is None or now_s - max(self._turned_s, self._moved_s) < AGAIN_S:
            return False
        goal = turn.pan_rad, turn.tilt_rad
        if max(map(abs, self.target.apart(goal, self._seen[1]))) <= ARRIVED_RAD:
            return False
        self._agains += 1
        return True

    def _continuous_move(
        self, error: Pair, velocity: Pair, rate_rad_s: float, now_s: float
    ) -> ContinuousMove:
        share = 1.0 / max(SHARE_S, LAGS * self.lag_s)
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
        return ContinuousMove(driven[0], driven[1])

    def _predict(self, time_s: float) -> Pair:
        """Return the predicted direction of the camera by the commands since its last report."""
        assert self._seen is not None
        seen_s, (pan, tilt) = self._seen
        ends = [*self._driven, (time_s, (0.0, 0.0))]
        for (begin_s, (pan_rate, tilt_rate)), (end_s, _) in pairwise(ends):
            seconds = min(end_s, time_s) - max(begin_s, seen_s)
            if seconds > 0:
                pan += pan_rate * seconds
                tilt += tilt_rate * seconds
        return pan, tilt
