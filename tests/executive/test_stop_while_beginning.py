"""STOP of all at each moment of the beginning of an executive, from when operators can reach it.

The beginning is played once for each moment: each call of the journal and of the arbiter gives way
to other tasks before and after its work, and STOP comes there.
"""

import asyncio
import inspect
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import pytest

from m2pem.api.arbiter import ArbiterContext, BehaviorReport, Connection
from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.runs import RunStatus
from m2pem.api.schedule import Missed
from m2pem.errors import JournalError, OperatorError
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.testing.fake_arbiter import FakeArbiter

from .conftest import START_US, FakePlugins, Fakes
from .schedule_world import at, drive, serving, unattended_fleet
from .test_interrupted_runs import accepted, leave, running

FLEET = unattended_fleet(*(f"ugv{number}" for number in range(1, 10)))
SCHEDULED = drive("ugv9")
LEFT_US = START_US + 60_000_000
HELD = "held by bob: STOP of all: smoke"


@dataclass
class Moments:
    """The moments at which something else may run. `stop_at`: the number of that of the STOP.
    `started`: how many behaviors were started before it. `held`: the hold of the journal when it
    was acknowledged."""

    stop_at: int = 0
    fakes: Fakes = field(default_factory=Fakes)
    executive: Executive | None = None
    started: int = 0
    number: int = 0
    stopping: "asyncio.Task[Sequence[str]] | None" = None
    held: list[str] = field(default_factory=list)

    async def give_way(self) -> None:
        """Be one moment."""
        if self.executive is not None:
            self.number += 1
            if self.number == self.stop_at:
                self.stopping = asyncio.create_task(self._stop(self.executive))
        await asyncio.sleep(0)

    async def _stop(self, executive: Executive) -> Sequence[str]:
        self.started = sum(each.count("start") for each in self.fakes.made)
        runs = await executive.control.stop_all(by="bob", reason="smoke")
        self.held.append(str(await executive.journal.schedule_hold("test")))
        return runs


class GivingWay(MemoryJournal):
    """A journal in memory of which each call is two moments."""

    def __init__(self, moments: Moments) -> None:
        super().__init__()
        self.moments = moments

    def __getattribute__(self, name: str) -> Any:
        found = super().__getattribute__(name)
        if name == "changed" or not inspect.iscoroutinefunction(found):
            return found

        async def giving_way(*args: Any, **options: Any) -> Any:
            await self.moments.give_way()
            result = await found(*args, **options)
            await self.moments.give_way()
            return result

        return giving_way


class SlowFakes(Fakes):
    """Makes an arbiter that takes moments. `unreachable`: it connects after 6 s, and does not
    answer what r1 does."""

    def __init__(self, moments: Moments, *, unreachable: bool) -> None:
        super().__init__()
        self._moments = moments
        self._unreachable = unreachable

    def make(
        self, connections: dict[ResourceId, Connection], context: ArbiterContext
    ) -> FakeArbiter:
        moments, unreachable = self._moments, self._unreachable

        class Slow(FakeArbiter):
            async def connect(self) -> None:
                for _ in range(6 if unreachable else 1):
                    await moments.give_way()
                    await asyncio.sleep(1.0 if unreachable else 0.0)
                await moments.give_way()

            async def query(self, behavior: str, native_ref: str | None) -> BehaviorReport:
                for _ in range(20 if unreachable and behavior == "r1.b1" else 1):
                    await moments.give_way()
                    await asyncio.sleep(1.0 if unreachable and behavior == "r1.b1" else 0.0)
                return await super().query(behavior, native_ref)

            async def cancel(self, behavior: str, epoch: int) -> None:
                await super().cancel(behavior, epoch)
                if not (unreachable and behavior == "r1.b1"):
                    self.report(behavior, BehaviorState.CANCELLED)

            async def fence(self, run: str, epoch: int) -> None:
                await moments.give_way()
                await super().fence(run, epoch)

        self.made.append(Slow(connections, context))
        return self.made[-1]


async def left_behind(clock: VirtualClock, journal: MemoryJournal, number: int) -> None:
    """Leave runs, of which every second one has not sent its command, and a scheduled mission."""
    async with serving(clock, journal, FLEET) as world:
        await world.schedule(SCHEDULED, at=at(61), missed=Missed.RUN_ONCE)
    for vehicle in range(1, number + 1):
        sent = (accepted, running) if vehicle % 2 else ()
        await leave(journal, drive(f"ugv{vehicle}"), *sent, of=FLEET)


