"""Taking a run over after a crash: the journal is what a dead executive left behind."""

import asyncio

import pytest

from m2pem.api.arbiter import BehaviorReport
from m2pem.api.runs import RunStatus
from m2pem.api.telemetry import VehicleState
from m2pem.bpmn import parse_mission
from m2pem.engine.inputs import (
    BehaviorReported,
    ControlTaken,
    Input,
    PauseRun,
    PromptAnswer,
    StartRun,
)
from m2pem.engine.records import BehaviorProgressed, BehaviorRestarted, PromptOpened
from m2pem.engine.run import MissionRun
from m2pem.errors import JournalError, OperatorError
from m2pem.fleet.fleet import dump
from m2pem.journal import MemoryJournal
from m2pem.journal.base import Entry, RunHeader
from m2pem.mission.catalogue import BehaviorState, ResourceId

from .conftest import START_US, World, behavior, fleet, mission, question, sequence

GOTO = mission(
    sequence(
        (
            "Drive",
            behavior(
                "Drive",
                "goto",
                "ugv1",
                parameters='<m2pem:property name="target" value="[38.1, -77.3, 0]"/>',
            ),
        )
    )
)
OUTAGE_US = 60_000_000
ACCEPTED = BehaviorReported("r1.b1", 1, BehaviorState.ACCEPTED)
RUNNING = BehaviorReported("r1.b1", 2, BehaviorState.RUNNING, native_ref="native")


START = StartRun("P")


def left_behind(source: bytes, *inputs: Input, start: StartRun = START) -> MemoryJournal:
    """A journal in which run r1 got `inputs`, a second apart, and then its executive died."""

    async def write() -> MemoryJournal:
        journal = MemoryJournal()
        vehicles = fleet("ugv1")
        number = await journal.create(RunHeader("m.bpmn", source, "P", dump(vehicles)))
        run = MissionRun(parse_mission(source, "m.bpmn", accepted=True), vehicles, number)
        for second, item in enumerate((start, *inputs)):
            at_us = START_US + second * 1_000_000
            step = run.receive(item, at_us)
            await journal.append(
                [Entry(number, 1, step.seq, at_us, step.t_us, item, tuple(step.records))]
            )
        await journal.release(number)
        return journal

    return asyncio.run(write())


def resumed(play, journal, story, **options):
    """Resumes r1 a minute later and goes on with `story(world)`."""

    async def all_of_it(world: World):
        for behavior_id, report in options.get("known", {}).items():
            world.fake.known[behavior_id] = report
        await world.executive.resume("r1")
        return await story(world)

    return play(all_of_it, "ugv1", journal=journal, start_us=START_US + OUTAGE_US)


def test_a_behavior_that_still_runs_is_reattached_and_not_started_again(play):
    async def story(world: World):
        await world.fake.until_called("query", "r1.b1")
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        summary = await world.executive.control.wait("r1")
        return summary, world.fake.count("start")

    known = {"r1.b1": BehaviorReport("r1.b1", 2, BehaviorState.RUNNING)}
    summary, starts = resumed(play, left_behind(GOTO, ACCEPTED, RUNNING), story, known=known)
    assert summary.status is RunStatus.COMPLETED
    assert starts == 0


def test_what_is_left_is_journaled_after_a_restart_though_its_arbiter_counts_again(play):
    """Before, there were many reports of what is left: the arbiter's next numbers are lower."""
    before = [
        BehaviorReported("r1.b1", number, BehaviorState.RUNNING, remaining={"speed": number})
        for number in range(3, 10)
    ]

    async def story(world: World):
        await world.fake.until_called("query", "r1.b1")
        for speed in (20, 21):
            world.fake.report("r1.b1", BehaviorState.RUNNING, remaining={"speed": speed})
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        await world.executive.control.wait("r1")
        return await world.executive.control.records("r1", limit=1000)

    known = {"r1.b1": BehaviorReport("r1.b1", 2, BehaviorState.RUNNING)}
    journal = left_behind(GOTO, ACCEPTED, RUNNING, *before)
    records = [each.record for each in resumed(play, journal, story, known=known)]
    left = [each for each in records if isinstance(each, BehaviorProgressed) and each.remaining]
    assert [each.remaining["speed"] for each in left] == [*range(3, 10), 20, 21]
    numbers = [each.number for each in left]
    assert numbers == sorted(set(numbers))


