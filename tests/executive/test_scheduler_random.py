"""Random schedules, kills and clocks: no time starts twice, and none is lost unsaid.

The scheduler is that of the product, on a journal that outlives it. What it starts is a double that
dies where the test says: before the journal has the start, after that, or after the run has begun.
"""

import asyncio
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.bpmn import parse_mission
from m2pem.engine.inputs import Tick
from m2pem.engine.records import RunEnded, RunOutcome, RunStarted
from m2pem.errors import ScheduleError
from m2pem.executive.emergency import StopMarks
from m2pem.executive.run_starter import NotBegunError
from m2pem.executive.schedule_entries import ScheduleEntries
from m2pem.executive.scheduler import Scheduler
from m2pem.fleet.fleet import Fleet
from m2pem.journal import Entry, Journal, MemoryJournal, RunHeader
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.mission import Mission
from m2pem.scheduling.entry import (
    Concurrency,
    EntryChange,
    EntryState,
    Missed,
    ScheduleEntry,
    SchedulePlan,
    Settlement,
    When,
)
from m2pem.scheduling.times import due, resolved

from .conftest import START_US, question, sequence
from .conftest import mission as mission_of

ASK = mission_of(sequence(("Ask", question("Ask"))))
US = 1_000_000
FLEET = Fleet("test", "test.yaml", {}, start_warning_s=2.0)


class KilledError(BaseException):
    """The process is gone: nothing that it would do any more is done."""


@dataclass
class Starts:
    """What starts runs. `dies`: at the n-th start, at a place. `takes_s`: how long a run takes."""

    clock: VirtualClock
    journal: Journal
    dies: dict[int, str] = field(default_factory=dict)
    takes_s: float = 30.0
    fleet: Fleet = field(
        default_factory=lambda: Fleet("test", "test.yaml", {}, start_warning_s=2.0)
    )
    started: int = 0
    running: dict[str, int] = field(default_factory=dict)

    def admitted(self, plan: SchedulePlan) -> tuple[Mission, str]:
        return parse_mission(plan.mission, plan.mission_name), plan.process

    async def unapproved(self, _: SchedulePlan) -> str:
        return ""

    async def begin_scheduled(
        self,
        loaded: Mission,
        process: str,
        plan: SchedulePlan,
        by: str,
        started: EntryChange,
        still: Callable[[], bool],
    ) -> str:
        self.started += 1
        place = self.dies.get(self.started, "")
        if place == "before":
            raise KilledError
        run = await self.journal.create(RunHeader("m", ASK, "P", simulated=True), started)
        if place == "created":
            raise KilledError
        if place == "refused" or not still():
            await self.journal.release(run)
            raise NotBegunError(run, "the disk is full")
        now_us = self.clock.now_us()
        begun = Entry(run, 1, 1, now_us, 0, Tick(), (RunStarted("P", now_us, by=by),))
        await self.journal.append([begun])
        if place == "begun":
            raise KilledError
        self.running[run] = now_us + round(self.takes_s * US)
        asyncio.get_running_loop().create_task(self._end(run))
        return run

    async def _end(self, run: str) -> None:
        await self.clock.sleep(self.takes_s)
        if run in self.running:
            await self.end(run)

    async def end(self, run: str) -> None:
        """A run ends; one that a killed executive has left, after it was taken up."""
        now_us = self.clock.now_us()
        ended = Entry(run, 1, 2, now_us, 0, Tick(), (RunEnded(RunOutcome.COMPLETED, ""),))
        await self.journal.append([ended])
        await self.journal.release(run)
        self.running.pop(run, None)

    def has_others(self) -> bool:
        return False

    def outcome_of(self, run: str) -> str | None:
        return "" if run in self.running else None

    def users(self) -> Mapping[ResourceId, str]:
        return {}

    def unusable(self, resource: ResourceId) -> str:
        return ""

    def facts(self, vehicle: ResourceId) -> dict[str, Any]:
        return {}


PLACES = st.sampled_from(["before", "created", "begun", "refused"])
WHEN = st.builds(
    When,
    at=st.sampled_from(["", "2026-01-01T00:03:00+00:00"]),
    missed=st.sampled_from(Missed),
    concurrency=st.sampled_from(Concurrency),
    starting_deadline_s=st.sampled_from([None, 0.0, 20.0, 90.0]),
) | st.builds(
    When,
    cron=st.sampled_from(["* * * * *", "*/3 * * * *", "2-5 * * * *"]),
    time_zone=st.sampled_from(["UTC", "Europe/Berlin"]),
    missed=st.sampled_from(Missed),
    concurrency=st.sampled_from(Concurrency),
    starting_deadline_s=st.sampled_from([None, 0.0, 20.0, 90.0]),
    until=st.sampled_from(["", "2026-01-01T00:08:00+00:00"]),
)
STORY = st.lists(
    st.tuples(
        st.sampled_from(["serve", "down"]),
        st.integers(1, 400),
        st.dictionaries(st.integers(1, 6), PLACES, max_size=3),
        st.sampled_from(["", "hold", "release"]),
    ),
    min_size=1,
    max_size=6,
)


