"""An executive that was stopped for a while, or replaced, moves nothing that it does not drive."""

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Any

import pytest

from m2pem.api.arbiter import BehaviorReport
from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.runs import Alert
from m2pem.errors import JournalError, OperatorError, StaleCommandError, StaleEpochError
from m2pem.executive import outages, ownership
from m2pem.executive.executive import Executive
from m2pem.journal import Entry, MemoryJournal
from m2pem.mission.catalogue import BehaviorState, ResourceId

from .conftest import START_US, FakePlugins, Fakes, World, behavior, fleet, mission, sequence

DRIVE = mission(sequence(("Drive", behavior("Drive", "drive_stop", "ugv1"))))
STOPPED_S = 60.0


class Clock:
    """The time that goes on while a process is stopped."""

    def __init__(self) -> None:
        self.now_s = 1000.0

    def stop_process(self) -> None:
        self.now_s += STOPPED_S


@pytest.fixture
def awake(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    for module in (ownership, outages):
        monkeypatch.setattr(module, "boot_time_s", lambda: clock.now_s)
    return clock


class UnreadableJournal(MemoryJournal):
    """It says nothing of claims while it is `broken`."""

    broken = False

    async def check_claim(self, run: str, epoch: int) -> None:
        if self.broken:
            raise JournalError("the database does not answer")
        await super().check_claim(run, epoch)


@asynccontextmanager
async def watched(world: World) -> AsyncIterator[None]:
    watched = (world.executive.stalls, world.executive.ownership)
    watching = [asyncio.create_task(each.watch()) for each in watched]
    await asyncio.sleep(0)
    yield
    for each in watching:
        each.cancel()


async def driving(world: World) -> str:
    """Start a run whose vehicle drives."""
    run = await world.executive.control.start(DRIVE)
    await world.fake.until_called("start")
    world.fake.report(f"{run}.b1", BehaviorState.ACCEPTED)
    world.fake.report(f"{run}.b1", BehaviorState.RUNNING)
    return run


async def claimed_by_another(world: World, run: str) -> None:
    await world.journal.release(run)
    await world.journal.claim(run)


async def alert(world: World, code: str) -> Alert:
    async for event in world.executive.control.subscribe():
        if isinstance(event, Alert) and event.code == code:
            return event
    raise AssertionError("the executive ended")


def alerted(world: World, code: str) -> "asyncio.Task[Alert]":
    return asyncio.create_task(alert(world, code))


async def resumed_behind_a_hold_that_hangs(world: World, run: str) -> None:
    """Have a resume wait in the vehicle's queue, decided and written."""
    world.fake.hangs.add("hold")
    await world.executive.control.pause(run)
    await world.fake.until_called("hold")
    await world.executive.control.resume(run)


@pytest.mark.parametrize(("taken", "resumes"), [(True, 0), (False, 1)])
def test_a_command_that_waited_while_the_process_was_stopped_needs_the_claim(
    play, awake: Clock, taken: bool, resumes: int
) -> None:
    async def story(world: World) -> int:
        async with watched(world):
            run = await driving(world)
            await resumed_behind_a_hold_that_hangs(world, run)
            if taken:
                await claimed_by_another(world, run)
                replaced = alerted(world, "RUN_REPLACED")
            awake.stop_process()
            await world.clock.sleep(60)  # the hold is given up after 10 s
            if taken:
                assert "claimed by another executive since (epoch 2" in (await replaced).text
                assert world.fake.count("disown", run) == 1
                with pytest.raises(StaleEpochError):
                    await world.executive.control.wait(run)
            else:
                world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
                await world.executive.control.wait(run)
            return world.fake.count("resume")

    assert play(story, "ugv1") == resumes


def test_arbiters_send_nothing_by_themselves_before_the_journal_has_confirmed_the_claims(
    play, awake: Clock
) -> None:
    async def story(world: World) -> None:
        may_send = world.fake.context.may_send
        async with watched(world):
            run = await driving(world)
            assert may_send()
            awake.stop_process()
            assert not may_send()
            await world.executive.ownership.confirmed()
            assert may_send()
            awake.stop_process()
            assert not may_send()
            await world.executive.control.pause(run)
            assert may_send(), "the hold must go out, whatever the journal says"
            world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)

    play(story, "ugv1")


