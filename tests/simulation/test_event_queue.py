import asyncio
import logging

import pytest

from m2pem.executive.clock import VirtualClock, run_virtual
from m2pem.simulation.event_queue import Agenda

LOGGER = logging.getLogger(__name__)


def test_calls_come_in_order_of_time_then_of_scheduling_with_their_own_time() -> None:
    async def main(clock: VirtualClock) -> None:
        agenda = Agenda(clock, LOGGER)
        calls: list[tuple[str, int]] = []
        for name, at_us in (("c", 30), ("a", 10), ("b", 30), ("a2", 10)):
            agenda.at(at_us, lambda at_us, name=name: calls.append((name, at_us)))  # type: ignore[misc]
        agenda.wake()
        await asyncio.sleep(1)
        assert calls == [("a", 10), ("a2", 10), ("c", 30), ("b", 30)]

    run_virtual(main, 0)


def test_an_earlier_call_is_not_late_because_a_later_one_is_waited_for() -> None:
    async def main(clock: VirtualClock) -> None:
        agenda = Agenda(clock, LOGGER)
        calls: list[int] = []
        agenda.wake()
        agenda.at(100_000, lambda _: calls.append(clock.now_us()))
        await asyncio.sleep(0)
        agenda.at(50_000, lambda _: calls.append(clock.now_us()))
        await asyncio.sleep(1)
        assert calls == [50_000, 100_000]

    run_virtual(main, 0)


def test_what_is_past_is_caught_up_with_as_if_in_time() -> None:
    async def main(clock: VirtualClock) -> None:
        agenda = Agenda(clock, LOGGER)
        calls: list[int] = []

        def tick(at_us: int) -> None:
            calls.append(at_us)
            agenda.at(at_us + 10, tick)

        agenda.at(5, tick)
        agenda.run_due(40)
        assert calls == [5, 15, 25, 35]

    run_virtual(main, 40)


def test_a_cancelled_call_does_not_come_and_leaves_no_task() -> None:
    async def main(clock: VirtualClock) -> None:
        agenda = Agenda(clock, LOGGER)
        agenda.wake()
        agenda.at(100, lambda _: pytest.fail("it was cancelled")).cancel()
        agenda.run_due(clock.now_us())
        await asyncio.sleep(1)
        assert asyncio.all_tasks() == {asyncio.current_task()}

    run_virtual(main, 0)


def test_a_call_that_fails_is_logged_and_the_others_come(caplog: pytest.LogCaptureFixture) -> None:
    async def main(clock: VirtualClock) -> None:
        agenda = Agenda(clock, LOGGER)
        calls: list[int] = []
        agenda.at(1, lambda at_us: calls.append(at_us // 0))
        agenda.at(2, calls.append)
        agenda.run_due(2)
        assert calls == [2]
        assert "ZeroDivisionError" in caplog.text

    run_virtual(main, 0)


def test_what_may_go_on_for_ever_is_not_counted_as_expected() -> None:
    async def main(clock: VirtualClock) -> None:
        agenda = Agenda(clock, LOGGER)
        agenda.at(10, lambda _: None)
        cancelled = agenda.at(20, lambda _: None)
        agenda.at(30, lambda _: None, background=True)
        assert agenda.expected == 2
        cancelled.cancel()
        cancelled.cancel()
        assert agenda.expected == 1
        agenda.run_due(15)
        assert agenda.expected == 0
        agenda.run_due(40)
        assert agenda.expected == 0

    run_virtual(main, 0)
