"""Counts of what an executive does.

Counting must not cost anything: what a run has decided is counted once a commit.
"""

from bisect import bisect_left
from collections import Counter
from itertools import accumulate

from m2pem.api.statistics import DurationCounts

COMMIT_BOUNDS_S = (0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
LATE_BOUNDS_S = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)


class Durations:
    """A histogram that grows: see `DurationCounts`."""

    def __init__(self, bounds_s: tuple[float, ...]) -> None:
        self._bounds_s = bounds_s
        self._counts = [0] * (len(bounds_s) + 1)
        self._sum_s = 0.0
        self._longest_s = 0.0

    def add(self, took_s: float) -> None:
        """Count a duration."""
        self._counts[bisect_left(self._bounds_s, took_s)] += 1
        self._sum_s += took_s
        self._longest_s = max(self._longest_s, took_s)

    def counts(self) -> DurationCounts:
        """What was counted up to now."""
        cumulative = tuple(accumulate(self._counts))
        return DurationCounts(self._bounds_s, cumulative, self._sum_s, self._longest_s)


class RunCounts:
    """What the runs of an executive have done."""

    def __init__(self) -> None:
        self.inputs = 0
        self.records = 0
        self.commits = Durations(COMMIT_BOUNDS_S)
        self.ended: Counter[str] = Counter()

    def committed(self, inputs: int, records: int, took_s: float) -> None:
        """Count a commit of so many inputs, with the records of all."""
        self.inputs += inputs
        self.records += records
        self.commits.add(took_s)
