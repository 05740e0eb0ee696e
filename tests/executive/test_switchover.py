"""What an executive does that leaves its runs to the one that stands by."""

import asyncio
from collections.abc import Sequence

import pytest

from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.health import ExecutiveAddress
from m2pem.engine.inputs import PauseRun, StopRun
from m2pem.errors import OperatorError, StaleEpochError
from m2pem.journal import Entry, MemoryJournal
from m2pem.journal.standbys import standby_of
from m2pem.mission.catalogue import BehaviorState

from .conftest import START_US, World, behavior, mission, sequence
from .schedule_world import at, drive, serving, unattended_fleet

DRIVE = mission(sequence(("Drive", behavior("Drive", "drive_stop", "ugv1"))))


class SlowJournal(MemoryJournal):
    """It writes nothing while `writes` is cleared."""

    def __init__(self) -> None:
        super().__init__()
        self.writes = asyncio.Event()
        self.writes.set()

    async def append(self, entries: Sequence[Entry]) -> None:
        await self.writes.wait()
        await super().append(entries)


async def driving(world: World) -> str:
    """Start a run whose vehicle drives; another executive stands by."""
    await world.journal.serve_fleet(standby_of("test"), ["1"])
    run = await world.executive.control.start(DRIVE)
    await world.fake.until_called("start")
    world.fake.report(f"{run}.b1", BehaviorState.ACCEPTED)
    world.fake.report(f"{run}.b1", BehaviorState.RUNNING)
    return run


@pytest.mark.parametrize(
    ("what", "command", "recorded"), [("stop", "cancel", StopRun), ("pause", "hold", PauseRun)]
)
def test_what_an_operator_asked_for_just_before_is_recorded(
    play, what: str, command: str, recorded: type
) -> None:
    journal = SlowJournal()

    async def story(world: World) -> None:
        run = await driving(world)
        journal.writes.clear()
        asked = asyncio.create_task(getattr(world.executive.control, what)(run, by="anna"))
        await world.fake.until_called(command)
        switching = asyncio.create_task(world.executive.control.switch_over(by="ben"))
        await world.clock.sleep(0.5)
        assert not world.executive.superseded.is_set()
        journal.writes.set()
        await asked
        await switching
        assert world.executive.superseded.is_set()
        assert world.fake.count("disown", run) == 1
        inputs = [entry.input async for entry in journal.read(run)]
        assert any(isinstance(each, recorded) for each in inputs)

    play(story, "ugv1", journal=journal)


def test_a_journal_that_hangs_does_not_delay_a_switchover_for_long(play) -> None:
    journal = SlowJournal()

    async def story(world: World) -> None:
        run = await driving(world)
        journal.writes.clear()
        asked = asyncio.create_task(world.executive.control.pause(run, by="anna"))
        await world.fake.until_called("hold")
        begun_us = world.clock.now_us()
        await world.executive.control.switch_over(by="ben")
        assert world.clock.now_us() - begun_us < 2_000_000
        with pytest.raises(OperatorError, match="pause"):
            await asked
        with pytest.raises(StaleEpochError, match="switchover: ben asked for it"):
            await world.executive.control.pause(run)

    play(story, "ugv1", journal=journal)


def test_two_operators_who_ask_at_once_read_the_same(play) -> None:
    async def story(world: World) -> list[ExecutiveAddress]:
        await driving(world)
        control = world.executive.control
        both = await asyncio.gather(control.switch_over(by="anna"), control.switch_over(by="ben"))
        await world.journal.leave_fleet(standby_of("test"))  # it has taken over
        return [*both, await control.switch_over(by="carl")]

    first, second, third = play(story, "ugv1")
    assert first == second == third


def test_the_schedule_leaves_its_next_start_to_the_standby(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def story(clock: VirtualClock) -> None:
        journal = MemoryJournal()
        async with serving(clock, journal, unattended_fleet("ugv1")) as world:
            await journal.serve_fleet(standby_of("test"), ["1"])
            entry = await world.schedule(drive("ugv1"), at=at(10))
            await world.at(5)
            await world.executive.control.switch_over(by="anna")
            with pytest.raises(OperatorError, match="no run begins here any more: switchover"):
                await world.executive.control.start(DRIVE)
            await world.at(12)
            assert "no run begins here any more" in world.told()[-1]
            assert (await world.entry(entry)).due_us == START_US + 10_000_000
            assert await world.begun() == {}

    run_virtual(story, START_US)
    assert "broke off" not in caplog.text
