"""The executive as a whole: runs on a fake arbiter, in virtual time."""

import asyncio

import pytest

from m2pem.api.clock import SystemClock
from m2pem.api.runs import OpenPrompt, RunStatus, StampedRecord
from m2pem.api.telemetry import VehicleState
from m2pem.engine.records import BehaviorEnded, ErrorThrown, RunEnded
from m2pem.errors import (
    BusyError,
    InternalError,
    JournalError,
    MissionError,
    OperatorError,
    PluginError,
)
from m2pem.executive.executive import Executive
from m2pem.journal.memory import MemoryJournal
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.testing.fake_arbiter import FakeArbiter

from .conftest import (
    FakePlugins,
    Fakes,
    World,
    behavior,
    fleet,
    flow,
    mission,
    question,
    sequence,
)

DRIVE = mission(sequence(("Drive", behavior("Drive", "drive_stop", "ugv1"))))

ASK = mission(sequence(("Ask", question("Ask"))))


def test_a_behavior_is_started_and_its_success_completes_the_mission(play):
    async def story(world: World):
        run = await world.executive.control.start(DRIVE)
        await world.fake.until_called("start")
        world.fake.report(f"{run}.b1", BehaviorState.ACCEPTED)
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        return await world.executive.control.wait(run)

    summary = play(story, "ugv1")
    assert summary.status is RunStatus.COMPLETED
    assert summary.run == "r1"


async def test_no_run_begins_before_the_vehicles_are_connected():
    journal = MemoryJournal()
    executive = Executive(fleet("ugv1"), journal, FakePlugins(Fakes(), []), SystemClock())
    for begun in (executive.control.start(DRIVE), executive.resume("r1")):
        with pytest.raises(OperatorError, match="not connected to its vehicles yet; try again"):
            await begun
    assert not await journal.runs()
    assert not executive.runners


def test_stop_cancels_the_behavior_once_and_waits_for_its_release(play):
    async def story(world: World):
        run = await world.executive.control.start(DRIVE)
        await world.fake.until_called("start")
        await world.executive.control.stop(run, by="operator")
        await world.fake.until_called("cancel")
        assert not world.executive.runner(run).done.is_set()
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        summary = await world.executive.control.wait(run)
        return summary, world.fake.count("cancel")

    summary, cancels = play(story, "ugv1")
    assert summary.status is RunStatus.STOPPED
    assert cancels == 1


def test_a_cancel_that_is_not_answered_is_given_up_after_the_arbiters_limit(play):
    async def story(world: World):
        run = await world.executive.control.start(DRIVE)
        await world.fake.until_called("start")
        before = world.clock.now_us()
        await world.executive.control.stop(run)
        await world.executive.control.wait(run)
        ended = [record for record in world.seen if isinstance(record, BehaviorEnded)]
        return world.clock.now_us() - before, ended[0]

    took_us, ended = play(story, "ugv1")
    assert took_us == 10_000_000
    assert (ended.state, ended.code) == (BehaviorState.LOST, "TIMEOUT")


def test_pause_holds_and_resume_resumes_each_commanded_resource_once(play):
    async def story(world: World):
        control = world.executive.control
        run = await control.start(DRIVE)
        await world.fake.until_called("start")
        await control.pause(run)
        await world.fake.until_called("hold", "ugv1")
        with pytest.raises(OperatorError, match="paused"):
            await control.pause(run)
        await control.resume(run)
        await world.fake.until_called("resume", "ugv1")
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        await control.wait(run)
        return [(call.what, call.subject) for call in world.fake.calls]

    assert play(story, "ugv1") == [("start", "r1.b1"), ("hold", "ugv1"), ("resume", "ugv1")]


def test_a_resume_is_done_though_something_that_came_during_the_pause_is_ignored(play):
    async def story(world: World):
        control = world.executive.control
        run = await control.start(DRIVE)
        await world.fake.until_called("start")
        await control.pause(run)
        await control.message("nobody-receives-it", run=run)
        await control.resume(run)
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        await control.wait(run)
        return world.names()

    names = play(story, "ugv1")
    assert [n for n in names if n in ("RunResumed", "InputIgnored")] == [
        "RunResumed",
        "InputIgnored",
    ]


