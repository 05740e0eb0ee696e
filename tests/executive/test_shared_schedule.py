"""Two executives that share a journal and the name of a fleet: one schedule."""

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.schedule import Concurrency, ScheduledStatus, Settlement
from m2pem.journal import MemoryJournal

from .conftest import START_US, mission, question, sequence
from .schedule_world import Scheduling, at, drive, serving, unattended_fleet

ASK = mission(sequence(("Ask", question("Ask"))))
SECONDS = 1.1
"""After so long each knows what the other has done."""


class SharedJournal(MemoryJournal):
    """A journal that says where its file is, and so may be that of several executives."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self._file = file
        self._told = 0
        self._telling = asyncio.Event()

    @property
    def file(self) -> Path:
        return self._file

    async def changed(self, seen: int) -> int:
        while self._told <= seen:
            await self._telling.wait()
        return self._told

    def tell(self) -> None:
        """As a database that was told by an executive."""
        self._told += 1
        self._telling.set()
        self._telling = asyncio.Event()


@pytest.fixture
def play(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Runs `story(one, two)` in virtual time, on executives with one vehicle each."""
    monkeypatch.setenv("M2PEM_RUNTIME_DIR", str(tmp_path / "runtime"))

    def run(story: Callable[[Scheduling, Scheduling], Awaitable[Any]]) -> Any:
        async def main(clock: VirtualClock) -> Any:
            journal = SharedJournal(tmp_path / "journal.db")
            others = {"has_others": lambda: True}
            async with (
                serving(clock, journal, unattended_fleet("ugv1"), options=others) as one,
                serving(clock, journal, unattended_fleet("ugv2"), options=others) as two,
            ):
                return await story(one, two)

        return run_virtual(main, START_US)

    return run


async def statuses(world: Scheduling) -> dict[str, str]:
    found = await world.executive.control.scheduled()
    return {each.entry: each.status.value for each in found.entries}


def test_each_sees_what_the_other_schedules_holds_releases_and_cancels(play):
    async def story(one: Scheduling, two: Scheduling):
        await one.at(100)  # for long, neither has had anything to do
        await one.schedule(ASK, at=at(1000))
        seen = []
        for act in (
            lambda: asyncio.sleep(0),
            lambda: two.executive.control.hold_schedule("s1", by="bob", reason="rain"),
            lambda: one.executive.control.release_schedule("s1", by="ada"),
            lambda: two.executive.control.hold_schedule(by="bob", reason="smoke"),
            lambda: one.executive.control.release_schedule(by="ada"),
            lambda: two.executive.control.unschedule("s1", by="bob"),
        ):
            await act()
            await one.clock.sleep(SECONDS)
            seen.append([(await each.executive.control.scheduled()).lines() for each in (one, two)])
        return seen

    seen = play(story)
    assert all(first == second for first, second in seen), seen
    assert "held by bob: rain" in str(seen[1])
    assert "held" not in str(seen[2])
    assert "held by bob: smoke" in str(seen[3])
    assert "held" not in str(seen[4])


def test_what_the_journal_tells_of_is_known_before_the_next_look(play):
    async def story(one: Scheduling, two: Scheduling):
        await one.at(100.25)
        await one.schedule(ASK, at=at(1000))
        one.executive.journal.tell()
        await one.clock.sleep(0.01)
        return await statuses(two)

    assert play(story) == {"s1": "scheduled"}


def test_an_operator_may_cancel_at_once_what_was_scheduled_at_the_other(play):
    async def story(one: Scheduling, two: Scheduling):
        await one.schedule(ASK, at=at(1000))
        await two.executive.control.unschedule("s1", by="bob")
        await one.clock.sleep(SECONDS)
        return await statuses(one)

    assert play(story) == {"s1": "cancelled"}


def test_each_time_starts_one_run_though_both_serve_it(play):
    async def story(one: Scheduling, two: Scheduling):
        await one.schedule(ASK, cron="* * * * *", concurrency=Concurrency.ALLOW)
        await two.schedule(ASK, at=at(90))
        await one.at(330)
        return await one.begun(), await one.entry("s1"), await two.entry("s2")

    begun, cron, once = play(story)
    assert sorted(begun.values()) == [60.0, 90.0, 120.0, 180.0, 240.0, 300.0]
    assert len({each.run for each in (*cron.times, *once.times)}) == 6
    assert {each.settlement for each in cron.times} == {Settlement.STARTED}


def test_what_names_a_vehicle_of_the_other_is_left_to_it(play):
    """Also while that vehicle is busy; whoever knows it starts it."""

    async def story(one: Scheduling, two: Scheduling):
        run = await one.executive.control.start(drive("ugv1"))
        await one.schedule(drive("ugv1"))
        await one.clock.sleep(20)
        waiting = await two.entry("s1")
        await one.end(run)
        await one.end("r2")
        return waiting, await one.entry("s1"), two.told()

    waiting, after, told = play(story)
    assert waiting.status is ScheduledStatus.WAITING, waiting
    assert "Another executive on the journal may start it" in waiting.reason
    assert (after.status, after.run) == (ScheduledStatus.ENDED, "r2")
    assert sum("s1 cannot start" in text for text in told) == 1
