"""The clock by which an executive knows until when its runs surely are its own."""

import time

_CLOCK = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)


def lease_clock_s() -> float:
    """Return seconds of a clock that no one sets, and that goes on while the host is suspended."""
    return time.clock_gettime(_CLOCK)
