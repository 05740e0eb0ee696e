"""The schedule in virtual time: what starts when, what it waits for, and what is missed."""

import asyncio
import time

import msgspec
import pytest

from m2pem.api.clock import SystemClock, run_virtual
from m2pem.api.schedule import Concurrency, Missed, ScheduledStatus, Settlement
from m2pem.api.telemetry import LinkState
from m2pem.engine.inputs import StartRun
from m2pem.engine.records import RunStarted
from m2pem.errors import BusyError, MissionError, OperatorError, ScheduleError
from m2pem.fleet.fleet import dump
from m2pem.journal import Entry, MemoryJournal, RunHeader
from m2pem.mission.catalogue import BehaviorState
from m2pem.scheduling.entry import Hold

from .conftest import START_US, behavior, mission, question, sequence
from .schedule_world import at, attended_fleet, drive, serving, unattended_fleet

ASK = mission(sequence(("Ask", question("Ask"))))


def play(story, *vehicles, fleet=None, journal=None):
    """Run `story(world)` with an executive that serves a schedule, in virtual time."""

    async def main(clock):
        kept = journal or MemoryJournal()
        async with serving(
            clock, kept, fleet or unattended_fleet(*(vehicles or ("ugv1",)))
        ) as world:
            return await story(world)

    return run_virtual(main, START_US)


# --- times ----------------------------------------------------------------------------------------


def test_a_mission_starts_at_its_time_and_the_run_says_by_which_entry():
    async def story(world):
        number = await world.schedule(drive("ugv1"), at=at(60))
        before = await world.entry(number)
        await world.end("r1")
        records = await world.executive.control.records("r1")
        return number, before, await world.begun(), await world.entry(number), records[0].record

    number, before, begun, after, started = play(story)
    assert (number, before.status) == ("s1", ScheduledStatus.SCHEDULED)
    assert before.next_us == START_US + 60_000_000
    assert begun == {"r1": 60.0}
    assert (after.status, after.run) == (ScheduledStatus.ENDED, "r1")
    assert [each.settlement for each in after.times] == [Settlement.STARTED]
    assert started.by == "s1, scheduled by ada"


def test_cron_starts_again_and_again_until_its_end():
    async def story(world):
        await world.schedule(drive("ugv1"), cron="*/10 * * * *", time_zone="UTC", until=at(1900))
        for run in ("r1", "r2", "r3"):
            await world.end(run)
        await world.at(3000)
        return await world.begun(), await world.entry("s1")

    begun, entry = play(story)
    assert begun == {"r1": 600.0, "r2": 1200.0, "r3": 1800.0}
    assert entry.status is ScheduledStatus.ENDED


def test_operators_are_warned_before_a_start_and_can_cancel_it():
    async def story(world):
        await world.schedule(drive("ugv1"), at=at(60))
        await world.at(55)
        warned = await world.entry("s1")
        await world.executive.control.unschedule("s1", by="bob")
        await world.at(100)
        return warned, await world.begun(), await world.entry("s1"), world.alerts

    warned, begun, entry, alerts = play(story, fleet=unattended_fleet("ugv1", warning_s=10))
    assert (warned.status, warned.starts_us) == (ScheduledStatus.STARTING, START_US + 60_000_000)
    assert begun == {}
    assert (entry.status, entry.reason) == (ScheduledStatus.CANCELLED, "cancelled by bob")
    assert (50.0, alerts[1][1][:23]) == (alerts[1][0], "mission starts in 10 s ")
    assert "cancelled by bob" in alerts[-1][1]


def test_what_is_free_at_once_starts_after_the_warning():
    async def story(world):
        await world.schedule(drive("ugv1"))
        await world.end("r1")
        return await world.begun()

    assert play(story, fleet=unattended_fleet("ugv1", warning_s=10)) == {
        "r1": pytest.approx(10, abs=1e-3)
    }


# --- now ------------------------------------------------------------------------------------------


