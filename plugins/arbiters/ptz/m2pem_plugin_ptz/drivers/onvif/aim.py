"""Where the camera is wanted to look, and how quickly that changes."""

import math
from collections import deque
from dataclasses import dataclass

from m2pem_plugin_ptz.drivers.onvif.spaces import into
from m2pem_plugin_ptz.head import Reach

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