def test_a_behavior_that_ended_meanwhile_completes_its_task(play):
    async def story(world: World):
        summary = await world.executive.control.wait("r1")
        return summary, world.fake.count("start")

    known = {"r1.b1": BehaviorReport("r1.b1", 3, BehaviorState.SUCCEEDED)}
    summary, starts = resumed(play, left_behind(GOTO, ACCEPTED, RUNNING), story, known=known)
    assert summary.status is RunStatus.COMPLETED
    assert starts == 0


def test_a_request_that_never_reached_its_arbiter_is_sent(play):
    async def story(world: World):
        await world.fake.until_called("start", "r1.b1")
        world.fake.report("r1.b1", BehaviorState.ACCEPTED)
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        summary = await world.executive.control.wait("r1")
        return summary, [call.what for call in world.fake.calls]

    summary, calls = resumed(play, left_behind(GOTO), story)
    assert summary.status is RunStatus.COMPLETED
    assert calls == ["query", "start"]


NOT_BEGUN = BehaviorReport("r1.b1", 0, BehaviorState.UNKNOWN, not_begun=True)


def test_what_a_vehicle_shows_not_to_have_begun_is_started_and_nobody_is_asked(play):
    async def story(world: World):
        await world.fake.until_called("start", "r1.b1")
        world.fake.report("r1.b1", BehaviorState.RUNNING)
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        summary = await world.executive.control.wait("r1")
        return summary.status, [call.what for call in world.fake.calls], world.seen

    journal, known = left_behind(GOTO, ACCEPTED), {"r1.b1": NOT_BEGUN}
    status, calls, seen = resumed(play, journal, story, known=known)
    assert (status, calls) == (RunStatus.COMPLETED, ["query", "start"])
    assert any(isinstance(each, BehaviorRestarted) for each in seen)
    assert not any(isinstance(each, PromptOpened) for each in seen)


def test_what_a_vehicle_has_had_is_not_started_unasked_though_the_journal_has_no_report_of_it(play):
    async def story(world: World):
        await world.fake.until_called("hold", "ugv1")
        (prompt,) = world.executive.control.prompts()
        return prompt.text, world.fake.count("start")

    known = {"r1.b1": BehaviorReport("r1.b1", 1, BehaviorState.UNKNOWN, reason="it was cancelled")}
    text, starts = resumed(play, left_behind(GOTO), story, known=known)
    assert (text.partition(".")[0], starts) == (
        "Drive: goto of ugv1 is not as it was (it was cancelled)",
        0,
    )


@pytest.mark.parametrize(("inputs", "bound_s"), [((ACCEPTED, RUNNING), None), ((), 10.0)])
def test_what_was_running_or_is_long_ago_is_not_started_unasked(play, monkeypatch, inputs, bound_s):
    monkeypatch.setattr("tests.executive.conftest.MAX_OUTAGE_S", bound_s)

    async def story(world: World):
        await world.fake.until_called("hold", "ugv1")
        return len(world.executive.control.prompts()), world.fake.count("start")

    journal, known = left_behind(GOTO, *inputs), {"r1.b1": NOT_BEGUN}
    assert resumed(play, journal, story, known=known) == (1, 0)


@pytest.mark.parametrize("inputs", [(), (ACCEPTED,)])
def test_what_was_not_begun_in_a_paused_run_begins_when_the_run_goes_on(play, inputs):
    async def story(world: World):
        await world.fake.until_called("hold", "ugv1")
        await world.clock.sleep(60)
        starts = world.fake.count("start")
        await world.executive.control.resume("r1", by="anna")
        await world.fake.until_called("start", "r1.b1")
        await world.clock.sleep(1)
        return starts, world.fake.count("start"), world.fake.count("resume")

    journal = left_behind(GOTO, *inputs, PauseRun("anna"))
    assert resumed(play, journal, story, known={"r1.b1": NOT_BEGUN}) == (0, 1, 0)