def test_an_operator_starts_an_entry_now_in_place_of_its_only_time():
    async def story(world):
        await world.schedule(drive("ugv1"), at=at(600), condition="vehicle.battery < 0.1")
        run = await world.executive.control.start_scheduled("s1", by="bob")
        records = await world.executive.control.records(run)
        return await world.begun(), await world.entry("s1"), records[0].record.by

    begun, entry, by = play(story, fleet=unattended_fleet("ugv1", warning_s=10))
    assert begun == {"r1": pytest.approx(0, abs=1e-3)}
    assert (entry.status, entry.run) == (ScheduledStatus.ENDED, "r1")
    (settled,) = entry.times
    assert (settled.settlement, settled.run) == (Settlement.STARTED, "r1")
    assert settled.due_us == START_US + 600_000_000
    assert by == "s1, started by bob"


def test_a_start_now_leaves_the_times_of_cron_that_are_to_come():
    async def story(world):
        await world.schedule(drive("ugv1"), cron="*/10 * * * *", time_zone="UTC")
        await world.at(100)
        await world.executive.control.start_scheduled("s1", by="bob")
        with pytest.raises(OperatorError, match="s1 is not started: its run r1 goes on"):
            await world.executive.control.start_scheduled("s1", by="bob")
        await world.end("r1")
        await world.end("r2")
        return await world.begun(), (await world.entry("s1")).times

    begun, settled = play(story)
    assert begun == {"r1": 100.0, "r2": 600.0}
    assert [each.run for each in settled] == ["r1", "r2"]


def test_a_start_now_stands_for_the_time_that_waits_and_those_before_are_missed():
    async def story(world):
        busy = await world.executive.control.start(drive("ugv1"))
        wanted = {"cron": "*/1 * * * *", "time_zone": "UTC", "condition": "vehicle.battery < 0.1"}
        await world.schedule(drive("ugv1"), **wanted)
        await world.at(130)
        with pytest.raises(BusyError, match="ugv1"):
            await world.executive.control.start_scheduled("s1")
        await world.end(busy)
        await world.executive.control.start_scheduled("s1")
        await world.end("r2")
        return (await world.entry("s1")).times

    settled = play(story)
    assert [(each.settlement, each.due_us - START_US, each.run) for each in settled] == [
        (Settlement.MISSED, 60_000_000, ""),
        (Settlement.STARTED, 120_000_000, "r2"),
    ]


def test_what_is_held_over_or_refused_by_check_is_not_started_now():
    async def story(world):
        control = world.executive.control
        await world.schedule(drive("ugv1"), at=at(600))
        await control.hold_schedule("s1", by="bob", reason="rain")
        with pytest.raises(OperatorError, match="not started: held by bob: rain; release it first"):
            await control.start_scheduled("s1")
        await control.release_schedule("s1")
        await control.hold_schedule(by="bob")
        with pytest.raises(OperatorError, match="the schedule is held by bob"):
            await control.start_scheduled("s1")
        await control.release_schedule()
        await control.unschedule("s1", by="ada")
        with pytest.raises(OperatorError, match="s1 is cancelled"):
            await control.start_scheduled("s1")
        with pytest.raises(OperatorError, match="no entry 's9'"):
            await control.start_scheduled("s9")
        return await world.begun()

    assert play(story) == {}


def test_stop_of_all_comes_before_a_start_now_that_is_under_way():
    async def story(world):
        control = world.executive.control
        await world.schedule(drive("ugv1"), at=at(600))
        create = world.journal.create
        creating = asyncio.Event()

        async def slow(*args):
            run = await create(*args)
            creating.set()
            await world.clock.sleep(1.0)
            return run

        world.journal.create = slow
        starting = asyncio.create_task(control.start_scheduled("s1"))
        await creating.wait()
        await control.stop_all(by="bob")
        with pytest.raises(OperatorError, match="s1 is not started"):
            await starting
        entry = await world.entry("s1")
        return await world.begun(), entry.next_us, entry.times

    assert play(story) == ({}, START_US + 600_000_000, ())


