"""The clock of everything but the engine, which gets the time with each input.

There are two: the wall clock, run faster if wanted, for real and simulated vehicles, and virtual
time for rehearsals and tests.

Virtual time is an event loop, so that all code that waits with asyncio runs in it unchanged: when
nothing is ready, the loop jumps to the next timer. Time is counted in whole microseconds (a float
would drift), timers of the same microsecond fire in the order in which they were made, and nothing
real can be waited for but work handed to a thread, during which virtual time does not advance.
"""

import asyncio
import itertools
import math
import selectors
import time
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from contextvars import Context, copy_context
from typing import Any, Protocol, TypeVar, TypeVarTuple, Unpack

from m2pem.boot_time import boot_time_ns
from m2pem.errors import InternalError
from m2pem.units import US_PER_S

T = TypeVar("T")
Ts = TypeVarTuple("Ts")


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


class DeadlockError(InternalError):
    """In virtual time: every task waits, and nothing is scheduled that could wake one."""


_LONGEST_SLEEP_US = 2_000_000
"""So much later than due, at most, a wait ends during which the computer was suspended."""


class SystemClock:
    """The wall clock at start plus steady time: it never goes back, and never jumps with NTP. It
    goes on while the computer is suspended, as vehicles and the day do.

    `speed`: seconds of this clock in a real second. `start_us`: what it shows at first,
    microseconds since the Unix epoch; None is now. `steady_ns`: returns the steady time in
    nanoseconds; None is the computer's.
    """

    def __init__(
        self,
        speed: float = 1.0,
        start_us: int | None = None,
        steady_ns: Callable[[], int] | None = None,
    ) -> None:
        if not (speed > 0 and math.isfinite(speed)):
            raise ValueError(f"the speed of a clock is a positive number, not {speed}")
        self.speed = speed
        # Whole numbers: a float would lose microseconds in a process that runs for months.
        self._numerator, self._denominator = speed.as_integer_ratio()
        self._steady_ns = steady_ns or boot_time_ns
        self._started_ns = self._steady_ns()
        self._start_us = time.time_ns() // 1000 if start_us is None else start_us

    def now_us(self) -> int:
        """Microseconds since the Unix epoch; never goes back."""
        elapsed_ns = self._steady_ns() - self._started_ns
        return self._start_us + elapsed_ns * self._numerator // (self._denominator * 1000)

    async def sleep(self, seconds: float) -> None:
        """Wait for `seconds` of this clock; not at all (but let others run) when negative."""
        await self.sleep_until(self.now_us() + math.ceil(seconds * US_PER_S))

    async def sleep_until(self, time_us: int) -> None:
        """Wait until `now_us()` is at least `time_us`."""
        remaining_us = time_us - self.now_us()
        if remaining_us <= 0:
            await asyncio.sleep(0)
        while remaining_us > 0:
            # The loop may wake us a clock tick early, and a virtual one counts microseconds. Its
            # timers stand still while the computer is suspended.
            real_us = min(math.ceil(remaining_us / self.speed), _LONGEST_SLEEP_US)
            await asyncio.sleep(real_us / US_PER_S)
            remaining_us = time_us - self.now_us()


class RateTimer:
    """Tells when periodic work is due, by the seconds of any clock."""

    def __init__(self, rate_hz: float) -> None:
        self._period_s = 1.0 / rate_hz
        self._next_s = 0.0

    def is_due(self, now_s: float) -> bool:
        """Return whether the work is due. Missed periods are skipped."""
        if now_s < self._next_s - 1e-9:
            return False
        self._next_s = max(self._next_s + self._period_s, now_s)
        return True


class VirtualClock:
    """The clock of a virtual loop; made by `run_virtual`."""

    def __init__(self, loop: "VirtualLoop", start_us: int) -> None:
        self._loop = loop
        self._start_us = start_us

    def now_us(self) -> int:
        """Microseconds since the Unix epoch, exact."""
        return self._start_us + self._loop.elapsed_us

    def when_idle(self, act: Callable[[float | None], bool]) -> None:
        """Have `act` called when nothing is ready, each time before the loop jumps ahead.

        Its argument is by how many seconds, or None when no timer is set. If it returns True, it
        has made something happen now, and time does not advance.
        """
        self._loop.when_idle = act

    async def sleep(self, seconds: float) -> None:
        """Wait for `seconds` of virtual time, to the nearest microsecond."""
        await asyncio.sleep(seconds)

    async def sleep_until(self, time_us: int) -> None:
        """Wait until `now_us()` is at least `time_us`."""
        await asyncio.sleep((time_us - self.now_us()) / US_PER_S)
        self._loop.pass_rest(time_us - self.now_us())


_LOOK_S = 0.5


def run_virtual(main: Callable[[VirtualClock], Awaitable[T]], start_us: int) -> T:
    """Run `main` to its end in virtual time that begins at `start_us`, as `asyncio.run` would.

    Where an event loop runs already (a notebook, an async test), `main` runs in another thread;
    that event loop waits for it, and an interrupt (Ctrl-C) cancels it.

    Raises:
        DeadlockError: nothing can happen any more, and `main` has not ended.
    """
    loop = VirtualLoop()
    if asyncio._get_running_loop() is None:
        return _run_virtual(loop, main, start_us)
    with ThreadPoolExecutor(1) as threads:
        try:
            ending = threads.submit(copy_context().run, _run_virtual, loop, main, start_us)
            # Again and again: a signal just before a wait is handled when that is over.
            while not wait((ending,), _LOOK_S).done:
                pass
        except BaseException:
            # In the main thread asyncio does that itself. The thread is waited for afterwards.
            with suppress(RuntimeError):  # it has ended meanwhile
                loop.call_soon_threadsafe(loop.cancel_main)
            raise
        return ending.result()


