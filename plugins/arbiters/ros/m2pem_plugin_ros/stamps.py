"""Times of messages: those of the clock that all of m2pem goes by."""

from typing import Any

from builtin_interfaces import msg as builtin


def stamp(time_us: int) -> Any:
    """builtin_interfaces/msg/Time of microseconds since the Unix epoch."""
    seconds, rest_us = divmod(time_us, 1_000_000)
    return builtin.Time(sec=seconds, nanosec=rest_us * 1000)
