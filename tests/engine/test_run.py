"""The run as a whole: starting, stopping, ending, giving up, and what comes too late."""

import builtins
import random
import time
import uuid
from typing import Any, NoReturn

import pytest

from m2pem.engine import inputs as i
from m2pem.engine.run import MissionRun
from m2pem.mission.catalogue import BehaviorState, ResumePolicy
from tests.engine.kit import CANCELLED, RUNNING, START_US, Play
from tests.engine.snapshot import snapshot
from tests.engine.trace import table

BUSY = """
    <startEvent id="start"/> <userTask id="u">ask a b</userTask> <userTask id="v"/>
    <scriptTask id="drive">do drive_stop evsg1</scriptTask>
    <scriptTask id="other">do drive_stop evsg2</scriptTask>
    <boundaryEvent id="stop" attachedToRef="other">signal go</boundaryEvent>
    <serviceTask id="look">call Detector</serviceTask> <receiveTask id="get" messageRef="m"/>
    <intermediateCatchEvent id="wait">timer PT1H</intermediateCatchEvent>
    <parallelGateway id="join"/> <inclusiveGateway id="or"/> <userTask id="never"/>
    <subProcess id="sub"> <startEvent id="s"/> <userTask id="inner"/>
      s -> inner
    </subProcess>
    start -> u -> v
    start -> drive
    start -> other
    start -> look
    start -> get
    start -> wait
    start -> sub
    start -> join -> never
    v -> join
    start -> or
    v -> or
"""


def test_a_run_takes_nothing_before_its_start() -> None:
    play = Play(BUSY)
    for item in (i.Tick(), i.StopRun(), i.PauseRun(), i.ClaimRun(2), i.SignalReceived("go")):
        assert play.give(item).ignored() == f"{type(item).__name__} while the run is new"
    assert play.run.next_due_us is None
    assert play.start().at


def test_a_run_starts_once() -> None:
    play = Play(BUSY).start()
    assert play.start().ignored() == "StartRun while the run is running"


def test_a_process_that_the_mission_lacks_starts_nothing() -> None:
    play = Play(BUSY).give(i.StartRun("NO"))
    assert play.ignored() == "the mission has no process 'NO'"
    assert play.start().at


def test_stop_ends_every_token_and_cancels_every_behavior() -> None:
    play = Play(BUSY).start()
    play.signal("go").trace()
    play.orders()
    play.stop()
    assert (play.ended, play.detail) == ("stopped", "stopped by ops")
    assert sorted(play.orders()) == ["cancel b1", "cancel s1", "close p1", "close p2"]
    assert sorted(play.trace("leave")) == [
        "leave drive terminated",
        "leave get terminated",
        "leave inner terminated",
        "leave join terminated",
        "leave look terminated",
        "leave or terminated",
        "leave sub terminated",
        "leave u terminated",
        "leave wait terminated",
    ]
    assert play.run.next_due_us is None
    play.report("b1", CANCELLED).report("b2", CANCELLED)
    assert play.run.outstanding() == []


def test_a_rehearsal_that_gives_up_names_what_is_awaited() -> None:
    play = Play(BUSY).start()
    play.signal("go").give(i.GiveUp("nothing scheduled can happen any more"))
    assert play.ended == "failed"
    assert play.detail.startswith("nothing scheduled can happen any more; awaited: ")
    assert set(play.detail.partition("awaited: ")[2].split(", ")) == {
        "drive (behavior drive_stop)",
        "u (an answer)",
        "inner (an answer)",
        "look (Detector)",
        "get (message)",
        "wait (timer)",
    }


# --- late and repeated inputs -------------------------------------------------------------------

LATE: list[i.Input] = [
    i.StartRun("MAIN"),
    i.ResumeRun(),
    i.Continue(),
    i.Tick(),
    i.BehaviorReported("r1.b9", 1, BehaviorState.SUCCEEDED),
    i.BehaviorReported("r1.b1", 1, RUNNING),
    i.BehaviorMissing("r1.b9", ResumePolicy.FAIL),
    i.PromptAnswer("p9", "a"),
    i.PromptAnswer("p1", "c"),
    i.ServiceCompleted("s9", {"x": 1}),
    i.ServiceFailed("s9", "E"),
    i.SignalReceived("go", id="once"),
    i.MessageReceived("m", id="once-too"),
    i.MessageReceived("nobody", {"x": 1}, id="new"),
    i.ResourceFault("evsg3", "LINK_LOST"),
    i.ResourceFault("evsg3", "LINK_LOST", reachable=False),
]


@pytest.mark.parametrize("item", LATE, ids=lambda item: type(item).__name__)
def test_a_redundant_input_is_ignored_with_a_reason_and_changes_nothing_else(
    item: i.Input,
) -> None:
    play = Play(BUSY).start().report("drive", RUNNING, number=5)
    play.give(i.SignalReceived("go", id="once")).give(i.MessageReceived("m", id="once-too"))
    before = snapshot(play.run.state)
    play.give(item)
    assert play.ignored()
    assert play.steps[-1].commands == []
    assert snapshot(play.run.state) == before | {"seq": before["seq"] + 1}


