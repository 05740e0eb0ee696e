"""A node that was not running itself does not take its vehicle for silent."""

from m2pem_plugin_ros.onboard.node import watchdog_rounds


class Busy:
    """A clock on a computer that wakes nobody in time: sleeps take what is said, one by one."""

    def __init__(self, *sleeps_s: float) -> None:
        self._now_us = 0
        self._sleeps_s = list(sleeps_s)

    def now_us(self) -> int:
        return self._now_us

    async def sleep(self, seconds: float) -> None:
        self._now_us += round(self._sleeps_s.pop(0) * 1e6)

    async def sleep_until(self, time_us: int) -> None:
        raise NotImplementedError


async def judged_us(count: int, *sleeps_s: float) -> list[int]:
    clock, found = Busy(*sleeps_s), []
    async for _ in watchdog_rounds(clock, 1.0):
        found.append(clock.now_us())
        if len(found) == count:
            break
    return found


async def test_telemetry_is_judged_every_round() -> None:
    assert await judged_us(2, 1.0, 1.1) == [1_000_000, 2_100_000]


async def test_after_a_round_that_came_late_the_next_one_judges() -> None:
    assert await judged_us(2, 1.0, 5.0, 1.0) == [1_000_000, 7_000_000]


async def test_a_computer_that_is_always_late_judges_every_other_round() -> None:
    assert await judged_us(2, 5.0, 5.0, 5.0, 5.0) == [10_000_000, 20_000_000]
