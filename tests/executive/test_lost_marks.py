"""What a vehicle may still do of a run that is over, when the executive is started again."""

import time
from pathlib import Path
from typing import Any

import pytest

from m2pem.api.arbiter import BehaviorReport
from m2pem.api.telemetry import LinkState, VehicleState
from m2pem.executive.lost_marks import LostMark, LostMarks
from m2pem.executive.retention import delete_runs
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.testing.fake_arbiter import Call

from .conftest import World, behavior, fleet, mission, sequence

DRIVE = mission(sequence(("B", behavior("B", "drive_stop", "ugv1"))))
UGV1 = ResourceId("ugv1")


class JournalAt(MemoryJournal):
    """A journal of a test, with marks beside it as one in a file has."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self._file = file

    @property
    def file(self) -> Path:
        return self._file

    def until_marks(self, number: int) -> None:
        """Wait for the thread that writes the marks: so many lost vehicles."""
        while len(list(self._file.parent.glob("journal.db-lost-*[!w]"))) != number:  # no .new
            time.sleep(0.005)


@pytest.fixture
def journal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> JournalAt:
    monkeypatch.setenv("M2PEM_RUNTIME_DIR", str(tmp_path / "runtime"))
    return JournalAt(tmp_path / "journal.db")


def says(world: World, link: LinkState = LinkState.CONNECTED) -> None:
    world.fake.say(VehicleState(UGV1, world.clock.now_us(), ready=True, link=link))


async def drive(world: World) -> str:
    run = await world.executive.control.start(DRIVE)
    await world.fake.until_called("start", f"{run}.b1")
    world.fake.report("r1.b1", BehaviorState.ACCEPTED)
    says(world)
    return run


async def lose(world: World) -> None:
    run = await drive(world)
    says(world, LinkState.LOST)
    assert "LINK_LOST" in (await world.executive.control.wait(run)).detail


async def shown(world: World) -> Any:
    return (await world.executive.control.unavailable()).get("ugv1", "")


async def refused(world: World) -> str:
    control = world.executive.control
    return (await control.wait(await control.start(DRIVE, even_if_busy=True))).detail


@pytest.mark.parametrize("goes_on", [True, False])
def test_a_vehicle_lost_by_a_run_that_has_ended_is_held_when_it_returns(play, journal, goes_on):
    async def before(world: World):
        await lose(world)

    async def after(world: World):
        if goes_on:
            world.fake.known["r1.b1"] = BehaviorReport("r1.b1", 2, BehaviorState.RUNNING)
        why = "lost: the link was lost before a restart, when it did r1.b1"
        assert await shown(world) == why
        state = await anext(world.executive.control.telemetry())
        assert (state.link, state.ready, state.not_ready_reasons) == (LinkState.LOST, False, (why,))
        assert why in await refused(world)
        says(world, LinkState.DEGRADED)  # its arbiter still looks for it
        await world.clock.sleep(0.1)
        assert world.executive.bus.latest(UGV1).link is LinkState.LOST
        assert not world.fake.calls
        says(world)
        if goes_on:
            await world.fake.until_called("cancel", "r1.b1")
            assert "its link is restored" in await refused(world)
            world.fake.known["r1.b1"] = BehaviorReport("r1.b1", 3, BehaviorState.UNKNOWN)
        await world.fake.until_called("hold", "ugv1")
        says(world)
        await world.clock.sleep(0.1)
        assert await shown(world) == "returned: held"
        assert world.fake.calls[0] == Call("query", "r1.b1")
        assert not world.fake.count("start")
        run = await world.executive.control.start(DRIVE)
        await world.fake.until_called("start", f"{run}.b1")

    async def at_last(world: World):
        says(world)
        await world.clock.sleep(1.0)
        assert not world.fake.calls
        assert await shown(world) == ""

    for story, left in ((before, 1), (after, 0), (at_last, 0)):
        play(story, "ugv1", journal=journal, watch_links=story is before)
        journal.until_marks(left)


def test_the_old_behavior_is_ended_with_the_epoch_under_which_it_was_begun(play, journal):
    """A receiver refuses what has an older one."""

    async def before(world: World):
        await lose(world)

    async def after(world: World):
        assert world.fake.context.epoch_of("r1.b1") == 1
        says(world)
        await world.fake.until_called("hold", "ugv1")
        await world.clock.sleep(0.1)
        assert world.fake.context.epoch_of("r1.b1") == 0

    play(before, "ugv1", journal=journal, watch_links=True)
    journal.until_marks(1)
    play(after, "ugv1", journal=journal)


@pytest.mark.parametrize("other", [fleet("ugv1", "uav1"), fleet("ugv1")])
def test_a_mark_is_of_the_fleet_and_the_journal_for_which_it_was_written(play, journal, other):
    async def story(world: World):
        return await shown(world)

    marks = LostMarks(journal.file, journal.identity, fleet("ugv1"))
    marks.put(UGV1, LostMark("r1.b1", None, 1, "why"))
    journal.until_marks(1)
    assert play(story, journal=journal, fleet=other) == "lost: why"
    assert play(story, "ugv1", journal=JournalAt(journal.file)) == ""


def test_what_a_run_left_that_is_deleted_is_ended(play, journal):
    async def before(world: World):
        await drive(world)
        await world.clock.sleep(1.0)
        world.executive.runner("r1").fail(OSError("killed"))
        await world.clock.sleep(1.0)

    async def after(world: World):
        await delete_runs(journal, ["r1"], by="ann", unended=True)

    async def at_last(world: World):
        world.fake.known["r1.b1"] = BehaviorReport("r1.b1", 2, BehaviorState.RUNNING)
        why = "lost: run r1 was deleted before it had ended, when it did r1.b1"
        assert await shown(world) == why
        says(world)
        await world.fake.until_called("cancel", "r1.b1")
        world.fake.known["r1.b1"] = BehaviorReport("r1.b1", 3, BehaviorState.CANCELLED)
        await world.fake.until_called("hold", "ugv1")
        await world.clock.sleep(0.1)
        assert await shown(world) == "returned: held"

    for story, left in ((before, 0), (after, 1), (at_last, 0)):
        play(story, "ugv1", journal=journal)
        journal.until_marks(left)


def test_a_resumed_run_whose_vehicle_is_not_received_loses_it_although_it_was_lost_before(
    play, journal
):
    """The executive died before it had removed the mark of an earlier run."""

    async def before(world: World):
        await drive(world)
        await world.clock.sleep(1.0)
        world.executive.runner("r1").fail(OSError("killed"))
        await world.clock.sleep(1.0)

    async def after(world: World):
        world.fake.known["r1.b1"] = BehaviorReport("r1.b1", 2, BehaviorState.RUNNING)
        await world.executive.resume("r1")
        return (await world.executive.control.wait("r1")).detail

    play(before, "ugv1", journal=journal)
    marks = LostMarks(journal.file, journal.identity, fleet("ugv1"))
    marks.put(UGV1, LostMark("r0.b1", None, 1, "why"))
    journal.until_marks(1)
    assert "LINK_LOST" in play(after, "ugv1", journal=journal, watch_links=True)
