"""Tests over real sockets that do not wait: time passes only when there is nothing to receive.

A driver and its simulated vehicles run in one event loop and talk over sockets of this computer.
What one of them sends to 127.0.0.1 is there for the other at once. So when no socket has anything
to be read, all of them wait for a timer, and the loop jumps to the next one. Such a test takes as
long as it computes, and a busy computer makes nothing late.

While a thread works (`asyncio.to_thread`), time passes as the wall clock's. Other processes, and
threads that a library starts itself, cannot take part: time would run away from them.
"""

import asyncio
import functools
import selectors
import time
from collections.abc import Awaitable, Callable
from typing import ParamSpec, TypeVar

from m2pem.api.clock import SystemClock, VirtualLoop

P = ParamSpec("P")
T = TypeVar("T")


def run_on_loopback(main: Callable[[SystemClock], Awaitable[T]], speed: float = 1.0) -> T:
    """Run `main(clock)` to its end, as `asyncio.run` would, in an event loop that does not wait.

    `speed`: seconds of the clock in a second of the event loop.

    Raises:
        DeadlockError: nothing can happen any more, and `main` has not ended.
    """

    async def entry() -> T:
        return await main(loop_clock(speed))

    with asyncio.Runner(loop_factory=lambda: VirtualLoop(_LoopbackSelector)) as runner:
        return runner.run(entry())


def on_loopback(test: Callable[P, Awaitable[None]]) -> Callable[P, None]:
    """Make a test of a coroutine function, which runs in an event loop that does not wait."""

    @functools.wraps(test)
    def run(*args: P.args, **options: P.kwargs) -> None:
        run_on_loopback(lambda _: test(*args, **options))

    return run


def loop_clock(speed: float = 1.0) -> SystemClock:
    """Return a clock by the time of the running event loop.

    `speed`: seconds of the clock in a second of the event loop.
    """
    loop = asyncio.get_running_loop()
    return SystemClock(speed, steady_ns=lambda: round(loop.time() * 1e9))


class _LoopbackSelector(selectors.DefaultSelector):
    """Where an event loop waits: this one lets virtual time pass if there is nothing to read."""

    def __init__(self, loop: VirtualLoop) -> None:
        super().__init__()
        self._loop = loop

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        ready = super().select(0)
        if ready or (timeout is not None and timeout <= 0) or not self._loop.idle(timeout):
            return ready
        began_ns = time.monotonic_ns()
        ready = super().select(timeout)
        self._loop.elapsed_us += (time.monotonic_ns() - began_ns) // 1000
        return ready