# --- the queue ------------------------------------------------------------------------------------


def test_two_entries_for_one_rover_run_one_after_the_other_by_priority():
    async def story(world):
        control = world.executive.control
        first = await control.start(drive("ugv1"))
        await world.schedule(drive("ugv1"), priority=0)
        await world.schedule(drive("ugv1"), priority=5)
        await world.schedule(drive("ugv1"), priority=5)
        await world.at(10)
        reasons = [(await world.entry(number)).reason for number in ("s1", "s2", "s3")]
        await world.end(first)
        for run in ("r2", "r3", "r4"):
            await world.end(run)
        by = [(await world.entry(number)).run for number in ("s1", "s2", "s3")]
        return reasons, by

    reasons, by = play(story)
    assert reasons == ["for ugv1: r1 uses it"] * 3
    assert by == ["r4", "r2", "r3"]


def test_a_rover_between_two_tasks_of_a_mission_is_not_free():
    async def story(world):
        control = world.executive.control
        two = sequence(
            ("Ask", question("Ask")),
            ("Go", behavior("Go", "drive_stop", "ugv1")),
        )
        await control.start(mission(two))
        await world.schedule(drive("ugv1"))
        await world.at(100)
        return (await world.entry("s1")).reason, await world.begun()

    reason, begun = play(story)
    assert reason == "for ugv1: r1 uses it"
    assert list(begun) == ["r1"]


def test_who_waits_for_two_rovers_is_not_overtaken_for_one_of_them():
    async def story(world):
        control = world.executive.control
        await control.start(drive("ugv1"))
        await world.schedule(drive("ugv1", "ugv2"), priority=1)
        await world.schedule(drive("ugv2"))
        await world.at(10)
        reason = (await world.entry("s2")).reason
        await world.end("r1")
        await world.fake.until_called("start", "r2.b1")
        return reason, (await world.entry("s1")).run

    assert play(story, "ugv1", "ugv2") == ("for ugv2: s1 is before it", "r2")


def test_resources_that_stay_busy_until_the_deadline_are_missed_and_said():
    async def story(world):
        await world.executive.control.start(drive("ugv1"))
        await world.schedule(drive("ugv1"), at=at(60), starting_deadline_s=30)
        await world.at(200)
        return await world.entry("s1"), world.told()

    entry, told = play(story)
    assert (entry.status, entry.reason) == (ScheduledStatus.ENDED, "for ugv1: r1 uses it")
    assert [each.settlement for each in entry.times] == [Settlement.MISSED]
    assert told[-1] == (
        "s1 missed the start at 2026-01-01T00:01:00+00:00 of mission: for ugv1: r1 uses it"
    )


def test_a_missed_time_runs_once_where_that_is_asked():
    async def story(world):
        await world.executive.control.start(drive("ugv1"))
        await world.schedule(
            drive("ugv1"), at=at(60), starting_deadline_s=30, missed=Missed.RUN_ONCE
        )
        await world.at(200)
        waiting = await world.entry("s1")
        await world.end("r1")
        await world.end("r2")
        return waiting, await world.begun(), await world.entry("s1")

    waiting, begun, entry = play(story)
    assert waiting.status is ScheduledStatus.WAITING
    assert begun["r2"] >= 200.0
    assert [each.settlement for each in entry.times] == [Settlement.MISSED, Settlement.STARTED]
    assert entry.status is ScheduledStatus.ENDED


