"""The time since the computer was started.

No one sets this clock, and it goes on while a process is stopped or the computer suspended.
"""

import sys
import time


def boot_time_ns() -> int:
    """Nanoseconds since the computer was started, those in which it was suspended included."""
    if sys.platform == "linux":
        return time.clock_gettime_ns(time.CLOCK_BOOTTIME)
    return time.monotonic_ns()


def boot_time_s() -> float:
    """The same in seconds."""
    return boot_time_ns() / 1_000_000_000