def test_a_run_is_held_when_the_journal_cannot_say_whose_it_is(play, awake: Clock) -> None:
    journal = UnreadableJournal()

    async def story(world: World) -> None:
        async with watched(world):
            run = await driving(world)
            held = alerted(world, "RUN_HELD")
            journal.broken = True
            awake.stop_process()
            assert "the database does not answer" in (await held).text
            await world.fake.until_called("hold", "ugv1")
            assert world.executive.runner(run).done.is_set()

    play(story, "ugv1", journal=journal)


def test_a_vehicle_that_has_seen_a_newer_epoch_ends_the_commands_of_its_run(play) -> None:
    async def story(world: World) -> None:
        run = await driving(world)
        replaced = alerted(world, "RUN_REPLACED")
        await asyncio.sleep(0)
        world.fake.report(f"{run}.b1", BehaviorState.RUNNING, epoch=7)
        assert "has seen epoch 7 of r1, and this executive has epoch 1" in (await replaced).text
        await world.fake.until_called("disown", run)
        (reason,) = (await world.executive.control.unavailable()).values()
        assert reason == "another executive drives r1, which has it"
        assert world.fake.count("hold") == world.fake.count("cancel") == 0

    play(story, "ugv1")


class TwoArbiters(FakePlugins):
    """The arbiter `fake` under any name."""

    def arbiter(self, _: str) -> Callable[..., Any]:
        return super().arbiter("fake")


def test_an_arbiter_that_hangs_keeps_no_other_one_from_letting_go_of_a_run() -> None:
    async def story(clock: VirtualClock) -> None:
        fakes, ugv1 = Fakes(), ResourceId("ugv1")
        of = fleet("ugv2", "ugv1")
        of = replace(of, vehicles={**of.vehicles, ugv1: replace(of.vehicles[ugv1], arbiter="b")})
        executive = Executive(of, MemoryJournal(), TwoArbiters(fakes, []), clock, watch_links=False)
        async with executive:
            hanging, other = fakes.made
            run = await executive.control.start(DRIVE)
            await other.until_called("start")
            hanging.hangs.add("disown")
            other.report(f"{run}.b1", BehaviorState.RUNNING, epoch=7)
            await other.until_called("disown", run)
            assert clock.now_us() - START_US < 1_000_000

    run_virtual(story, START_US)


def test_an_operators_stop_of_a_run_that_another_executive_drives_holds_its_vehicles(play) -> None:
    async def story(world: World) -> None:
        run = await driving(world)
        world.fake.report(f"{run}.b1", BehaviorState.RUNNING, epoch=7)
        await world.fake.until_called("disown", run)
        with pytest.raises(OperatorError, match="to hold, and the stop is not recorded"):
            await world.executive.control.stop(run, by="anna")
        assert world.fake.count("hold", "ugv1") == 1
        assert world.fake.count("cancel") == 0

    play(story, "ugv1")


def test_a_stop_that_a_vehicle_refuses_becomes_a_hold(play) -> None:
    async def story(world: World) -> None:
        run = await driving(world)
        world.fake.raises["cancel"] = StaleCommandError("cancel", run, 1, 2)
        with pytest.raises(OperatorError, match="its vehicles were commanded to hold"):
            await world.executive.control.stop(run, by="anna")
        await world.fake.until_called("hold", "ugv1")

    play(story, "ugv1")


