"""The clock of everything but the engine, which gets the time with each input."""

from typing import Protocol


class Clock(Protocol):
    """Mission-side time: the wall clock, a faster one, or a virtual one."""

    def now_us(self) -> int:
        """Microseconds since the Unix epoch; never goes back."""
        ...

    async def sleep(self, seconds: float) -> None:
        """Wait for `seconds` of this clock."""
        ...

    async def sleep_until(self, time_us: int) -> None:
        """Wait until `now_us()` is at least `time_us`."""
        ...
