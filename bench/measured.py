"""Measuring one piece of work in the process that does it."""

import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import TypeVar

T = TypeVar("T")

ENOUGH_S = 0.3
MOST_TIMES = 20


def peak_kb() -> int:
    """The largest memory of this process so far, in kB (Linux).

    Not `ru_maxrss`, which begins with the memory of the process that started this one.
    """
    status = Path("/proc/self/status").read_text(encoding="ascii")
    (peak,) = (line.split()[1] for line in status.splitlines() if line.startswith("VmHWM:"))
    return int(peak)


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