def test_a_takeover_fences_its_run_before_it_asks_and_gets_the_vehicles_back(play) -> None:
    async def story(world: World) -> None:
        run = await driving(world)
        world.fake.report(f"{run}.b1", BehaviorState.RUNNING, epoch=2)
        await world.fake.until_called("disown", run)
        await world.executive.runner(run).done.wait()
        running = BehaviorReport(f"{run}.b1", 2, BehaviorState.RUNNING)
        world.fake.known[f"{run}.b1"] = running
        await world.executive.resume(run)  # the other executive has ended
        assert world.fake.fenced == {run: 2}
        assert await world.executive.control.unavailable() == {}
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        await world.executive.control.wait(run)

    play(story, "ugv1")


LEASE_S = 6.0


class LeasedJournal(MemoryJournal):
    """Its lease begins with the first run, and is renewed when the test says so."""

    def __init__(self, clock: Clock) -> None:
        super().__init__()
        self._clock = clock
        self._until_s: float | None = None
        self.hangs = False

    @property
    def lease_s(self) -> float | None:
        return LEASE_S

    @property
    def owned_until_s(self) -> float | None:
        return self._until_s

    def renew(self) -> None:
        self._until_s = self._clock.now_s + LEASE_S

    async def append(self, entries: Sequence[Entry]) -> None:
        if self.hangs:
            await asyncio.Event().wait()
        await super().append(entries)


async def pass_by(world: World, awake: Clock, seconds: float) -> None:
    """Let time go by, for the executive as well as for its lease."""
    for _ in range(round(seconds / 0.5)):
        awake.now_s += 0.5
        await world.clock.sleep(0.5)


def test_a_lease_that_is_renewed_interrupts_nothing(play, awake: Clock) -> None:
    journal = LeasedJournal(awake)

    async def story(world: World) -> None:
        journal.renew()
        async with watched(world):
            run = await driving(world)
            for _ in range(5):
                await pass_by(world, awake, LEASE_S / 2)
                journal.renew()
            assert not world.executive.runner(run).done.is_set()
            world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
            await world.executive.control.wait(run)

    play(story, "ugv1", journal=journal)


@pytest.mark.parametrize("hangs", [False, True])
def test_a_run_is_held_before_its_lease_ends_and_let_go_of_afterwards(
    play, awake: Clock, hangs: bool
) -> None:
    """Also when an entry waits for a database that does not answer."""
    journal = LeasedJournal(awake)

    async def story(world: World) -> None:
        journal.renew()
        async with watched(world):
            run = await driving(world)
            held, replaced = alerted(world, "RUN_HELD"), alerted(world, "RUN_REPLACED")
            await asyncio.sleep(0)
            if hangs:
                journal.hangs = True
                world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
            await pass_by(world, awake, LEASE_S * 0.5)
            assert world.fake.count("hold") == 0
            await pass_by(world, awake, LEASE_S * 0.25)
            assert "the journal has not confirmed for" in (await held).text
            await world.fake.until_called("hold", "ugv1")
            assert world.executive.runner(run).done.is_set()
            assert world.fake.count("disown") == 0
            holds = world.fake.count("hold")
            await pass_by(world, awake, LEASE_S * 0.25)
            assert "r1 was held, and another one may drive it" in (await replaced).text
            await world.fake.until_called("disown", run)
            assert world.fake.count("hold") == holds

    play(story, "ugv1", journal=journal)


def test_an_executive_that_notices_too_late_asks_and_holds_nothing_of_another(
    play, awake: Clock
) -> None:
    journal = LeasedJournal(awake)

    async def story(world: World) -> None:
        journal.renew()
        async with watched(world):
            run = await driving(world)
            replaced = alerted(world, "RUN_REPLACED")
            await claimed_by_another(world, run)
            awake.now_s += 2 * LEASE_S
            assert "claimed by another executive since" in (await replaced).text
            await world.fake.until_called("disown", run)
            assert world.fake.count("hold") == 0

    play(story, "ugv1", journal=journal)
