"""Measuring one piece of work in the process that does it."""

import resource
import sys
import time
from collections.abc import Callable
from statistics import median
from typing import TypeVar

T = TypeVar("T")

ENOUGH_S = 0.3
MOST_TIMES = 20


def peak_kb() -> int:
    """The largest memory of this process so far, in kB."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak // 1024 if sys.platform == "darwin" else peak


def again_and_again(
    work: Callable[[], tuple[float, T]], enough_s: float = ENOUGH_S
) -> tuple[float, T]:
    """Do short work until there is something to measure: `enough_s` CPU seconds in all.

    `work` returns its CPU seconds and a result; the median, and the last result, are returned.
    """
    times: list[float] = []
    while True:
        cpu_s, result = work()
        times.append(cpu_s)
        if sum(times) >= enough_s or len(times) >= MOST_TIMES:
            return median(times), result


class Stopwatch:
    """CPU seconds of this process, all its threads, and real ones, within `with` blocks."""

    def __init__(self) -> None:
        self.cpu_s = 0.0
        self.wall_s = 0.0

    def __enter__(self) -> None:
        self._began = time.process_time(), time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self.cpu_s += time.process_time() - self._began[0]
        self.wall_s += time.perf_counter() - self._began[1]