Turn = tuple[str, int, dict[int, str], str]


@dataclass
class Played:
    """A journal through several executives, and what operators were told."""

    clock: VirtualClock
    takes_s: float
    journal: MemoryJournal = field(default_factory=MemoryJournal)
    told: list[str] = field(default_factory=list)

    async def turn(self, whens: list[When], turn: Turn) -> None:
        """An executive serves for a time, or none does."""
        what, seconds, dies, operator = turn
        if what == "down":
            await self.clock.sleep(seconds)
            return
        starts = Starts(self.clock, self.journal, dies, self.takes_s)
        for line in await self.journal.runs():  # a killed executive holds no run any more
            await self.journal.release(line.run)
        marks = StopMarks(None, self.journal.identity)
        entries = ScheduleEntries(starts, self.publish, marks, real=False)
        await entries.load()
        await self.take_up()
        entries.served = True
        if not await self.journal.entries():
            await self.schedule(entries, whens)
        await self.operate(entries, operator)
        serving = asyncio.create_task(Scheduler(starts, entries).serve())
        await asyncio.wait([serving], timeout=seconds)
        if serving.done():
            assert isinstance(serving.exception(), KilledError)
        serving.cancel()
        await asyncio.wait([serving])
        starts.running.clear()  # killed, or shut down: what it drives is left

    def publish(self, event: Any) -> None:
        self.told.append(getattr(event, "text", ""))

    async def take_up(self) -> None:
        """The runs that an executive has left are taken up, and end."""
        for line in await self.journal.runs():
            if line.outcome is None and line.last_seq:
                epoch = await self.journal.claim(line.run)
                now_us, ended = self.clock.now_us(), (RunEnded(RunOutcome.COMPLETED, ""),)
                entry = Entry(line.run, epoch, line.last_seq + 1, now_us, 0, Tick(), ended)
                await self.journal.append([entry])
                await self.journal.release(line.run)

    async def schedule(self, entries: ScheduleEntries, whens: list[When]) -> None:
        for when in whens:
            now_us = self.clock.now_us()
            with suppress(ScheduleError):  # its time has passed
                wanted = resolved(when, now_us, "UTC")
                plan = SchedulePlan("m.bpmn", ASK, "P", "test", now_us, wanted)
                await entries.schedule(plan, ())

    async def operate(self, entries: ScheduleEntries, operator: str) -> None:
        for entry in await self.journal.entries():
            held = entry.state.hold is not None
            if operator == "hold" and entry.state.active and not held:
                await entries.hold(entry.id, "ada", "")
            elif operator == "release" and entry.state.active and held:
                await entries.release(entry.id, "ada")

    async def check(self) -> None:
        """A last executive reads the journal; each start that it knows is a run that has begun."""
        for line in await self.journal.runs():
            await self.journal.release(line.run)
        starts, marks = Starts(self.clock, self.journal), StopMarks(None, self.journal.identity)
        await ScheduleEntries(starts, self.publish, marks, real=False).load()
        begun = {line.run for line in await self.journal.runs() if line.last_seq}
        known: set[str] = set()
        for entry in await self.journal.entries():
            started = [each for each in entry.state.times if each.run]
            known |= {each.run for each in started}
            assert len({each.run for each in started}) == len(started)
            own = [each.due_us for each in started if not each.owed]
            assert len(own) == len(set(own))
            if any(each.settlement is Settlement.MISSED for each in entry.state.times):
                assert any(f"{entry.id} missed" in text for text in self.told)
            assert sum(each.times for each in entry.state.times if not each.owed) == passed(entry)
        assert begun == known


def passed(entry: ScheduleEntry) -> int:
    """How many of an entry's times are settled, by its own calendar."""
    plan, state = entry.plan, entry.state
    if not plan.when.cron:
        return 1 if state.times else 0
    cursor, found = EntryState(plan.scheduled_us), 0
    while (next_us := due(plan, cursor, cursor.settled_us).next_us) is not None:
        if next_us > state.settled_us:
            break
        cursor, found = EntryState(next_us), found + 1
    return found


@settings(deadline=None, max_examples=60)
@given(
    whens=st.lists(WHEN, min_size=1, max_size=3),
    story=STORY,
    takes_s=st.sampled_from([5.0, 100.0]),
)
def test_no_time_starts_twice_and_none_is_lost_unsaid(
    whens: list[When], story: list[Turn], takes_s: float
) -> None:
    async def main(clock: VirtualClock) -> None:
        played = Played(clock, takes_s)
        for turn in story:
            await played.turn(whens, turn)
        await played.check()

    run_virtual(main, START_US)
