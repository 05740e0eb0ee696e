"""The clock by which an executive notices that it did not run, and until when its runs are its."""

import sys
import time


def awake_s() -> float:
    """Seconds of a clock that no one sets, and that goes on while the process is stopped, or the
    computer suspended."""
    if sys.platform == "linux":
        return time.clock_gettime(time.CLOCK_BOOTTIME)
    return time.monotonic()