@pytest.mark.parametrize(
    ("decision", "status", "starts"),
    [
        ("resume", RunStatus.COMPLETED, 1),
        ("skip", RunStatus.COMPLETED, 0),
        ("abort", RunStatus.STOPPED, 0),
    ],
)
def test_a_moving_behavior_nobody_knows_is_held_and_the_operator_decides(
    play, decision, status, starts
):
    async def story(world: World):
        control = world.executive.control
        await world.fake.until_called("hold", "ugv1")
        (prompt,) = control.prompts()
        assert [choice.value for choice in prompt.decisions] == ["resume", "skip", "abort"]
        assert world.fake.count("start") == 0
        await control.answer("r1", prompt.prompt, decision, by="anna")
        if decision == "resume":
            await world.fake.until_called("start", "r1.b1")
            world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        else:
            await world.fake.until_called("cancel", "r1.b1")
            world.fake.report("r1.b1", BehaviorState.CANCELLED)
        summary = await control.wait("r1")
        return summary.status, world.fake.count("start")

    assert resumed(play, left_behind(GOTO, ACCEPTED, RUNNING), story) == (status, starts)


def test_a_scan_that_nobody_knows_is_started_again(play):
    scan = mission(
        sequence(
            (
                "Drive",
                behavior("Drive", "zoom", "ugv1").replace('type="vehicle"', 'type="payload"'),
            )
        )
    )

    async def story(world: World):
        await world.fake.until_called("start", "r1.b1")
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        await world.executive.control.wait("r1")
        return world.seen

    seen = resumed(play, left_behind(scan, ACCEPTED), story)
    assert any(isinstance(record, BehaviorRestarted) for record in seen)


def test_an_outage_beyond_the_fleets_bound_holds_what_still_runs_and_asks(play, monkeypatch):
    monkeypatch.setattr("tests.executive.conftest.MAX_OUTAGE_S", 10.0)

    async def story(world: World):
        control = world.executive.control
        await world.fake.until_called("hold", "ugv1")
        (prompt,) = control.prompts()
        assert "59 s" in prompt.text
        await control.answer("r1", prompt.prompt, "resume", by="anna")
        await world.fake.until_called("resume", "ugv1")
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        summary = await control.wait("r1")
        return summary.status, world.fake.count("start")

    known = {"r1.b1": BehaviorReport("r1.b1", 2, BehaviorState.RUNNING)}
    journal = left_behind(GOTO, ACCEPTED)
    assert resumed(play, journal, story, known=known) == (RunStatus.COMPLETED, 0)


def test_a_vehicle_that_is_held_for_no_reason_in_the_journal_stands_until_an_operator_answers(play):
    async def story(world: World):
        control = world.executive.control
        await world.fake.until_called("hold", "ugv1")
        (prompt,) = control.prompts()
        assert "held, and the journal does not say why" in prompt.text
        assert world.fake.count("resume") == 0
        await control.answer("r1", prompt.prompt, "resume", by="anna")
        await world.fake.until_called("resume", "ugv1")
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        summary = await control.wait("r1")
        return summary.status, world.fake.count("start")

    known = {"r1.b1": BehaviorReport("r1.b1", 2, BehaviorState.RUNNING, held=True)}
    journal = left_behind(GOTO, ACCEPTED, RUNNING)
    assert resumed(play, journal, story, known=known) == (RunStatus.COMPLETED, 0)


def test_a_vehicle_of_a_paused_run_is_held_as_the_journal_says_and_nothing_is_asked(play):
    async def story(world: World):
        control = world.executive.control
        await world.fake.until_called("hold", "ugv1")
        assert (control.prompts(), world.fake.count("resume")) == ([], 0)
        await control.resume("r1", by="anna")
        await world.fake.until_called("resume", "ugv1")
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        return (await control.wait("r1")).status

    known = {"r1.b1": BehaviorReport("r1.b1", 2, BehaviorState.RUNNING, held=True)}
    journal = left_behind(GOTO, ACCEPTED, RUNNING, PauseRun("anna"))
    assert resumed(play, journal, story, known=known) is RunStatus.COMPLETED


