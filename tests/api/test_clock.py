import asyncio
import math
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import wait
from types import FrameType

import pytest

from m2pem.api.clock import DeadlockError, SystemClock, VirtualClock, run_virtual
from m2pem.errors import InternalError

DAY_S = 86_400
START_US = 1_767_225_600_000_000  # 2026-01-01T00:00:00Z


@pytest.fixture
def steady_ns(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    """Steady time, as a test sets it."""
    now = [5_000]
    monkeypatch.setattr("m2pem.api.clock.boot_time_ns", lambda: now[0])
    yield now


# --- the wall clock -----------------------------------------------------------------------------


def test_system_clock_starts_at_the_wall_clock_and_ignores_its_later_jumps(
    steady_ns: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(time, "time_ns", lambda: START_US * 1000)
    clock = SystemClock()
    assert clock.now_us() == START_US
    monkeypatch.setattr(time, "time_ns", lambda: 0)
    steady_ns[0] += 1_500_000
    assert clock.now_us() == START_US + 1_500


def test_system_clock_runs_faster_by_its_speed_and_stays_exact_for_years(
    steady_ns: list[int],
) -> None:
    clock = SystemClock(speed=20, start_us=START_US)
    steady_ns[0] += 10 * 365 * DAY_S * 1_000_000_000 + 1_000
    assert clock.now_us() == START_US + 200 * 365 * DAY_S * 1_000_000 + 20


async def test_a_wait_ends_when_it_is_due_though_the_computer_was_suspended_meanwhile(
    steady_ns: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The event loop's own timers stand still in a suspend; the clock does not."""
    clock = SystemClock(start_us=START_US)
    slept: list[float] = []

    async def suspended(seconds: float) -> None:
        slept.append(seconds)
        steady_ns[0] += 7_200 * 1_000_000_000

    monkeypatch.setattr("m2pem.api.clock.asyncio.sleep", suspended)
    await clock.sleep(3_600)
    assert slept == [2.0]
    assert clock.now_us() == START_US + 7_200 * 1_000_000


@pytest.mark.parametrize("speed", [0, -1, math.inf, math.nan])
def test_system_clock_refuses_a_speed_that_is_not_positive(speed: float) -> None:
    with pytest.raises(ValueError, match="positive"):
        SystemClock(speed=speed)


async def test_system_clock_has_reached_the_time_when_sleep_returns() -> None:
    clock = SystemClock(speed=5000)
    before_us = clock.now_us()
    await clock.sleep(10)
    assert clock.now_us() >= before_us + 10_000_000
    await clock.sleep_until(before_us + 20_000_000)
    assert clock.now_us() >= before_us + 20_000_000


async def test_sleeping_until_the_past_lets_others_run() -> None:
    clock = SystemClock()
    ran: list[str] = []
    asyncio.get_running_loop().call_soon(ran.append, "other")
    await clock.sleep_until(0)
    assert ran == ["other"]
    await clock.sleep(-1)


# --- virtual time -------------------------------------------------------------------------------


def test_what_to_do_when_idle_is_asked_before_every_jump_and_may_stop_it() -> None:
    asked: list[tuple[float, float | None]] = []

    async def main(clock: VirtualClock) -> tuple[int, float]:
        loop = asyncio.get_running_loop()
        woken = asyncio.Event()

        def act(ahead_s: float | None) -> bool:
            asked.append((loop.time(), ahead_s))
            if loop.time() < 3 or woken.is_set():
                return False
            woken.set()
            return True

        clock.when_idle(act)
        await clock.sleep(3)
        timer = asyncio.ensure_future(clock.sleep(100))
        await woken.wait()
        timer.cancel()
        clock.when_idle(lambda _: False)
        return clock.now_us() - START_US, loop.time()

    assert run_virtual(main, START_US) == (3_000_000, 3.0)
    assert asked == [(0.0, 3.0), (3.0, 100.0)]


def test_what_to_do_when_idle_may_end_a_deadlock() -> None:
    async def main(clock: VirtualClock) -> str:
        answer: asyncio.Future[str] = asyncio.get_running_loop().create_future()

        def act(ahead_s: float | None) -> bool:
            if not answer.done():
                answer.set_result(f"woken with {ahead_s}")
                return True
            return False

        clock.when_idle(act)
        return await answer

    assert run_virtual(main, START_US) == "woken with None"


def test_virtual_time_is_exact_to_the_microsecond_after_many_sleeps() -> None:
    async def main(clock: VirtualClock) -> int:
        for _ in range(1000):
            await clock.sleep(0.1)
        await clock.sleep(0.000_001)
        return clock.now_us()

    assert run_virtual(main, START_US) == START_US + 100_000_001


def test_virtual_time_is_exact_after_years_and_no_timer_is_missed() -> None:
    async def main(clock: VirtualClock) -> list[int]:
        seen = []
        await clock.sleep(20 * 365 * DAY_S)
        for _ in range(3):
            await clock.sleep(0.000_001)
            seen.append(clock.now_us() - START_US - 20 * 365 * DAY_S * 1_000_000)
        return seen

    assert run_virtual(main, START_US) == [1, 2, 3]


def test_sleep_until_wakes_at_exactly_that_time() -> None:
    async def main(clock: VirtualClock) -> int:
        await clock.sleep(0.3)
        await clock.sleep_until(START_US + 12_345_678)
        await clock.sleep_until(START_US)  # past: at once
        return clock.now_us()

    assert run_virtual(main, START_US) == START_US + 12_345_678


@pytest.mark.timeout(20)
@pytest.mark.parametrize("ahead_us", [300 * 365 * DAY_S * 10**6 + 1, 251_635_507_199_000_007])
def test_centuries_pass_at_once_and_end_as_exactly_as_seconds_can_say(ahead_us: int) -> None:
    async def main(clock: VirtualClock) -> None:
        jumps: list[float | None] = []

        def note(ahead_s: float | None) -> bool:
            jumps.append(ahead_s)
            return False

        clock.when_idle(note)
        await clock.sleep_until(START_US + ahead_us)
        assert 0 <= clock.now_us() - START_US - ahead_us <= inexact_us
        await clock.sleep_until(START_US + ahead_us + 100)
        assert 0 <= clock.now_us() - START_US - ahead_us - 100 <= inexact_us
        assert len(jumps) <= 2

    inexact_us = math.ulp(ahead_us / 1e6) * 1e6
    run_virtual(main, START_US)


def test_no_timer_fires_before_its_microsecond() -> None:
    async def main(clock: VirtualClock) -> list[tuple[str, int]]:
        seen: list[tuple[str, int]] = []

        async def at(name: str, time_us: int) -> None:
            await clock.sleep_until(time_us)
            seen.append((name, clock.now_us() - START_US))

        async with asyncio.TaskGroup() as group:
            group.create_task(at("second", START_US + 1_000_001))
            group.create_task(at("first", START_US + 1_000_000))
        return seen

    assert run_virtual(main, START_US) == [("first", 1_000_000), ("second", 1_000_001)]


def test_timers_of_one_microsecond_fire_in_the_order_of_their_creation() -> None:
    async def main(clock: VirtualClock) -> list[int]:
        fired: list[int] = []
        loop = asyncio.get_running_loop()
        now = loop.time()
        for number in range(50):
            loop.call_at(now + 5, fired.append, number)
            loop.call_at(now + 1, lambda: None)
        loop.call_at(now + 5.000_000_3, fired.append, 50)  # the same microsecond
        await clock.sleep(6)
        return fired

    assert run_virtual(main, START_US) == list(range(51))


def test_code_written_with_asyncio_timers_runs_unchanged() -> None:
    async def main(clock: VirtualClock) -> tuple[int, int]:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(3 * DAY_S):
                await asyncio.Event().wait()
        after_timeout = clock.now_us()
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(asyncio.sleep(100), 7.5)
        return after_timeout, clock.now_us()

    assert run_virtual(main, 0) == (3 * DAY_S * 1_000_000, 3 * DAY_S * 1_000_000 + 7_500_000)


def test_a_wait_that_nothing_can_end_is_an_error_that_names_who_waits() -> None:
    async def waits_for_an_operator() -> None:
        await asyncio.Event().wait()

    async def main(clock: VirtualClock) -> None:
        await clock.sleep(2.5)
        await asyncio.create_task(waits_for_an_operator())

    with pytest.raises(DeadlockError, match=r"at 2\.500000 s.*waits_for_an_operator"):
        run_virtual(main, START_US)


def test_a_deadlock_still_lets_tasks_clean_up() -> None:
    cleaned: list[str] = []

    async def main(_: VirtualClock) -> None:
        try:
            await asyncio.Event().wait()
        finally:
            cleaned.append("main")

    with pytest.raises(DeadlockError):
        run_virtual(main, START_US)
    assert cleaned == ["main"]


def test_input_and_output_are_refused_in_virtual_time() -> None:
    async def main(_: VirtualClock) -> None:
        with socket.socket() as listening:
            listening.bind(("127.0.0.1", 0))
            listening.listen()
            listening.setblocking(False)
            await asyncio.get_running_loop().sock_accept(listening)

    with pytest.raises(InternalError, match="input or output in virtual time"):
        run_virtual(main, START_US)


def test_virtual_time_stands_still_while_a_thread_works() -> None:
    timer_set = threading.Event()

    async def main(clock: VirtualClock) -> tuple[bool, int]:
        asyncio.get_running_loop().call_later(60, lambda: None)
        asyncio.get_running_loop().call_soon(timer_set.set)
        done = await asyncio.to_thread(timer_set.wait, 10)
        return done, clock.now_us()

    assert run_virtual(main, START_US) == (True, START_US)


def test_an_error_of_the_main_function_comes_out() -> None:
    async def main(_: VirtualClock) -> None:
        raise LookupError("mine")

    with pytest.raises(LookupError, match="mine"):
        run_virtual(main, START_US)


async def test_an_interrupt_cancels_what_runs_in_virtual_time_beside_an_event_loop() -> None:
    """As that of a notebook's kernel while a cell rehearses."""
    ended: list[str] = []

    async def main(clock: VirtualClock) -> None:
        try:
            while not main_thread_waits():
                await clock.sleep(1)
            signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
            while True:
                await clock.sleep(1)
        finally:
            ended.append(threading.current_thread().name)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            run_virtual(main, START_US)
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(ended) == 1
    assert ended != [threading.current_thread().name]


def main_thread_waits() -> bool:
    """Whether the main thread waits for the result of another one."""
    frame: FrameType | None = sys._current_frames()[threading.main_thread().ident or 0]
    while frame is not None and frame.f_code is not wait.__code__:
        frame = frame.f_back
    return frame is not None
