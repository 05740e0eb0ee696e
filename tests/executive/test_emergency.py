"""STOP and pause reach the arbiters whatever the journal, the mission or an arbiter does."""

import asyncio
import inspect
import re
import threading
import types
from collections.abc import Sequence
from dataclasses import replace

import pytest

from m2pem.api.runs import Alert, RunStatus
from m2pem.engine.records import BehaviorRequested, RunPaused
from m2pem.errors import OperatorError
from m2pem.executive import process_monitors
from m2pem.executive.control_events import MAX_WAITING, ControlEvents, RecordObservers
from m2pem.executive.health import ExecutiveHealth
from m2pem.executive.process_monitors import LATE_AFTER_S, TICK_S, LoopMonitor, blocking
from m2pem.journal import MemoryJournal
from m2pem.journal.base import Entry
from m2pem.mission.catalogue import BehaviorState

from .conftest import World, behavior, flow, mission, question, sequence

DRIVE = mission(sequence(("Drive", behavior("Drive", "drive_stop", "ugv1"))))

DRIVE_TWICE = mission(
    sequence(
        ("First", behavior("First", "drive_stop", "ugv1")),
        ("Second", behavior("Second", "drive_stop", "ugv1")),
    )
)

LOOP = mission(
    '<process id="P" isExecutable="true"><startEvent id="S"/>'
    '<parallelGateway id="Fork"/><exclusiveGateway id="Join"/><task id="Work"/>'
    f"{behavior('Drive', 'drive_stop', 'ugv1')}"
    '<exclusiveGateway id="Leave" default="Leave_Join"/><endEvent id="E"/>'
    f"{flow('S', 'Fork')}{flow('Fork', 'Drive')}{flow('Fork', 'Join')}{flow('Join', 'Work')}"
    f"{flow('Work', 'Leave')}{flow('Leave', 'Join')}"
    '<sequenceFlow id="Out" sourceRef="Leave" targetRef="E">'
    "<conditionExpression>1 &gt; 2</conditionExpression></sequenceFlow></process>"
)


class StallingJournal(MemoryJournal):
    """A journal in memory whose commits wait while it is `stalled`."""

    def __init__(self) -> None:
        super().__init__()
        self.works = asyncio.Event()
        self.works.set()
        self.waiting = asyncio.Event()

    def stall(self) -> None:
        self.works.clear()

    async def append(self, entries: Sequence[Entry]) -> None:
        if not self.works.is_set():
            self.waiting.set()
            await self.works.wait()
        await super().append(entries)


async def alerts(world: World, code: str) -> Alert:
    async for notice in world.executive.control.subscribe():
        if isinstance(notice, Alert) and notice.code == code:
            return notice
    raise AssertionError("the executive ended")


def test_stop_reaches_the_vehicle_while_a_commit_is_stalled(play):
    journal = StallingJournal()

    async def story(world: World):
        control = world.executive.control
        run = await control.start(DRIVE_TWICE)
        await world.fake.until_called("start")
        journal.stall()
        world.fake.report(f"{run}.b1", BehaviorState.ACCEPTED)
        await journal.waiting.wait()
        with pytest.raises(OperatorError, match="the journal does not write"):
            await control.stop(run, by="anna")
        assert world.fake.count("cancel", f"{run}.b1") == 1
        journal.works.set()
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        summary = await control.wait(run)
        return summary.status, world.fake.count("cancel"), world.fake.count("start")

    assert play(story, "ugv1", journal=journal) == (RunStatus.STOPPED, 1, 1)


def test_what_was_requested_in_a_stalled_commit_does_not_start_after_a_stop(play):
    journal = StallingJournal()

    async def story(world: World):
        control = world.executive.control
        run = await control.start(DRIVE_TWICE)
        await world.fake.until_called("start")
        journal.stall()
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        await journal.waiting.wait()
        with pytest.raises(OperatorError):
            await control.stop(run)
        journal.works.set()
        await control.wait(run)
        requested = [each for each in world.seen if isinstance(each, BehaviorRequested)]
        return len(requested), world.fake.count("start")

    assert play(story, "ugv1", journal=journal) == (2, 1)


def test_pause_holds_the_vehicle_while_a_commit_is_stalled_and_resume_lets_it_go_once(play):
    journal = StallingJournal()

    async def story(world: World):
        control = world.executive.control
        run = await control.start(DRIVE)
        await world.fake.until_called("start")
        journal.stall()
        world.fake.report(f"{run}.b1", BehaviorState.ACCEPTED)
        await journal.waiting.wait()
        with pytest.raises(OperatorError, match="the journal does not write"):
            await control.pause(run)
        assert world.fake.count("hold", "ugv1") == 1
        journal.works.set()
        await control.resume(run)
        await world.fake.until_called("resume", "ugv1")
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        await control.wait(run)
        return [call.what for call in world.fake.calls]

    assert play(story, "ugv1", journal=journal) == ["start", "hold", "resume"]


