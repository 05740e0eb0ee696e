"""Slows down who guesses: after so many failures, a while nothing is looked at."""

import time
from collections import deque
from collections.abc import Callable, Hashable, Mapping

WITHIN_S = 300.0
MOST_KEYS = 10_000


class Throttle:
    """Counts failures by key, such as a name at an address."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._failures: dict[Hashable, deque[float]] = {}

    def wait_s(self, bounds: Mapping[Hashable, int]) -> float:
        """Seconds until another attempt is looked at; 0: now. `bounds`: failures by key."""
        now = self._clock()
        waits = [0.0]
        for key, bound in bounds.items():
            times = self._recent(key, now)
            if len(times) >= bound:
                waits.append(times[-bound] + WITHIN_S - now)
        return max(waits)

    def failed(self, bounds: Mapping[Hashable, int]) -> None:
        """An attempt under these keys has failed."""
        now = self._clock()
        for key, bound in bounds.items():
            times = self._recent(key, now)
            self._failures.pop(key, None)
            self._failures[key] = deque([*times, now], maxlen=bound)
        while len(self._failures) > MOST_KEYS:
            del self._failures[next(iter(self._failures))]

    def succeeded(self, bounds: Mapping[Hashable, int]) -> None:
        """The attempt that was counted last has not failed after all."""
        for key in bounds:
            if times := self._failures.get(key):
                times.pop()

    def forget(self, key: Hashable) -> None:
        """What failed under this key was forgetfulness."""
        self._failures.pop(key, None)

    def _recent(self, key: Hashable, now: float) -> list[float]:
        return [each for each in self._failures.get(key, ()) if now - each < WITHIN_S]