def test_a_vehicle_that_an_operator_has_or_whose_link_is_lost_is_waited_for():
    async def story(world):
        control = world.executive.control
        await control.take("ugv1", by="bob")
        await world.schedule(drive("ugv1"))
        await world.at(5)
        taken = (await world.entry("s1")).reason
        await control.give_back("ugv1", by="bob")
        world.say("ugv1", link=LinkState.LOST)
        await world.at(10)
        return taken, await world.entry("s1")

    async def unheard(world):
        await world.schedule(drive("ugv1"))
        await world.at(5)
        reason = (await world.entry("s1")).reason
        world.say("ugv1")
        await world.end("r1")
        return reason

    async def main(clock):
        of = unattended_fleet("ugv1")
        async with serving(clock, MemoryJournal(), of, heard=False) as world:
            return await unheard(world)

    taken, entry = play(story)
    assert taken == "for ugv1: bob has it"
    assert entry.status in (ScheduledStatus.ENDED, ScheduledStatus.WAITING)
    assert run_virtual(main, START_US) == "for ugv1: nothing was received from it yet"


# --- after a run, and on a condition --------------------------------------------------------------


def test_a_mission_starts_after_a_run_that_has_completed():
    async def story(world):
        await world.executive.control.start(drive("ugv1"))
        await world.schedule(drive("ugv2"), after="r1")
        await world.at(30)
        before = (await world.entry("s1")).reason
        await world.end("r1")
        await world.end("r2")
        return before, (await world.entry("s1")).run

    assert play(story, "ugv1", "ugv2") == ("after r1, which has not ended", "r2")


def test_a_run_that_ends_otherwise_than_wanted_is_said_and_starts_nothing():
    async def story(world):
        control = world.executive.control
        await control.start(drive("ugv1"))
        await world.schedule(drive("ugv2"), after="r1")
        await world.schedule(drive("ugv2"), after="s1")
        await world.schedule(drive("ugv2"), after="r1", outcomes=("stopped", "failed"))
        await world.fake.until_called("start", "r1.b1")
        world.fake.report("r1.b1", BehaviorState.FAILED, "X")
        await world.end("r2")
        await world.at(20)
        return [await world.entry(number) for number in ("s1", "s2", "s3")]

    first, second, third = play(story, "ugv1", "ugv2")
    assert (first.status, first.reason) == (ScheduledStatus.ENDED, "r1 has ended: failed")
    assert second.reason == "s1 has started nothing: r1 has ended: failed"
    assert third.run == "r2"


def test_a_condition_of_telemetry_has_to_hold_for_its_time():
    async def story(world):
        world.say("ugv1", battery=0.5)
        await world.schedule(drive("ugv1"), condition="vehicle.battery > 0.9", held_for_s=30)
        await world.at(10)
        low = (await world.entry("s1")).reason
        world.say("ugv1", battery=0.95)
        await world.at(20)
        world.say("ugv1", battery=0.85)
        await world.at(25)
        world.say("ugv1", battery=0.95)
        await world.end("r1")
        return low, await world.begun()

    low, begun = play(story)
    assert low == "vehicle.battery > 0.9 does not hold of ugv1: vehicle.battery is 0.5"
    assert 55 <= begun["r1"] <= 56


def test_a_condition_of_a_vehicle_whose_link_is_lost_does_not_hold():
    async def story(world):
        world.say("ugv2", battery=0.95, link=LinkState.LOST)
        await world.schedule(drive("ugv1"), condition="vehicle.battery > 0.9", vehicles=("ugv2",))
        await world.at(10)
        return (await world.entry("s1")).reason

    reason = play(story, "ugv1", "ugv2")
    assert reason == "vehicle.battery > 0.9 does not hold of ugv2: its link is lost"


# --- concurrency ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("policy", "starts"), [(Concurrency.FORBID, 1), (Concurrency.ALLOW, 3)])
def test_a_run_that_goes_on_keeps_the_next_time_from_its_start(policy, starts):
    async def story(world):
        await world.schedule(
            ASK, cron="* * * * *", time_zone="UTC", concurrency=policy, starting_deadline_s=30
        )
        await world.at(215)
        return await world.begun(), await world.entry("s1")

    begun, entry = play(story)
    assert len(begun) == starts
    missed = [each.text for each in entry.times if each.settlement is Settlement.MISSED]
    assert missed == ([] if starts > 1 else ["its run r1 goes on"] * 2)