async def play(clock: VirtualClock, stop_at: int, number: int, *, unreachable: bool) -> bool:
    """Begin once; returns whether the beginning has as many moments."""
    moments = Moments(stop_at)
    journal = GivingWay(moments)
    await left_behind(clock, journal, number)
    runs = [line.run for line in await journal.runs()]
    fakes = moments.fakes = SlowFakes(moments, unreachable=unreachable)
    executive = Executive(FLEET, journal, FakePlugins(fakes, []), clock, watch_links=False)
    executive.supervisor.interrupted.expect(runs)
    await clock.sleep_until(LEFT_US)
    moments.executive = executive
    async with executive:
        (fake,) = fakes.made
        for run in runs[::2]:
            fake.known[f"{run}.b1"] = BehaviorReport(f"{run}.b1", 2, BehaviorState.RUNNING)
        await executive.load_schedule()
        assert not await executive.resume_all(runs)
        executive.serve_schedule()
        await clock.sleep(0.5)
        moments.executive = None
        if moments.stopping is None:
            return False
        answered = await moments.stopping
        # Of a run whose vehicle is lost, the end is its loss.
        ended = runs[1:] if unreachable else runs
        assert [run for run in answered if run in ended] == ended, stop_at
        for run in ended:
            assert (await executive.control.wait(run)).status is RunStatus.STOPPED, stop_at
        await clock.sleep(100)
        assert fake.count("start") == moments.started, stop_at
        assert (await executive.control.scheduled()).hold == HELD, stop_at
        assert moments.held == [HELD], stop_at
    async with serving(clock, journal, FLEET) as world:
        await clock.sleep(100)
        assert list(await world.begun()) == runs, stop_at
        assert (await world.executive.control.scheduled()).hold == HELD, stop_at
        await world.executive.control.release_schedule(by="bob")
        await world.fake.until_called("start", f"r{number + 1}.b1")
    return True


@pytest.mark.parametrize(
    ("number", "unreachable"),
    [(0, False), (8, False), (2, True)],
    ids=["no runs", "8 runs", "a vehicle that is out of reach"],
)
def test_stop_of_all_counts_at_each_moment_of_a_beginning(number: int, unreachable: bool) -> None:
    for moment in count(1):

        async def main(clock: VirtualClock, stop_at: int = moment) -> bool:
            return await play(clock, stop_at, number, unreachable=unreachable)

        if not run_virtual(main, START_US):
            break
    assert moment > 10 + 5 * number


def test_stop_of_all_holds_the_schedule_where_an_executive_only_resumes_a_run() -> None:
    async def main(clock: VirtualClock) -> None:
        moments = Moments()
        journal = GivingWay(moments)
        await left_behind(clock, journal, 1)
        fakes = SlowFakes(moments, unreachable=False)
        executive = Executive(FLEET, journal, FakePlugins(fakes, []), clock, watch_links=False)
        executive.supervisor.interrupted.expect(["r1"])
        async with executive:
            await executive.resume("r1")
            assert await executive.control.stop_all(by="bob", reason="smoke") == ["r1"]
        async with serving(clock, journal, FLEET) as world:
            await clock.sleep(100)
            assert list(await world.begun()) == ["r1"]
            assert (await world.executive.control.scheduled()).hold == HELD

    run_virtual(main, START_US)


def test_stop_of_all_where_nothing_is_scheduled_holds_nothing() -> None:
    async def main(clock: VirtualClock) -> None:
        journal = MemoryJournal()
        async with serving(clock, journal, FLEET) as world:
            await world.executive.control.stop_all(by="bob", reason="smoke")
            assert (await world.executive.control.scheduled()).hold == ""
            assert world.told() == []
            with pytest.raises(OperatorError, match="nothing is scheduled"):
                await world.executive.control.hold_schedule(by="bob")
            await world.schedule(SCHEDULED)
            await world.fake.until_called("start", "r1.b1")
        assert await journal.schedule_hold("test") is None

    run_virtual(main, START_US)


def test_a_journal_that_failed_gets_the_hold_when_it_writes_again() -> None:
    async def main(clock: VirtualClock) -> None:
        journal = MemoryJournal()
        async with serving(clock, journal, FLEET) as world:
            await world.schedule(SCHEDULED, at=at(60), missed=Missed.RUN_ONCE)
            write = journal.hold_schedule

            async def failing(*_: object) -> None:
                raise JournalError("the disk is full")

            journal.hold_schedule = failing  # type: ignore[method-assign]
            with pytest.raises(OperatorError, match=r"not been recorded \(the disk is full\)"):
                await world.executive.control.stop_all(by="bob", reason="smoke")
            await world.at(70)
            assert await world.begun() == {}
            journal.hold_schedule = write  # type: ignore[method-assign]
            await world.schedule(drive("ugv1"))  # looks at the journal, as is done each second
            await world.at(80)
            assert await world.begun() == {}
            assert str(await journal.schedule_hold("test")) == HELD

    run_virtual(main, START_US)