def test_open_prompts_are_asked_again(play):
    async def story(world: World):
        control = world.executive.control
        await world.clock.sleep(1)
        (prompt,) = control.prompts()
        await control.answer("r1", prompt.prompt, "yes")
        summary = await control.wait("r1")
        return summary, [record for record in world.seen if isinstance(record, PromptOpened)]

    summary, opened = resumed(play, left_behind(mission(sequence(("Ask", question("Ask"))))), story)
    assert summary.status is RunStatus.COMPLETED
    assert opened == []


def test_a_run_that_has_ended_is_not_resumed(play):
    journal = left_behind(
        mission(sequence(("Ask", question("Ask")))), PromptAnswer("p1", "yes", "anna")
    )

    async def story(world: World):
        with pytest.raises(OperatorError, match="completed"):
            await world.executive.resume("r1")

    play(story, "ugv1", journal=journal)


def test_an_unknown_run_is_refused_with_those_that_are_there(play):
    async def story(world: World):
        with pytest.raises(JournalError, match=r"r7.*r1"):
            await world.executive.resume("r7")

    play(story, "ugv1", journal=left_behind(GOTO))


def test_an_arbiter_that_cannot_be_asked_is_a_lost_vehicle(play):
    async def story(world: World):
        world.fake.raises["query"] = OSError("no route to host")
        await world.executive.resume("r1")
        return await world.executive.control.wait("r1")

    summary = play(story, "ugv1", journal=left_behind(GOTO, ACCEPTED), start_us=START_US + 1)
    assert summary.status is RunStatus.FAILED
    assert "LINK_LOST" in summary.detail


def test_a_vehicle_that_could_not_be_asked_must_stop_when_it_returns_before_it_is_free(play):
    async def story(world: World):
        control = world.executive.control
        world.fake.raises["query"] = OSError("no route to host")
        await world.executive.resume("r1")
        await control.wait("r1")
        refused = (await control.wait(await control.start(GOTO))).detail
        held = world.fake.count("hold", "ugv1")
        world.fake.say(VehicleState(ResourceId("ugv1"), world.clock.now_us(), ready=True))
        await world.fake.until_called("hold", "ugv1", held + 1)
        await world.clock.sleep(0.1)
        again = await control.start(GOTO)
        await world.fake.until_called("start", f"{again}.b1")
        return refused, [call for call in world.fake.calls if call.what in ("cancel", "start")]

    refused, calls = play(
        story, "ugv1", journal=left_behind(GOTO, ACCEPTED, RUNNING), start_us=START_US + OUTAGE_US
    )
    assert "ugv1 is unavailable: lost: its arbiter could not be asked" in refused
    assert [call.what for call in calls] == ["cancel", "start"]


def test_who_has_a_vehicle_is_known_again_after_a_restart(play):
    async def story(world: World):
        return await world.executive.control.holders()

    journal = left_behind(mission(sequence(("Ask", question("Ask")))), ControlTaken("ugv1", "anna"))
    assert resumed(play, journal, story) == {"ugv1": "anna"}


def test_a_run_that_never_began_is_not_resumed(play):
    async def create() -> MemoryJournal:
        journal = MemoryJournal()
        number = await journal.create(RunHeader("m.bpmn", GOTO, "P", dump(fleet("ugv1"))))
        await journal.release(number)
        return journal

    async def story(world: World):
        with pytest.raises(OperatorError, match="never began"):
            await world.executive.resume("r1")

    play(story, "ugv1", journal=asyncio.run(create()))


def test_a_run_goes_on_though_this_release_refuses_its_mission(play, caplog):
    async def story(world: World):
        control = world.executive.control
        await control.answer("r1", "p1", "yes", by="anna")
        return (await control.wait("r1")).status

    asked = mission(sequence(("Ask", question("Ask")), ("Wait", '<task id="Wait"/>')))
    accepted = asked.replace(b"<m2pem:prompt", b'<m2pem:prompt tiemout="3 s"')
    accepted = accepted.replace(b'<task id="Wait"', b'<task id="Wait" startQuantity="0"')
    assert resumed(play, left_behind(accepted), story) is RunStatus.COMPLETED
    assert "r1 goes on as it was begun, but would not begin now" in caplog.text
    assert "did you mean 'timeout'?" in caplog.text
    assert "startQuantity='0' is no number of tokens" in caplog.text