# --- operators ------------------------------------------------------------------------------------


def test_a_held_entry_starts_nothing_until_it_is_released():
    async def story(world):
        control = world.executive.control
        await world.schedule(drive("ugv1"), at=at(60))
        await control.hold_schedule("s1", by="bob", reason="people on the road")
        await world.at(120)
        held = await world.entry("s1")
        await control.release_schedule("s1", by="bob")
        await world.end("r1")
        return held, await world.begun()

    held, begun = play(story)
    assert (held.status, held.reason) == (
        ScheduledStatus.HELD,
        "held by bob: people on the road",
    )
    assert begun == {"r1": pytest.approx(120, abs=0.01)}


def test_a_release_of_one_entry_does_not_delay_the_start_of_another():
    async def story(world):
        await world.schedule(drive("ugv1"), at=at(60))
        await world.schedule(drive("ugv2"), at=at(100))
        await world.executive.control.hold_schedule("s1", by="bob", reason="rain")
        await world.at(95)
        assert (await world.entry("s2")).status is ScheduledStatus.STARTING
        await world.executive.control.release_schedule("s1", by="bob")
        released = await world.entry("s1")
        await world.end("r1")
        await world.end("r2")
        return released, await world.begun()

    released, begun = play(story, fleet=unattended_fleet("ugv1", "ugv2", warning_s=10))
    assert (released.status, released.reason) == (ScheduledStatus.WAITING, "")
    assert list(begun.values()) == [pytest.approx(100, abs=0.01), pytest.approx(105, abs=0.01)]


def test_stop_of_all_holds_the_schedule_also_after_a_restart():
    journal = MemoryJournal()

    async def main(clock):
        of = unattended_fleet("ugv1", "ugv2")
        async with serving(clock, journal, of) as world:
            await world.executive.control.start(drive("ugv1"))
            await world.schedule(drive("ugv2"), at=at(60), missed=Missed.RUN_ONCE)
            await world.executive.control.stop_all(by="bob", reason="smoke")
            await world.at(100)
            assert list(await world.begun()) == ["r1"]
            said = world.told()
        async with serving(clock, journal, of) as world:
            await world.at(200)
            found = await world.executive.control.scheduled()
            assert list(await world.begun()) == ["r1"]
            await world.executive.control.release_schedule(by="bob")
            await world.end("r2")
            return said, found

    said, found = run_virtual(main, START_US)
    assert "the schedule is held by bob: STOP of all: smoke" in said[-1]
    assert found.hold == "held by bob: STOP of all: smoke"


def test_what_another_executive_on_the_journal_holds_is_not_started():
    async def story(world):
        await world.schedule(drive("ugv1"), at=at(60))
        await world.journal.hold_schedule("test", Hold("bob", "rain"))
        await world.at(100)
        held = await world.begun(), await world.executive.control.scheduled()
        await world.executive.control.release_schedule(by="ada")
        await world.end("r1")
        return held, await world.begun(), world.told()

    (begun, schedule), after, told = play(story)
    assert (begun, schedule.hold) == ({}, "held by bob: rain")
    assert schedule.entries[0].reason == "the schedule is held by bob: rain"
    assert list(after) == ["r1"]
    assert "the schedule is held by bob: rain; nothing starts until it is released" in told


def test_a_hold_that_comes_as_a_run_is_created_keeps_it_from_that():
    async def story(world):
        await world.schedule(drive("ugv1"), at=at(60))
        create = world.journal.create

        async def held_first(*args):
            await world.journal.hold_schedule("test", Hold("bob", "rain"))
            return await create(*args)

        world.journal.create = held_first
        await world.at(100)
        return await world.begun(), (await world.entry("s1")).reason

    assert play(story) == ({}, "the schedule is held by bob: rain")


