"""An executive that was suspended, stopped or blocked looks at its vehicles before it goes on."""

import asyncio
from contextlib import suppress
from dataclasses import replace

from m2pem.api.arbiter import BehaviorReport
from m2pem.api.runs import Alert, RunStatus
from m2pem.errors import OperatorError, StaleEpochError
from m2pem.executive.control_events import ControlEvents
from m2pem.executive.outages import CODE, OUTAGE_S, Outages, StallMonitor
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import BehaviorState

from .conftest import World, behavior, fleet, mission, sequence

TARGET = '<m2pem:property name="target" value="[38.1, -77.3, 0]"/>'
TWO = mission(
    sequence(
        ("Drive", behavior("Drive", "goto", "ugv1", parameters=TARGET)),
        ("Back", behavior("Back", "goto", "ugv2", parameters=TARGET)),
    )
)
BOUND = 30.0


def bounded(max_outage_s=BOUND):
    return replace(fleet("ugv1", "ugv2"), max_outage_s=max_outage_s)


async def driving(world: World) -> None:
    """Until ugv1 drives."""
    await world.executive.control.start(TWO)
    await world.fake.until_called("start", "r1.b1")
    world.fake.report("r1.b1", BehaviorState.RUNNING)
    while "BehaviorProgressed" not in world.names():
        await world.clock.sleep(0.1)
    world.fake.known["r1.b1"] = BehaviorReport("r1.b1", 1, BehaviorState.RUNNING)


async def asked(world: World):
    while not (prompts := world.executive.control.prompts()):
        await world.clock.sleep(0.1)
    return prompts


def test_a_run_looks_at_its_vehicles_before_it_sends_anything(play):
    async def story(world: World):
        await driving(world)
        world.executive.supervisor.outages.noticed(BOUND - 1)
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        await world.fake.until_called("start", "r1.b2")
        calls = [(call.what, call.subject) for call in world.fake.calls]
        assert calls == [("start", "r1.b1"), ("query", "r1.b1"), ("start", "r1.b2")]

    play(story, fleet=bounded())


def test_a_run_that_another_executive_took_over_meanwhile_sends_nothing(play):
    async def story(world: World):
        await driving(world)
        seen = BehaviorReport("r1.b1", 1, BehaviorState.RUNNING, epoch=2)
        world.fake.known["r1.b1"] = seen
        world.executive.supervisor.outages.noticed(BOUND - 1)
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        with suppress(StaleEpochError):
            await world.executive.control.wait("r1")
        await world.fake.until_called("disown", "r1")
        assert world.fake.count("start") == 1

    play(story, fleet=bounded())


def test_an_end_that_nobody_saw_is_found(play):
    async def story(world: World):
        await driving(world)
        world.fake.known["r1.b1"] = BehaviorReport("r1.b1", 2, BehaviorState.FAILED, "STUCK", "mud")
        world.executive.supervisor.outages.noticed(BOUND - 1)
        summary = await world.executive.control.wait("r1")
        assert (summary.status, world.fake.count("start")) == (RunStatus.FAILED, 1)

    play(story, fleet=bounded())


def test_after_an_outage_beyond_the_fleets_bound_vehicles_are_held_and_an_operator_asked(play):
    async def story(world: World):
        control = world.executive.control
        await driving(world)
        world.executive.supervisor.outages.noticed(BOUND + 1)
        await world.fake.until_called("hold", "ugv1")
        (prompt,) = await asked(world)
        assert "the executive did nothing for 31 s" in prompt.text
        assert world.fake.count("start") == 1
        await control.answer("r1", prompt.prompt, "resume", by="anna")
        await world.fake.until_called("resume", "ugv1")
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        await world.fake.until_called("start", "r1.b2")

    play(story, fleet=bounded())


class SuspendedJournal(MemoryJournal):
    """The computer is suspended while the first start of a vehicle is being written."""

    suspended = lambda self: None  # noqa: E731

    async def append(self, entries):
        await super().append(entries)
        names = {type(record).__name__ for entry in entries for record in entry.records}
        if "BehaviorRequested" in names:
            self.suspended()


def test_what_was_decided_before_a_long_outage_is_not_sent_after_it_unasked(play):
    journal = SuspendedJournal()

    async def story(world: World):
        control = world.executive.control

        def suspend():
            journal.suspended = lambda: None
            world.executive.supervisor.outages.noticed(BOUND + 1)

        journal.suspended = suspend
        await control.start(TWO)
        (prompt,) = await asked(world)
        await world.clock.sleep(60)
        assert world.fake.count("start") == 0
        await control.answer("r1", prompt.prompt, "resume", by="anna")
        await world.fake.until_called("start", "r1.b1")

    play(story, fleet=bounded(), journal=journal)


def test_what_was_decided_before_a_short_outage_is_sent_after_it(play):
    journal = SuspendedJournal()

    async def story(world: World):
        journal.suspended = lambda: world.executive.supervisor.outages.noticed(BOUND - 1)
        await world.executive.control.start(TWO)
        await world.fake.until_called("start", "r1.b1")
        assert world.fake.calls[0].what == "query"

    play(story, fleet=bounded(), journal=journal)


def test_stop_reaches_a_vehicle_whose_arbiter_does_not_say_how_it_is(play):
    async def story(world: World):
        control = world.executive.control
        await driving(world)
        world.fake.hangs.add("query")
        world.executive.supervisor.outages.noticed(BOUND + 1)
        await world.fake.until_called("query", "r1.b1")
        began_us = world.clock.now_us()
        stopping = world.executive.control.stop("r1", by="anna")
        task = asyncio.create_task(stopping)
        await world.fake.until_called("cancel", "r1.b1")
        assert world.clock.now_us() == began_us
        world.fake.report("r1.b1", BehaviorState.CANCELLED)
        with suppress(OperatorError):
            await task
        assert (await control.wait("r1")).status is RunStatus.STOPPED

    play(story, fleet=bounded())


async def test_time_in_which_nothing_ran_is_an_outage_and_operators_are_told(monkeypatch) -> None:
    events = ControlEvents()
    alerts = events.subscribe(None, 10)
    now_s = [0.0]
    monkeypatch.setattr("m2pem.executive.outages.boot_time_s", lambda: now_s[0])
    stalls = StallMonitor()
    outages = Outages(events, stalls, speed=2.0)
    watching = asyncio.create_task(stalls.watch())
    await asyncio.sleep(0)
    now_s[0] += OUTAGE_S - 1
    stalls.look()
    assert outages.number == 0
    now_s[0] += 7_200
    stalls.look()
    stalls.look()
    assert (outages.number, outages.length_s) == (1, 14_400.0)
    alert = await anext(alerts)
    assert isinstance(alert, Alert)
    assert alert.code == CODE
    assert "did nothing for 14400 s" in alert.text
    watching.cancel()