def test_a_vehicle_stays_held_when_a_pause_follows_a_resume_in_one_commit(play):
    journal = StallingJournal()

    async def story(world: World):
        control = world.executive.control
        run = await control.start(DRIVE)
        await world.fake.until_called("start")
        await control.pause(run)
        await world.fake.until_called("hold", "ugv1")
        journal.stall()
        world.fake.report(f"{run}.b1", BehaviorState.ACCEPTED)
        await journal.waiting.wait()
        going_on = asyncio.ensure_future(control.resume(run))
        await asyncio.sleep(0)
        pausing = asyncio.ensure_future(control.pause(run))
        await world.fake.until_called("hold", "ugv1", times=2)
        journal.works.set()
        await asyncio.gather(going_on, pausing)
        await control.stop(run)
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        await control.wait(run)
        return [call.what for call in world.fake.calls]

    assert play(story, "ugv1", journal=journal) == ["start", "hold", "hold", "cancel"]


def test_a_pause_that_comes_too_late_lets_its_vehicles_go_again(play):
    journal = StallingJournal()

    async def story(world: World):
        control = world.executive.control
        run = await control.start(
            mission(
                sequence(
                    ("Drive", behavior("Drive", "drive_stop", "ugv1")),
                    ("Ask", question("Ask")),
                )
            )
        )
        await world.fake.until_called("start")
        journal.stall()
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        await journal.waiting.wait()
        pausing = asyncio.ensure_future(control.pause(run))
        await world.fake.until_called("hold", "ugv1")
        journal.works.set()
        await pausing
        await world.fake.until_called("resume", "ugv1")
        await control.stop(run)
        await control.wait(run)

    play(story, "ugv1", journal=journal)


def test_a_start_that_hangs_is_abandoned_and_the_vehicle_cancelled_and_held(play):
    async def story(world: World):
        control = world.executive.control
        alert = asyncio.ensure_future(alerts(world, "NOT_RECEIVED"))
        world.fake.hangs = {"start"}
        run = await control.start(DRIVE)
        await world.fake.until_called("start")
        await control.stop(run)
        await world.fake.until_called("cancel")
        await world.fake.until_called("hold", "ugv1")
        said = await alert
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        await control.wait(run)
        return said

    said = play(story, "ugv1")
    assert said.run == "r1"
    assert "ugv1 may not have received the STOP" in said.text
    assert "abandoned" in said.text


def test_what_an_arbiter_says_of_a_vehicle_that_does_not_obey_is_in_the_alert(
    play, monkeypatch: pytest.MonkeyPatch
):
    async def cancel(behavior: str, epoch: int) -> None:
        raise OperatorError("ugv1 does NOT obey: no state shows it")

    async def story(world: World):
        control = world.executive.control
        alert = asyncio.ensure_future(alerts(world, "NOT_RECEIVED"))
        run = await control.start(DRIVE)
        await world.fake.until_called("start")
        monkeypatch.setattr(world.fake, "cancel", cancel)
        await control.stop(run)
        said = await alert
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        await control.wait(run)
        return said.text

    said = "ugv1 may not have received the STOP of r1: ugv1 does NOT obey: no state shows it. "
    assert play(story, "ugv1") == f"{said}Use its own stop"


def test_an_arbiter_that_does_not_take_a_stop_is_named_and_delays_no_other_vehicle(play):
    both = mission(
        '<process id="P" isExecutable="true"><startEvent id="S"/><parallelGateway id="F"/>'
        f"{behavior('A', 'drive_stop', 'ugv1')}{behavior('B', 'drive_stop', 'ugv2')}"
        f"{flow('S', 'F')}{flow('F', 'A')}{flow('F', 'B')}</process>"
    )

    async def story(world: World):
        control = world.executive.control
        alert = asyncio.ensure_future(alerts(world, "NOT_RECEIVED"))
        run = await control.start(both)
        await world.fake.until_called("start", times=2)
        world.fake.hangs = {"cancel"}
        await control.stop(run)
        assert world.fake.count("cancel") == 2
        said = await alert
        for number in (1, 2):
            world.fake.report(f"{run}.b{number}", BehaviorState.CANCELLED)
        await control.wait(run)
        return said.text

    assert "has not taken it within 1 s" in play(story, "ugv1", "ugv2")


def test_a_vehicle_that_does_not_end_what_it_did_after_a_stop_is_named(play):
    async def story(world: World):
        control = world.executive.control
        alert = asyncio.ensure_future(alerts(world, "NOT_RECEIVED"))
        run = await control.start(DRIVE)
        await world.fake.until_called("start")
        await control.stop(run)
        return (await alert).text

    text = play(story, "ugv1")
    assert text.startswith("ugv1 may not have received the STOP of r1: did not end within ")


