"""How the face keeps the rates of its topics."""

import asyncio
import random

import pytest
from m2pem_plugin_ros.face.rate_limiter import RateLimiter

from m2pem.api.clock import VirtualClock, run_virtual

LONG_S = 20.0


def published(source_hz: float, rate_hz: float, jitter: float) -> list[tuple[float, float]]:
    """When each item came, and was published, in seconds; `jitter`: a part of the source's
    period."""
    seen: list[tuple[float, float]] = []

    async def main(clock: VirtualClock) -> None:
        loop = asyncio.get_running_loop()
        limiter = RateLimiter[float](rate_hz, lambda came_s: seen.append((came_s, loop.time())))
        drawn, began_s = random.Random(1), loop.time()
        for number in range(round(LONG_S * source_hz)):
            late_s = jitter * drawn.random() / source_hz
            await asyncio.sleep(began_s + number / source_hz + late_s - loop.time())
            limiter.put(loop.time())
        await asyncio.sleep(3 / rate_hz)

    run_virtual(main, 0)
    return seen


@pytest.mark.parametrize("source_hz", [10.0, 5.0, 7.0, 20.0, 50.0])
@pytest.mark.parametrize("jitter", [0.0, 0.2])
def test_what_is_published_has_just_come_and_keeps_the_rate(
    source_hz: float, jitter: float
) -> None:
    seen = published(source_hz, 5.0, jitter)
    assert max(at_s - came_s for came_s, at_s in seen[:-1]) < 1e-6
    assert 0.8 * LONG_S * 5.0 <= len(seen) <= LONG_S * 5.0 + 2


def test_the_last_one_is_published_although_no_other_comes() -> None:
    seen: list[str] = []

    async def main(clock: VirtualClock) -> None:
        limiter = RateLimiter[str](5.0, seen.append)
        limiter.put("first")
        limiter.put("second")
        limiter.put("last")
        await asyncio.sleep(1.0)
        limiter.put("more")
        limiter.put("cleared")
        limiter.clear()
        await asyncio.sleep(1.0)

    run_virtual(main, 0)
    assert seen == ["first", "last", "more"]