def test_stop_of_all_comes_before_a_start_that_is_under_way():
    async def story(world):
        control = world.executive.control
        await world.schedule(drive("ugv1"), at=at(60))
        creating = asyncio.Event()
        create = world.journal.create

        async def slow(*args):
            run = await create(*args)
            creating.set()
            await world.clock.sleep(1.0)
            return run

        world.journal.create = slow
        await creating.wait()
        await control.stop_all(by="bob")
        await world.at(100)
        held = await world.begun(), await world.entry("s1"), world.fake.count("start")
        world.journal.create = create
        await control.release_schedule(by="bob")
        await world.end("r2")
        return held, await world.begun()

    (begun, entry, starts), after = play(story)
    assert (begun, starts, entry.status) == ({}, 0, ScheduledStatus.HELD)
    assert list(after) == ["r2"]


def test_what_was_asked_for_before_stop_of_all_is_not_scheduled_after_it():
    async def story(world):
        control = world.executive.control
        asked = asyncio.create_task(world.schedule(drive("ugv1")))
        await asyncio.sleep(0)  # it reads and checks the mission in a thread
        await control.stop_all(by="bob")
        with pytest.raises(OperatorError, match="all was stopped or held meanwhile"):
            await asked
        return (await control.scheduled()).entries

    assert play(story) == ()


def test_a_stop_that_comes_during_a_release_holds_the_schedule():
    async def story(world):
        control, journal = world.executive.control, world.journal
        await world.schedule(drive("ugv1"), at=at(60))
        await control.hold_schedule(by="bob")
        write = journal.hold_schedule

        async def slow(*args):
            await write(*args)
            await world.clock.sleep(1.0)

        journal.hold_schedule = slow
        releasing = asyncio.create_task(control.release_schedule(by="ada"))
        await world.clock.sleep(0.5)
        await control.stop_all(by="bob")
        with pytest.raises(OperatorError, match="not released: the schedule is held by bob"):
            await releasing
        await world.at(100)
        return await world.begun(), await journal.schedule_hold("test")

    begun, hold = play(story)
    assert begun == {}
    assert str(hold) == "held by bob: STOP of all"


def test_a_stopped_or_failed_run_holds_the_entry_that_would_start_it_again():
    async def story(world):
        await world.schedule(drive("ugv1"), cron="* * * * *", time_zone="UTC")
        await world.fake.until_called("start", "r1.b1")
        await world.executive.control.stop("r1", by="bob")
        await world.at(130)
        stopped = await world.entry("s1")
        await world.executive.control.release_schedule("s1")
        await world.fake.until_called("start", "r2.b1")
        world.fake.report("r2.b1", BehaviorState.FAILED, "X")
        await world.at(300)
        return stopped, await world.entry("s1"), await world.begun()

    stopped, failed, begun = play(story)
    assert (stopped.status, stopped.reason) == (
        ScheduledStatus.HELD,
        "held by bob: its run r1 was stopped",
    )
    assert (failed.status, failed.reason) == (
        ScheduledStatus.HELD,
        "held: its run r2 has failed",
    )
    assert list(begun) == ["r1", "r2"]


# --- restarts -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("missed", "begins"),
    [(Missed.SKIP, {}), (Missed.RUN_ONCE, {"r1": pytest.approx(3660, abs=0.01)})],
)
def test_times_that_came_while_nothing_served_are_said_and_skipped_or_run_once(missed, begins):
    journal = MemoryJournal()

    async def main(clock):
        of = unattended_fleet("ugv1")
        async with serving(clock, journal, of) as world:
            await world.schedule(
                drive("ugv1"), cron="10,20,30 0,12 * * *", time_zone="UTC", missed=missed
            )
            await world.at(5)
        await clock.sleep_until(START_US + 3_660_000_000)
        async with serving(clock, journal, of) as world:
            if missed is Missed.RUN_ONCE:
                await world.end("r1")
            await world.at(3900)
            return world.told(), await world.begun(), await world.entry("s1")

    told, begun, entry = run_virtual(main, START_US)
    assert begun == begins
    assert entry.status is ScheduledStatus.SCHEDULED
    assert told[0] == (
        "s1 missed 3 starts, the last at 2026-01-01T00:30:00+00:00 of mission: "
        "it was not served at that time"
    ) + ("; it starts once as soon as it can" if missed is Missed.RUN_ONCE else "")