def test_nothing_is_started_while_paused(play):
    two = mission(
        sequence(
            ("A", behavior("A", "drive_stop", "ugv1")), ("B", behavior("B", "drive_stop", "ugv1"))
        )
    )

    async def story(world: World):
        control = world.executive.control
        run = await control.start(two)
        await world.fake.until_called("start", "r1.b1")
        await control.pause(run)
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        await world.clock.sleep(5)
        assert world.fake.count("start") == 1
        await control.resume(run)
        await world.fake.until_called("start", "r1.b2")
        world.fake.report("r1.b2", BehaviorState.SUCCEEDED)
        return await control.wait(run)

    assert play(story, "ugv1").status is RunStatus.COMPLETED


def test_the_first_answer_wins_and_the_second_operator_is_told(play):
    async def story(world: World):
        control = world.executive.control
        run = await control.start(mission(sequence(("Ask", question("Ask")), ("B", question("B")))))
        async for notice in control.subscribe(run):
            if isinstance(notice, OpenPrompt):
                break
        await control.answer(run, "p1", "yes", by="anna")
        with pytest.raises(OperatorError, match="p1"):
            await control.answer(run, "p1", "no", by="ben")
        await control.answer(run, "p2", "yes", by="ben")
        await control.wait(run)
        with pytest.raises(OperatorError, match="has ended"):
            await control.answer(run, "p2", "no", by="ben")

    play(story)


def test_a_decision_that_the_prompt_does_not_have_is_refused_and_changes_nothing(play):
    async def story(world: World):
        control = world.executive.control
        run = await control.start(ASK)
        await world.clock.sleep(1)
        with pytest.raises(OperatorError, match="yes, no"):
            await control.answer(run, "p1", "maybe")
        assert [prompt.prompt for prompt in control.prompts()] == ["p1"]
        await control.answer(run, "p1", "no")
        return await control.wait(run)

    assert play(story).status is RunStatus.COMPLETED


def test_a_vehicle_is_never_given_to_two_runs_at_once(play):
    async def story(world: World):
        control = world.executive.control
        first = await control.start(DRIVE)
        await world.fake.until_called("start", "r1.b1")
        second = await control.start(DRIVE, even_if_busy=True)
        ended = await control.wait(second)
        assert world.fake.count("start") == 1
        world.fake.report(f"{first}.b1", BehaviorState.SUCCEEDED)
        await control.wait(first)
        errors = [record for record in world.seen if isinstance(record, ErrorThrown)]
        return ended, errors

    ended, errors = play(story, "ugv1")
    assert ended.status is RunStatus.FAILED
    assert errors[0].code == "RESOURCE_UNAVAILABLE"
    assert "r1.b1" in errors[0].reason