def _run_virtual(
    loop: "VirtualLoop", main: Callable[[VirtualClock], Awaitable[T]], start_us: int
) -> T:
    async def entry() -> T:
        return await main(VirtualClock(loop, start_us))

    with asyncio.Runner(loop_factory=lambda: loop) as runner:
        return runner.run(entry())


_RESOLUTION_S = 0.5 / US_PER_S


class _Moment(float):
    """When a timer is due, with its place among those of the same microsecond.

    asyncio keeps timers in a heap by this value alone, and a heap does not keep equals in order.
    """

    __slots__ = ("number",)
    number: int

    def __lt__(self, other: float) -> bool:
        if isinstance(other, _Moment) and float(self) == float(other):
            return self.number < other.number
        return float(self) < other


class VirtualLoop(asyncio.SelectorEventLoop):
    """An event loop whose time is virtual; see the module. Use `run_virtual`.

    `selector`: what it waits with, made for this loop; by default one that refuses I/O.
    """

    _scheduled: list[asyncio.TimerHandle]  # asyncio's heap; its head is never a cancelled one here

    def __init__(
        self, selector: "Callable[[VirtualLoop], selectors.BaseSelector] | None" = None
    ) -> None:
        self.elapsed_us = 0
        self.when_idle: Callable[[float | None], bool] = lambda _: False
        self._main: asyncio.Task[Any] | None = None
        self._threads_at_work = 0
        self._timer_numbers = itertools.count()
        super().__init__((selector or _JumpingSelector)(self))
        # asyncio fires timers that are due within the clock's resolution. Half a microsecond never
        # fires one early, as all are due at whole ones; the default, a nanosecond, is lost when
        # added to a float of some months, and then the timer would never be due.
        self._clock_resolution = _RESOLUTION_S

    def create_task(self, coro: Any, **options: Any) -> "asyncio.Task[Any]":
        """Create a task. The first is the main one, which the loop runs until it has ended."""
        task = super().create_task(coro, **options)
        self._main = self._main or task
        return task

    def cancel_main(self) -> None:
        """Cancel the main task."""
        if self._main is not None:
            self._main.cancel()

    def pass_rest(self, rest_us: int) -> None:
        """Let pass what a timer came too early: centuries in seconds are no exact floats."""
        self.elapsed_us += max(rest_us, 0)

    def time(self) -> float:
        """Virtual seconds since the loop was made."""
        return self.elapsed_us / US_PER_S

    def call_at(
        self,
        when: float,
        callback: Callable[[Unpack[Ts]], object],
        *args: *Ts,
        context: Context | None = None,
    ) -> asyncio.TimerHandle:
        """Schedule at a virtual time, rounded to a whole microsecond."""
        moment = _Moment(round(when * US_PER_S) / US_PER_S)
        moment.number = next(self._timer_numbers)
        return super().call_at(moment, callback, *args, context=context)

    def run_in_executor(  # type: ignore[override]  # the stubs' own signature is not typed either
        self, executor: Any, func: Callable[..., T], *args: Any
    ) -> "asyncio.Future[T]":
        """Run in a thread; virtual time does not advance until it is done."""
        future: asyncio.Future[T] = super().run_in_executor(executor, func, *args)
        self._threads_at_work += 1
        future.add_done_callback(self._thread_done)
        return future

    def _thread_done(self, _: object) -> None:
        self._threads_at_work -= 1

    async def shutdown_default_executor(self, *args: Any) -> None:
        """Wait for the threads, in real time."""
        self._threads_at_work += 1
        try:
            await super().shutdown_default_executor(*args)
        finally:
            self._threads_at_work -= 1

    def idle(self, timeout_s: float | None) -> bool:
        """Nothing is ready: jump ahead by `timeout_s`, or say True that a thread must be awaited.

        Raises:
            DeadlockError: there is neither a timer nor a thread.
        """
        if self._threads_at_work:
            return True
        if timeout_s is not None:
            timeout_s = self._scheduled[0].when() - self.time()  # asyncio waits a day at most
        if self.when_idle(timeout_s):
            return False
        if timeout_s is None:
            waiting = sorted(
                getattr(task.get_coro(), "__qualname__", task.get_name())
                for task in asyncio.all_tasks(self)
            )
            raise DeadlockError(
                f"nothing can happen any more at {self.time():.6f} s of virtual time: no timer is "
                f"set, and these wait for each other or for something real: {', '.join(waiting)}"
            )
        self.elapsed_us += round(timeout_s * US_PER_S)
        self._clock_resolution = max(_RESOLUTION_S, math.ulp(self.time()))
        return False


class _JumpingSelector(selectors.DefaultSelector):
    """Where an event loop waits: this one lets virtual time pass instead."""

    def __init__(self, loop: VirtualLoop) -> None:
        super().__init__()
        self._loop = loop

    def register(self, fileobj: Any, events: int, data: Any = None) -> selectors.SelectorKey:
        if self.get_map():  # the first is the loop's own pipe, which ends the wait for a thread
            raise InternalError(
                "something tried to do input or output in virtual time, where nothing real can be "
                "waited for: use the simulated arbiters, or a real clock"
            )
        return super().register(fileobj, events, data)

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        if timeout is not None and timeout <= 0:
            return []
        return super().select(None) if self._loop.idle(timeout) else []
