"""Resuming a run of which the journal has lost entries: nothing starts before an operator says."""

import asyncio
from dataclasses import replace

import pytest

from m2pem.api.arbiter import BehaviorReport
from m2pem.api.runs import PromptClosed, RunStatus
from m2pem.engine.records import BehaviorRequested, RunClaimed
from m2pem.errors import OperatorError
from m2pem.journal.base import Loss
from m2pem.mission.catalogue import BehaviorState, ResourceId

from .conftest import START_US, World, behavior, mission, sequence
from .test_recovery import ACCEPTED, GOTO, OUTAGE_US, RUNNING, left_behind

LOSS = Loss(acknowledged=12, found=8)
TARGET = '<m2pem:property name="target" value="[38.1, -77.3, 0]"/>'
TWO = mission(
    sequence(
        ("Drive", behavior("Drive", "goto", "ugv1", parameters=TARGET)),
        ("Back", behavior("Back", "goto", "ugv2", parameters=TARGET)),
    )
)


def with_loss(journal, loss=LOSS):
    """The journal as one that has found that entries of r1 are gone."""
    runs = journal.runs

    async def lossy(**wanted):
        return [replace(each, loss=loss) for each in await runs(**wanted)]

    journal.runs = lossy
    return journal


def resumed(play, source, story, *inputs, known=()):
    async def all_of_it(world: World):
        world.fake.known.update({report.id: report for report in known})
        await world.executive.resume("r1")
        return await story(world)

    journal = with_loss(left_behind(source, *inputs))
    return play(all_of_it, "ugv1", "ugv2", journal=journal, start_us=START_US + OUTAGE_US)


async def until_paused(world):
    while "RunPaused" not in world.names():
        await world.clock.sleep(0.1)


def test_a_request_that_may_have_been_sent_is_not_sent_before_the_operator_says_so(play):
    async def story(world: World):
        control = world.executive.control
        await world.fake.until_called("hold", "ugv1")
        await world.fake.until_called("hold", "ugv2")
        await until_paused(world)
        await world.clock.sleep(600)
        assert world.fake.count("start") == 0
        (prompt,) = control.prompts()
        assert (prompt.prompt, prompt.element) == ("loss", "P")
        assert "it acknowledged record 12, and its last one now is 8" in prompt.text
        assert "Held: ugv1, ugv2." in prompt.text
        await control.answer("r1", "loss", "go_on", by="anna")
        while not (asked := control.prompts()):
            await world.clock.sleep(0.1)
        assert world.fake.count("start") == 0
        assert "Drive: goto of ugv1 is not as it was" in asked[0].text
        await control.answer("r1", asked[0].prompt, "resume", by="anna")
        await world.fake.until_called("start", "r1.b1")

    resumed(play, TWO, story)


def test_a_service_that_was_under_way_begins_again_when_the_operator_says_so(play, monkeypatch):
    begun = []
    monkeypatch.setattr(
        "m2pem.executive.services.Services.run", lambda _, run, command: begun.append(command.name)
    )
    serves = mission(sequence(("Look", '<serviceTask id="Look" m2pem:service="Detector"/>')))

    async def story(world: World):
        control = world.executive.control
        await until_paused(world)
        await world.clock.sleep(600)
        assert begun == []
        await control.answer("r1", "loss", "go_on", by="anna")
        while not begun:
            await world.clock.sleep(0.1)

    resumed(play, serves, story)
    assert begun == ["Detector"]


def test_a_behavior_that_goes_on_is_held_until_the_operator_lets_it_go(play):
    async def story(world: World):
        control = world.executive.control
        await until_paused(world)
        assert world.fake.count("resume") == 0
        await control.resume("r1", by="anna")
        while not (asked := control.prompts()):
            await world.clock.sleep(0.1)
        assert world.fake.count("resume", "ugv1") == 0
        await control.answer("r1", asked[0].prompt, "resume", by="anna")
        await world.fake.until_called("resume", "ugv1")
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        return (await control.wait("r1")).status, world.fake.count("start")

    known = [BehaviorReport("r1.b1", 2, BehaviorState.RUNNING)]
    assert resumed(play, GOTO, story, ACCEPTED, RUNNING, known=known) == (RunStatus.COMPLETED, 0)


def test_a_behavior_that_the_journal_does_not_know_is_cancelled_and_its_id_not_given_again(play):
    async def story(world: World):
        control = world.executive.control
        await world.fake.until_called("cancel", "r1.b3")
        assert world.fake.count("cancel") == 1
        (prompt,) = control.prompts()
        assert "r1.b3 was under way and not in the journal: it is cancelled" in prompt.text
        await control.answer("r1", "loss", "go_on", by="anna")
        while len(control.prompts()) < 1 or control.prompts()[0].prompt == "loss":
            await world.clock.sleep(0.1)
        await control.answer("r1", control.prompts()[0].prompt, "skip", by="anna")
        await world.fake.until_called("start")
        (claimed,) = [each for each in world.seen if isinstance(each, RunClaimed)]
        assert claimed.lost == 4
        return [each.behavior for each in world.seen if isinstance(each, BehaviorRequested)]

    known = [BehaviorReport("r1.b3", 2, BehaviorState.RUNNING)]
    assert resumed(play, TWO, story, known=known) == ["r1.b6"]


def test_a_stop_ends_the_run_and_lets_nothing_go_on(play):
    async def story(world: World):
        control = world.executive.control
        notices = control.subscribe()
        await until_paused(world)
        answering = asyncio.create_task(control.answer("r1", "loss", "stop", by="anna"))
        await world.fake.until_called("cancel", "r1.b1")
        world.fake.report("r1.b1", BehaviorState.CANCELLED)
        await answering
        async for notice in notices:
            if isinstance(notice, PromptClosed):
                assert (notice.prompt, notice.decision) == ("loss", "stop")
                break
        summary = await control.wait("r1")
        counts = world.fake.count("start"), world.fake.count("resume")
        with pytest.raises(OperatorError):
            await control.answer("r1", "loss", "go_on", by="ben")
        return summary.status, counts

    known = [BehaviorReport("r1.b1", 2, BehaviorState.RUNNING)]
    answer = resumed(play, GOTO, story, ACCEPTED, RUNNING, known=known)
    assert answer == (RunStatus.STOPPED, (0, 0))


def test_no_other_run_gets_what_is_held(play):
    async def story(world: World):
        await until_paused(world)
        availability = world.executive.supervisor.availability
        assert "an operator is asked of r1" in availability.reason(ResourceId("ugv2"))
        await world.executive.control.resume("r1")
        assert availability.reason(ResourceId("ugv2")) == ""

    resumed(play, TWO, story)


def test_a_wrong_answer_is_refused_with_those_there_are(play):
    async def story(world: World):
        await until_paused(world)
        with pytest.raises(OperatorError, match="'maybe' is no decision of prompt loss: go_on, st"):
            await world.executive.control.answer("r1", "loss", "maybe")

    resumed(play, GOTO, story)


def test_a_run_of_which_nothing_is_left_is_not_taken_up(play):
    async def story(world: World):
        with pytest.raises(
            OperatorError, match=r"r1: the journal has lost the run.*accept-loss r1"
        ):
            await world.executive.resume("r1")
        assert await world.executive.control.runs() == []
        with pytest.raises(OperatorError, match="r1: the journal has lost the run"):
            await world.executive.control.mission("r1")

    journal = with_loss(left_behind(GOTO), Loss(3, None, resumable=False))
    play(story, "ugv1", journal=journal)