def test_a_mission_that_never_waits_is_paused_and_says_why_and_can_be_stopped(play):
    async def story(world: World):
        control = world.executive.control
        world.executive.fleet = replace(world.executive.fleet, steps_between_waits=2000)
        alert = asyncio.ensure_future(alerts(world, "NEVER_WAITS"))
        run = await control.start(LOOP)
        said = await alert
        await world.fake.until_called("hold", "ugv1")
        await control.stop(run)
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        await control.wait(run)
        return said.text, [each.by for each in world.seen if isinstance(each, RunPaused)]

    text, paused = play(story, "ugv1")
    assert "did not wait once" in text
    assert len(paused) == 1
    assert "did not wait once" in paused[0]


def test_stop_reaches_a_mission_that_never_waits_before_its_bound(play):
    async def story(world: World):
        control = world.executive.control
        run = await control.start(LOOP)
        await world.fake.until_called("start")
        await control.stop(run)
        assert world.fake.count("cancel") == 1
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        await control.wait(run)
        return any(isinstance(each, RunPaused) for each in world.seen)

    assert play(story, "ugv1") is False


def test_stop_all_stops_every_run_and_names_them(play):
    async def story(world: World):
        control = world.executive.control
        runs = [await control.start(DRIVE, even_if_busy=True) for _ in range(2)]
        other = mission(sequence(("Drive", behavior("Drive", "drive_stop", "ugv2"))))
        runs.append(await control.start(other))
        await world.fake.until_called("start", times=2)
        stopped = await control.stop_all(by="anna", reason="rain")
        assert world.fake.count("cancel") == 2
        for call in list(world.fake.calls):
            if call.what == "cancel":
                world.fake.report(call.subject, BehaviorState.CANCELLED)
        for run in stopped:
            await control.wait(run)
        return list(stopped)

    assert play(story, "ugv1", "ugv2") == ["r1", "r3"]


# --- what shares the event loop ---------------------------------------------------------------


async def test_an_observer_that_hangs_delays_nobody_and_is_waited_for_within_a_bound(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("m2pem.executive.control_events.DRAINED_WITHIN_S", 0.05)
    goes_on, seen = threading.Event(), []

    def observe(run: str, records: Sequence[object]) -> None:
        goes_on.wait(30)
        seen.append(run)

    notices = ControlEvents()
    told = notices.subscribe(None, 10)
    observers = RecordObservers(observe, notices)
    observers.start()
    for number in range(MAX_WAITING + 2):
        observers.put(f"r{number}", [])
    alert = await anext(told)
    assert isinstance(alert, Alert)
    assert alert.code == "OBSERVERS_BEHIND"
    assert seen == []
    await observers.close()
    goes_on.set()


async def test_what_blocks_the_event_loop_is_named(caplog: pytest.LogCaptureFixture) -> None:
    notices, health = ControlEvents(), ExecutiveHealth(MemoryJournal())
    told = notices.subscribe(None, 10)
    found = threading.Event()
    caplog.set_level("ERROR")

    def look() -> None:
        while not any("blocks the executive" in each.message for each in caplog.records):
            found.wait(0.01)
        found.set()

    async with LoopMonitor(notices, health):
        threading.Thread(target=look, daemon=True).start()
        assert found.wait(30)  # this blocks the loop, until the monitor has said so
        alert = await anext(told)
    assert isinstance(alert, Alert)
    assert alert.code == "BLOCKED"
    assert "test_what_blocks_the_event_loop_is_named" in alert.text
    assert (await health.checks())[-1].message == alert.text


async def test_what_runs_the_event_loop_is_not_named_for_what_blocks_it() -> None:
    named: asyncio.Future[str] = asyncio.get_running_loop().create_future()

    def read_a_mission() -> None:
        named.set_result(blocking(inspect.currentframe()))

    # As if it were in a module of m2pem: around it are asyncio, and pytest that runs the loop.
    known = {"__name__": "m2pem.reading", "blocking": blocking, "inspect": inspect}
    code, closure = read_a_mission.__code__, read_a_mission.__closure__
    asyncio.get_running_loop().call_soon(types.FunctionType(code, known, closure=closure))
    assert (await named).startswith("m2pem.reading, read_a_mission, line ")


async def test_an_alert_says_how_long_the_loop_was_blocked_though_it_has_turned_since(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    noticed, turned = threading.Event(), threading.Event()

    def named_late(_: types.FrameType | None) -> str:
        noticed.set()
        assert turned.wait(30)
        return "a plugin"

    monkeypatch.setattr(process_monitors, "blocking", named_late)
    notices, health = ControlEvents(), ExecutiveHealth(MemoryJournal())
    alerts = notices.subscribe(None, 10)
    async with LoopMonitor(notices, health):
        assert noticed.wait(30)  # this blocks the loop, until the monitor has noticed it
        await asyncio.sleep(TICK_S / 2)  # the monitor's own timer was due before
        turned.set()
        alert = await anext(alerts)
    assert isinstance(alert, Alert)
    said = re.match(r"nothing was done for (\d+\.\d) s, .* a plugin blocked", alert.text)
    assert said is not None
    assert float(said[1]) >= LATE_AFTER_S