def test_a_vehicle_of_a_run_that_nobody_has_taken_up_is_waited_for():
    journal = MemoryJournal()

    async def main(clock):
        of, now_us = unattended_fleet("ugv1", "ugv2"), clock.now_us()
        left = RunHeader("left.bpmn", drive("ugv1"), "P", dump(of))
        run = await journal.create(left)
        begun = (RunStarted("P", now_us),)
        await journal.append([Entry(run, 1, 1, now_us, 0, StartRun("P", {}, "bob"), begun)])
        await journal.release(run)
        async with serving(clock, journal, of) as world:
            await world.schedule(drive("ugv1"))
            await world.schedule(drive("ugv2"))
            await world.end("r2")
            return await world.entry("s1"), await world.entry("s2")

    first, second = run_virtual(main, START_US)
    assert first.reason == (
        "r1 was interrupted and may still command ugv1: `m2pem resume r1` takes it up"
    )
    assert second.run == "r2"


def test_a_mission_that_does_not_fit_the_fleet_any_more_fails_with_its_findings():
    journal = MemoryJournal()

    async def main(clock):
        async with serving(clock, journal, unattended_fleet("ugv1")) as world:
            await world.schedule(drive("ugv1"), at=at(60))
            with pytest.raises(MissionError, match="ugv7"):
                await world.schedule(drive("ugv7"), at=at(60))
        async with serving(clock, journal, unattended_fleet("ugv2")) as world:
            await world.at(100)
            return await world.entry("s1"), await journal.runs(), world.told()

    entry, runs, told = run_virtual(main, START_US)
    assert entry.status is ScheduledStatus.FAILED
    assert "ugv1" in entry.reason
    assert runs == []
    assert told[-1].startswith("s1 failed, and starts nothing any more: mission.bpmn cannot run")


def test_real_vehicles_start_unattended_only_where_the_fleet_file_allows_it():
    async def story(world):
        with pytest.raises(ScheduleError, match=r"ugv1 of test.yaml would start with no operator"):
            await world.schedule(drive("ugv1"), at=at(60))

    play(story, fleet=attended_fleet("ugv1"))


def test_what_was_scheduled_in_a_simulation_starts_nothing_real():
    journal = MemoryJournal()

    async def main(clock):
        async with serving(clock, journal, unattended_fleet("ugv1")) as world:
            await world.schedule(drive("ugv1"), at=at(60))
        (entry,) = await journal.entries()
        simulated = MemoryJournal()
        await simulated.schedule(msgspec.structs.replace(entry.plan, simulated=True), entry.state)
        async with serving(clock, simulated, unattended_fleet("ugv1")) as world:
            await world.at(100)
            return await world.begun(), await world.executive.control.scheduled()

    begun, found = run_virtual(main, START_US)
    assert (begun, found.entries) == ({}, ())


def test_an_executive_that_serves_no_schedule_says_who_does(play):
    async def story(world):
        with pytest.raises(OperatorError, match="`m2pem serve` is one that does"):
            await world.executive.control.schedule(ASK)

    play(story, "ugv1")


async def test_a_clock_of_the_computer_that_was_set_is_said_once():
    behind = SystemClock(start_us=time.time_ns() // 1000 - 60_000_000)
    async with serving(behind, MemoryJournal(), unattended_fleet("ugv1")) as world:
        events = world.executive.control.subscribe()
        for _ in range(2):
            await world.schedule(drive("ugv1"), cron="0 8 * * *", time_zone="UTC")
        async for event in events:
            if "clock was set" in getattr(event, "text", ""):
                break
        await world.executive.control.hold_schedule("s1")
    said = [text for text in world.told() if "clock was set: it is 60 s from" in text]
    assert len(said) == 1