def test_an_arbiter_that_raises_ends_the_behavior_not_the_executive(play):
    async def story(world: World):
        control = world.executive.control
        world.fake.raises["start"] = RuntimeError("radio on fire")
        failed = await control.wait(await control.start(DRIVE))
        del world.fake.raises["start"]
        run = await control.start(DRIVE)
        await world.fake.until_called("start", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        return failed, await control.wait(run)

    failed, good = play(story, "ugv1")
    assert failed.status is RunStatus.FAILED
    assert "radio on fire" in failed.detail
    assert good.status is RunStatus.COMPLETED


def test_an_arbiter_that_hangs_is_given_up_after_its_bound(play):
    async def story(world: World):
        world.fake.hangs.add("start")
        run = await world.executive.control.start(DRIVE)
        return await world.executive.control.wait(run)

    assert "did not return" in play(story, "ugv1").detail


def test_a_mission_that_does_not_fit_the_fleet_is_refused_before_it_starts(play):
    async def story(world: World):
        with pytest.raises(MissionError, match="ugv1"):
            await world.executive.control.start(DRIVE)
        return await world.executive.control.runs()

    assert list(play(story, "other")) == []


def test_subscribers_get_every_record_in_order(play):
    async def story(world: World):
        control = world.executive.control
        stream = control.subscribe()
        run = await control.start(ASK)
        await world.clock.sleep(1)
        await control.answer(run, "p1", "yes")
        await control.wait(run)
        seqs = []
        async for notice in stream:
            if isinstance(notice, StampedRecord):
                seqs.append(notice.seq)
                if isinstance(notice.record, RunEnded):
                    return seqs

    seqs = play(story)
    assert seqs == list(range(1, len(seqs) + 1))


def test_a_subscriber_that_does_not_read_is_cut_off_and_told(play):
    async def story(world: World):
        control = world.executive.control
        stream = control.subscribe(size=5)
        await control.start(ASK)
        for _ in range(5):
            await anext(stream)
        with pytest.raises(OperatorError, match="5 events behind"):
            await anext(stream)

    play(story)


def test_leaving_the_executive_stops_what_still_runs(play):
    async def story(world: World):
        await world.executive.control.start(ASK)
        return world

    world = play(story)
    assert isinstance(world.seen[-1], RunEnded)
    assert world.seen[-1].outcome.value == "stopped"


def test_timers_fire_at_their_time(play):
    wait = mission(
        '<process id="P" isExecutable="true"><startEvent id="S"/>'
        '<intermediateCatchEvent id="T"><timerEventDefinition><timeDuration>PT90S</timeDuration>'
        '</timerEventDefinition></intermediateCatchEvent><endEvent id="E"/>'
        f"{flow('S', 'T')}{flow('T', 'E')}</process>"
    )

    async def story(world: World):
        before = world.clock.now_us()
        await world.executive.control.wait(await world.executive.control.start(wait))
        return world.clock.now_us() - before

    assert play(story) == 90_000_000


def test_a_pause_stops_durations(play):
    wait = mission(
        '<process id="P" isExecutable="true"><startEvent id="S"/>'
        '<intermediateCatchEvent id="T"><timerEventDefinition><timeDuration>PT10S</timeDuration>'
        '</timerEventDefinition></intermediateCatchEvent><endEvent id="E"/>'
        f"{flow('S', 'T')}{flow('T', 'E')}</process>"
    )

    async def story(world: World):
        control = world.executive.control
        before = world.clock.now_us()
        run = await control.start(wait)
        await world.clock.sleep(4)
        await control.pause(run)
        await world.clock.sleep(100)
        await control.resume(run)
        await control.wait(run)
        return world.clock.now_us() - before

    assert play(story) == 110_000_000


def test_a_start_is_refused_while_another_run_has_a_vehicle_of_the_mission(play):
    async def story(world: World):
        control = world.executive.control
        first = await control.start(DRIVE)
        await world.fake.until_called("start", f"{first}.b1")
        with pytest.raises(BusyError) as refused:
            await control.start(DRIVE)
        assert [each.run for each in await control.runs()] == [first]
        world.fake.report(f"{first}.b1", BehaviorState.SUCCEEDED)
        await control.wait(first)
        second = await control.start(DRIVE)
        await world.fake.until_called("start", f"{second}.b1")
        return refused.value

    refused = play(story, "ugv1")
    assert refused.holders == {"ugv1": "r1"}
    assert "run r1 uses ugv1" in str(refused)
    assert "wait until run r1 is done with ugv1, or stop it" in str(refused)


def test_of_two_starts_at_the_same_moment_for_one_vehicle_one_is_refused(play):
    async def story(world: World):
        control = world.executive.control
        both = control.start(DRIVE), control.start(DRIVE)
        return await asyncio.gather(*both, return_exceptions=True)

    kinds = [type(each) for each in play(story, "ugv1")]
    assert sorted(kinds, key=str) == sorted([str, BusyError], key=str)


def test_a_start_is_refused_while_a_vehicle_comes_to_a_stand_for_a_run_that_has_ended(play):
    cut = mission(
        '<process id="P" isExecutable="true"><startEvent id="S"/><parallelGateway id="Fork"/>'
        f'{behavior("Drive", "drive_stop", "ugv1")}<endEvent id="E"/>{question("Ask")}'
        '<endEvent id="Cut"><terminateEventDefinition/></endEvent>'
        f"{flow('S', 'Fork')}{flow('Fork', 'Drive')}{flow('Drive', 'E')}{flow('Fork', 'Ask')}"
        f"{flow('Ask', 'Cut')}</process>"
    )

    async def story(world: World):
        control = world.executive.control
        first = await control.start(cut)
        await world.fake.until_called("start", f"{first}.b1")
        await control.answer(first, "p1", "yes", by="anna")
        while "RunEnded" not in world.names():
            await world.clock.sleep(0.01)
        with pytest.raises(BusyError) as refused:
            await control.start(DRIVE)
        return str(refused.value)

    assert "wait until ugv1 has stopped: run r1 has ended" in play(story, "ugv1")


def test_a_start_is_refused_while_an_operator_has_a_vehicle_of_the_mission(play):
    async def story(world: World):
        control = world.executive.control
        await control.take("ugv1", by="anna")
        with pytest.raises(BusyError) as refused:
            await control.start(DRIVE)
        confirmed = await control.wait(await control.start(DRIVE, even_if_busy=True))
        await control.give_back("ugv1", by="anna")
        await control.start(DRIVE)
        return refused.value, confirmed

    refused, confirmed = play(story, "ugv1")
    assert refused.holders == {"ugv1": "anna"}
    assert "anna has ugv1. First have anna give back ugv1" in str(refused)
    assert confirmed.status is RunStatus.FAILED
    assert "RESOURCE_UNAVAILABLE" in confirmed.detail


def test_a_start_is_not_refused_for_vehicles_that_the_mission_does_not_name(play):
    async def story(world: World):
        control = world.executive.control
        await control.take("ugv2", by="anna")
        run = await control.start(DRIVE)
        await world.fake.until_called("start", f"{run}.b1")
        return run

    assert play(story, "ugv1", "ugv2") == "r1"


def test_a_silent_vehicle_loses_its_behavior_and_is_given_to_nobody_until_heard(play):
    async def story(world: World):
        control = world.executive.control
        run = await control.start(DRIVE)
        await world.fake.until_called("start", "r1.b1")
        lost = await control.wait(run)
        refused = await control.wait(await control.start(DRIVE))
        world.fake.say(VehicleState(ResourceId("ugv1"), world.clock.now_us()))
        await world.clock.sleep(0.1)
        again = await control.start(DRIVE)
        await world.fake.until_called("start", f"{again}.b1")
        return lost, refused

    lost, refused = play(story, "ugv1", watch_links=True)
    assert "LINK_LOST" in lost.detail
    assert "RESOURCE_UNAVAILABLE" in refused.detail


def test_a_low_battery_cancels_the_behavior_with_its_own_error(play):
    async def story(world: World):
        control = world.executive.control
        run = await control.start(DRIVE)
        await world.fake.until_called("start", "r1.b1")
        world.fake.say(VehicleState(ResourceId("ugv1"), world.clock.now_us(), battery_fraction=0.1))
        await world.fake.until_called("cancel", "r1.b1")
        world.fake.report("r1.b1", BehaviorState.CANCELLED)
        return await control.wait(run)

    assert "BATTERY_LOW" in play(story, "ugv1", watch_links=True).detail


def test_an_arbiter_that_cannot_connect_is_named(play, monkeypatch):
    async def refuse(self):
        raise OSError("port in use")

    monkeypatch.setattr(FakeArbiter, "connect", refuse)

    async def story(world: World):
        raise AssertionError

    with pytest.raises(PluginError, match=r"fake.*port in use"):
        play(story, "ugv1")


def test_a_bug_in_m2pem_holds_the_runs_vehicles_and_touches_no_other_run(play, monkeypatch):
    async def story(world: World):
        control = world.executive.control
        broken = await control.start(DRIVE)
        await world.fake.until_called("start", "r1.b1")
        other = await control.start(ASK)
        monkeypatch.setattr(
            world.executive.runner(broken).run, "receive", lambda *_: 1 / 0, raising=False
        )
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        await world.fake.until_called("hold", "ugv1")
        with pytest.raises(InternalError):
            await control.wait(broken)
        await control.answer(other, "p1", "yes")
        return await control.wait(other)

    assert play(story, "ugv1").status is RunStatus.COMPLETED


def test_a_journal_that_fails_holds_the_vehicles_and_starts_nothing(play, monkeypatch):
    async def story(world: World):
        control = world.executive.control
        run = await control.start(DRIVE)
        await world.fake.until_called("start", "r1.b1")

        async def full(entries):
            raise JournalError("the disk is full")

        monkeypatch.setattr(world.journal, "append", full)
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        await world.fake.until_called("hold", "ugv1")
        with pytest.raises(JournalError, match="disk is full"):
            await control.wait(run)

    play(story, "ugv1")


@pytest.mark.parametrize("all_runs", [True, False])
def test_a_stop_reaches_the_vehicles_that_a_failed_journal_has_left_held(
    play, monkeypatch, all_runs
):
    async def story(world: World):
        control = world.executive.control
        run = await control.start(DRIVE)
        await world.fake.until_called("start", "r1.b1")

        async def full(entries):
            raise JournalError("the disk is full")

        monkeypatch.setattr(world.journal, "append", full)
        with pytest.raises(OperatorError, match="was not recorded: the disk is full"):
            await control.pause(run)
        await world.fake.until_called("hold", "ugv1")
        assert world.fake.count("cancel") == 0
        stop = control.stop_all(by="anna") if all_runs else control.stop(run, by="anna")
        with pytest.raises(OperatorError) as refused:
            await stop
        await world.fake.until_called("cancel", "r1.b1")
        return str(refused.value)

    said = play(story, "ugv1")
    assert said == "r1: the stop went to its vehicles, but was not recorded: the disk is full"


def test_a_shutdown_leaves_held_what_a_failed_journal_has_left_held(play, monkeypatch):
    async def story(world: World):
        await world.executive.control.start(DRIVE)
        await world.fake.until_called("start", "r1.b1")

        async def full(entries):
            raise JournalError("the disk is full")

        monkeypatch.setattr(world.journal, "append", full)
        with pytest.raises(OperatorError):
            await world.executive.control.pause("r1")
        await world.executive.stop_all("SIGTERM")
        await world.clock.sleep(10)
        return world.fake.count("cancel")

    assert play(story, "ugv1") == 0


def test_an_operator_takes_a_vehicle_and_gives_it_back(play):
    async def story(world: World):
        control = world.executive.control
        first = await control.start(DRIVE)
        await world.fake.until_called("start", "r1.b1")
        assert (await control.holders())["ugv1"] == "r1.b1"
        await control.take("ugv1", by="anna")
        await world.fake.until_called("cancel", "r1.b1")
        world.fake.report("r1.b1", BehaviorState.CANCELLED)
        taken = await control.wait(first)
        assert await control.holders() == {"ugv1": "anna"}
        with pytest.raises(OperatorError, match="anna"):
            await control.take("ugv1", by="ben")
        refused = await control.wait(await control.start(DRIVE, even_if_busy=True))
        await control.give_back("ugv1", by="anna")
        again = await control.start(DRIVE)
        await world.fake.until_called("start", f"{again}.b1")
        world.fake.report(f"{again}.b1", BehaviorState.SUCCEEDED)
        return taken, refused, await control.wait(again)

    taken, refused, again = play(story, "ugv1")
    assert "TAKEN_OVER" in taken.detail
    assert "ugv1 is with anna" in refused.detail
    assert again.status is RunStatus.COMPLETED


def test_operators_see_what_taking_a_vehicle_does_before_they_take_it(play):
    async def story(world: World):
        control = world.executive.control
        await control.start(DRIVE)
        await world.fake.until_called("start", "r1.b1")
        before = await control.preview_take("ugv1")
        await control.take("ugv1", by="anna")
        return before, await control.preview_take("ugv1")

    before, after = play(story, "ugv1")
    assert [(each.run, each.behavior, each.caught_by) for each in before] == [("r1", "r1.b1", "")]
    assert str(before[0]).endswith("TAKEN_OVER is not handled: the mission will fail")
    assert after == []


def test_a_name_that_is_in_no_fleet_cannot_be_taken(play):
    async def story(world: World):
        with pytest.raises(OperatorError, match="did you mean 'ugv1'"):
            await world.executive.control.preview_take("ugv")
        with pytest.raises(OperatorError, match="did you mean 'ugv1'"):
            await world.executive.control.take("ugv", by="anna")
        with pytest.raises(OperatorError, match="not with an operator"):
            await world.executive.control.give_back("ugv1", by="anna")

    play(story, "ugv1")
