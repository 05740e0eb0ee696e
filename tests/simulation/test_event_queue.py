import asyncio
import logging

import pytest

from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.simulation.event_queue import EventQueue

LOGGER = logging.getLogger(__name__)


def test_calls_come_in_order_of_time_then_of_scheduling_with_their_own_time() -> None:
    async def main(clock: VirtualClock) -> None:
        event_queue = EventQueue(clock, LOGGER)
        calls: list[tuple[str, int]] = []
        for name, at_us in (("c", 30), ("a", 10), ("b", 30), ("a2", 10)):
            event_queue.at(at_us, lambda at_us, name=name: calls.append((name, at_us)))  # type: ignore[misc]
        event_queue.wake()
        await asyncio.sleep(1)
        assert calls == [("a", 10), ("a2", 10), ("c", 30), ("b", 30)]

    run_virtual(main, 0)


def test_an_earlier_call_is_not_late_because_a_later_one_is_waited_for() -> None:
    async def main(clock: VirtualClock) -> None:
        event_queue = EventQueue(clock, LOGGER)
        calls: list[int] = []
        event_queue.wake()
        event_queue.at(100_000, lambda _: calls.append(clock.now_us()))
        await asyncio.sleep(0)
        event_queue.at(50_000, lambda _: calls.append(clock.now_us()))
        await asyncio.sleep(1)
        assert calls == [50_000, 100_000]

    run_virtual(main, 0)


def test_what_is_past_is_caught_up_with_as_if_in_time() -> None:
    async def main(clock: VirtualClock) -> None:
        event_queue = EventQueue(clock, LOGGER)
        calls: list[int] = []

        def tick(at_us: int) -> None:
            calls.append(at_us)
            event_queue.at(at_us + 10, tick)

        event_queue.at(5, tick)
        event_queue.run_due(40)
        assert calls == [5, 15, 25, 35]

    run_virtual(main, 40)


def test_a_cancelled_call_does_not_come_and_leaves_no_task() -> None:
    async def main(clock: VirtualClock) -> None:
        event_queue = EventQueue(clock, LOGGER)
        event_queue.wake()
        event_queue.at(100, lambda _: pytest.fail("it was cancelled")).cancel()
        event_queue.run_due(clock.now_us())
        await asyncio.sleep(1)
        assert asyncio.all_tasks() == {asyncio.current_task()}

    run_virtual(main, 0)


def test_a_call_that_fails_is_logged_and_the_others_come(caplog: pytest.LogCaptureFixture) -> None:
    async def main(clock: VirtualClock) -> None:
        event_queue = EventQueue(clock, LOGGER)
        calls: list[int] = []
        event_queue.at(1, lambda at_us: calls.append(at_us // 0))
        event_queue.at(2, calls.append)
        event_queue.run_due(2)
        assert calls == [2]
        assert "ZeroDivisionError" in caplog.text

    run_virtual(main, 0)


def test_what_may_go_on_for_ever_is_not_counted_as_expected() -> None:
    async def main(clock: VirtualClock) -> None:
        event_queue = EventQueue(clock, LOGGER)
        event_queue.at(10, lambda _: None)
        cancelled = event_queue.at(20, lambda _: None)
        event_queue.at(30, lambda _: None, background=True)
        assert event_queue.expected == 2
        cancelled.cancel()
        cancelled.cancel()
        assert event_queue.expected == 1
        event_queue.run_due(15)
        assert event_queue.expected == 0
        event_queue.run_due(40)
        assert event_queue.expected == 0

    run_virtual(main, 0)


def test_a_call_that_schedules_the_next_one_is_followed_by_it_in_time() -> None:
    async def main(clock: VirtualClock) -> None:
        event_queue = EventQueue(clock, LOGGER)
        calls: list[int] = []

        def call(at_us: int) -> None:
            calls.append(clock.now_us())
            if at_us < 50:
                event_queue.at(at_us + 10, call)
                event_queue.at(at_us + 5, calls.append).cancel()

        event_queue.wake()
        event_queue.at(10, call)
        await asyncio.sleep(1)
        assert calls == [10, 20, 30, 40, 50]
        event_queue.at(clock.now_us() + 7, call)  # when it had nothing to wait for
        await asyncio.sleep(1)
        assert calls[-1] == 1_000_007

    run_virtual(main, 0)