@pytest.mark.parametrize(
    "item",
    [*LATE, i.StopRun(), i.PauseRun(), i.GiveUp("x"), i.GeometrySet("a", {}), i.Continue()],
    ids=lambda item: type(item).__name__,
)
def test_a_run_that_has_ended_ignores_everything_else(item: i.Input) -> None:
    play = Play(BUSY).start().stop()
    play.report("drive", CANCELLED).report("other", CANCELLED)
    before = snapshot(play.run.state)
    play.give(item)
    assert play.ignored()
    assert snapshot(play.run.state) == before | {"seq": before["seq"] + 1}


def test_a_service_that_was_withdrawn_may_still_answer_and_is_ignored() -> None:
    play = Play("""
        <startEvent id="start"/> <serviceTask id="look">call X</serviceTask> <userTask id="u"/>
        <boundaryEvent id="stop" attachedToRef="look">signal go</boundaryEvent>
        start -> look
        stop -> u
    """).start()
    play.signal("go")
    for item in (i.ServiceCompleted("s1", {"x": 1}), i.ServiceFailed("s1", "E")):
        assert play.give(item).ignored() == "service s1 is not running"
    assert play.data == {}


# --- stuck runs ---------------------------------------------------------------------------------


def test_a_run_in_which_nothing_can_move_and_nothing_is_awaited_fails_and_names_where() -> None:
    play = Play("""
        <startEvent id="start"/> <exclusiveGateway id="which"/> <userTask id="u"/>
        <parallelGateway id="join"/> <subProcess id="sub"> <startEvent id="s"/>
          <parallelGateway id="inner"/> <task id="x"/> <task id="y"/> <exclusiveGateway id="g"/>
          s -> g
          g -> x if true
          g -> y if false
          x -> inner
          y -> inner
        </subProcess>
        start -> which
        which -> u
        which -> join if false
        u -> join
        start -> sub
    """).start()
    assert play.at == "u inner"
    assert play.answer().ended == "failed"
    assert play.detail == "stuck: no token can move from inner, join"


def test_a_stuck_run_with_a_behavior_that_still_ends_has_failed_all_the_same() -> None:
    play = Play("""
        <startEvent id="start"/> <scriptTask id="drive">do drive_stop evsg1</scriptTask>
        <boundaryEvent id="stop" attachedToRef="drive">signal go</boundaryEvent>
        <parallelGateway id="join"/>
        start -> drive -> join
        stop -> join
    """).start()
    assert play.signal("go").ended == "failed"
    assert play.report("b1", CANCELLED).run.state.held == {}


# --- invariants ---------------------------------------------------------------------------------


def test_deciding_reads_no_clock_no_randomness_and_no_file(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def forbidden(*_: Any, **__: Any) -> NoReturn:
        raise AssertionError("the engine is pure")

    play = Play(BUSY)
    with monkeypatch.context() as patched:
        for module, name in (
            (time, "time"),
            (time, "monotonic"),
            (random, "random"),
            (uuid, "uuid4"),
            (builtins, "open"),
        ):
            patched.setattr(module, name, forbidden)
        play.start().signal("go").pause().answer("a").resume().advance(3600)
        play.report("drive").complete("look", x=1).fault("evsg2").message("m")
        play.answer(prompt="v").answer(prompt="inner")
        if not play.ended:
            play.stop()
    assert play.ended


def test_a_run_can_be_taken_up_at_every_input() -> None:
    play = Play(BUSY).start()
    play.signal("go").advance(3600).pause().answer("a").resume().complete("look").message("m")
    for place in range(len(play.steps) + 1):
        taken_up = MissionRun(play.mission, play.fleet, "r1")
        for step in play.steps[:place]:
            taken_up.replay(step.records)
        for step in play.steps[place:]:
            assert list(taken_up.receive(step.input, step.at_us).records) == list(step.records)
        assert snapshot(taken_up.state) == snapshot(play.run.state)


def test_records_are_numbered_from_one_without_gaps() -> None:
    play = Play(BUSY).start()
    play.signal("go").give(i.Tick()).stop()
    number = 1
    for step in play.steps:
        assert step.seq == number
        number += len(step.records)
    assert play.run.state.seq == number - 1


def test_mission_time_counts_from_the_start() -> None:
    play = Play(BUSY)
    play.now_us += 5_000_000
    play.start().advance(2.5).signal("go")
    assert [step.t_us for step in play.steps] == [0, 2_500_000]
    assert play.run.state.started_us == START_US + 5_000_000
    assert play.trace()[:2] == table("begin MAIN; open MAIN")
