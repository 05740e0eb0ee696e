"""What was heard over time, from clocks that began at different times."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(slots=True)
class Heard:
    """The stamps of one sender's messages, when each arrived (both in seconds of simulated time,
    whatever they count from), and what each says."""

    stamps_s: list[float] = field(default_factory=list)
    arrived_s: list[float] = field(default_factory=list)
    values: list[tuple[float, ...]] = field(default_factory=list)

    def add(self, stamp_s: float, arrived_s: float, *values: float) -> None:
        """One more message."""
        self.stamps_s.append(stamp_s)
        self.arrived_s.append(arrived_s)
        self.values.append(values)

    def series(self) -> "Series":
        """In the time of arrivals. No message arrives before it was stamped, and the quickest one
        hardly later: so the delays of the others, in a busy reader, distort nothing."""
        stamps = np.array(self.stamps_s)
        ahead_s = float(np.min(np.array(self.arrived_s) - stamps))
        _, first = np.unique(stamps, return_index=True)
        return Series(stamps[first] + ahead_s, np.array(self.values)[first])


@dataclass(frozen=True, slots=True)
class Series:
    """`values`: one row for each of `times_s`, which increase."""

    times_s: Array
    values: Array

    def at(self, times_s: Array) -> Array:
        """In between, in proportion; angles must have been unwrapped."""
        columns = [np.interp(times_s, self.times_s, column) for column in self.values.T]
        return np.stack(columns, axis=1)

    def within(self, begin_s: float, end_s: float) -> "Series":
        """That part of it."""
        inside = (self.times_s >= begin_s) & (self.times_s <= end_s)
        return Series(self.times_s[inside], self.values[inside])

    def speeds(self, times_s: Array, over_s: float = 0.4) -> Array:
        """How fast the first two columns change, in units of length a second."""
        before, after = self.at(times_s - over_s / 2), self.at(times_s + over_s / 2)
        moved: Array = np.linalg.norm((after - before)[:, :2], axis=1) / over_s
        return moved


@dataclass(frozen=True, slots=True)
class Errors:
    """`rms` and `most` of what is counted; `count` 0: nothing was."""

    rms: float
    most: float
    count: int


def errors(values: Array) -> Errors:
    """The root of the mean square, and the largest, of any sign."""
    if not len(values):
        return Errors(float("nan"), float("nan"), 0)
    return Errors(float(np.sqrt(np.mean(values**2))), float(np.max(np.abs(values))), len(values))
