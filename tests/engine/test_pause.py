"""Pause and resume: what is held, what waits, what goes on."""

from m2pem.engine.inputs import (
    BehaviorMissing,
    BehaviorReported,
    ClaimRun,
    Continue,
    GeometrySet,
    GiveUp,
    MessageReceived,
    PromptAnswer,
    ResourceFault,
    StartRun,
    Tick,
)
from m2pem.mission.catalogue import ResumePolicy
from tests.engine.kit import CANCELLED, RUNNING, SUCCEEDED, Play
from tests.engine.snapshot import snapshot
from tests.engine.trace import table

TWO = """
    <startEvent id="start"/> <userTask id="u">ask a b</userTask> <userTask id="v"/>
    <scriptTask id="drive">do drive_stop evsg1</scriptTask>
    <scriptTask id="team">do formation team:alpha</scriptTask>
    <scriptTask id="scan">do ptz_track evsg1/ptz</scriptTask>
    <boundaryEvent id="stop" attachedToRef="drive">signal go</boundaryEvent>
    <scriptTask id="back">do reverse evsg1</scriptTask>
    start -> u -> v
    start -> drive
    start -> team
    start -> scan
    stop -> back
"""


def test_every_commanded_resource_is_held_once_and_resumed_once() -> None:
    play = Play(TWO).start()
    play.signal("go")  # evsg1 is now held by a behavior that ends and by one that begins
    play.orders()
    names = ["alpha_1", "alpha_2", "alpha_3", "evsg1/ptz", "evsg1"]
    assert sorted(play.pause().orders()) == sorted(f"hold {name}" for name in names)
    assert sorted(play.resume().orders()) == sorted(f"resume {name}" for name in names)


def test_what_is_only_being_cancelled_is_not_held() -> None:
    play = Play("""
        <startEvent id="start"/> <scriptTask id="drive">do drive_stop evsg1</scriptTask>
        <boundaryEvent id="stop" attachedToRef="drive">signal go</boundaryEvent> <userTask id="u"/>
        start -> drive
        stop -> u
    """).start()
    play.signal("go").orders()
    assert play.pause().resume().orders() == []


def test_inputs_are_deferred_and_decided_in_order_at_resume() -> None:
    play = Play(TWO).start().pause()
    play.trace()
    play.signal("go").report("team").answer("b").message("unknown")
    assert play.trace() == table("""
        defer SignalReceived; defer BehaviorReported; defer PromptAnswer; defer MessageReceived
    """)
    assert play.at == "u drive team scan"
    play.orders()
    play.resume()
    assert play.trace("resume", "signal", "ended", "answer", "ignored:") == table("""
        resume; signal go; ended b2 SUCCEEDED; answer p1 b
        ignored: nothing in the mission receives message unknown
    """)
    assert play.at == "scan back v"
    assert play.orders() == [
        "resume evsg1/ptz",
        "cancel b1",
        "start b4 reverse evsg1",
        "close p1 b",
        "open p2 done",
    ]


def test_each_deferred_input_has_all_its_effects_before_the_next() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <userTask id="w"/> <userTask id="x"/>
        <intermediateCatchEvent id="catch">signal go</intermediateCatchEvent>
        start -> u -> catch -> x
    """).start()
    play.pause().answer().signal("go").resume()
    assert play.at == "x"


def test_durations_stop_during_a_pause() -> None:
    play = Play("""
        <startEvent id="start"/> <intermediateCatchEvent id="wait">timer PT10S
        </intermediateCatchEvent> <userTask id="u"/>
        start -> wait -> u
    """).start()
    play.advance(4).pause()
    assert play.run.next_due_us is None
    play.advance(100)
    assert play.steps[-1].t_us == 4_000_000
    play.resume()
    assert play.steps[-1].t_us == 4_000_000
    assert play.advance(5.9).at == "wait"
    assert play.advance(0.1).at == "u"
    assert play.steps[-1].t_us == 10_000_000


def test_cycles_stop_during_a_pause_and_go_on_at_their_rhythm() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <scriptTask id="count">n = n + 1</scriptTask>
        <boundaryEvent id="tick" attachedToRef="u" cancelActivity="false">cycle R/PT10S
        </boundaryEvent>
        start -> u
        tick -> count
    """).start({"n": 0})
    play.advance(14).pause().advance(1000).resume()
    assert play.data["n"] == 1
    assert play.advance(5.9).data["n"] == 1
    assert play.advance(0.1).data["n"] == 2


def test_a_date_does_not_stop_and_fires_at_resume_when_it_has_passed() -> None:
    play = Play("""
        <startEvent id="start"/> <intermediateCatchEvent id="wait">date 2026-01-01T00:00:10Z
        </intermediateCatchEvent> <userTask id="u"/>
        start -> wait -> u
    """).start()
    play.advance(4).pause().advance(100)
    assert play.at == "wait"
    assert play.resume().advance(0).at == "u"


def test_a_date_still_to_come_keeps_its_time() -> None:
    play = Play("""
        <startEvent id="start"/> <intermediateCatchEvent id="wait">date 2026-01-01T00:00:10Z
        </intermediateCatchEvent> <userTask id="u"/>
        start -> wait -> u
    """).start()
    play.advance(4).pause().advance(3).resume()
    assert play.advance(2.9).at == "wait"
    assert play.advance(0.1).at == "u"


def test_a_paused_run_ignores_what_only_time_and_itself_send() -> None:
    play = Play(TWO).start().pause()
    for item in (StartRun("MAIN"), Tick(), Continue()):
        assert play.give(item).ignored() == f"{type(item).__name__} while the run is paused"
    assert play.pause().ignored() == "PauseRun while the run is paused"


def test_resume_without_a_pause_is_ignored() -> None:
    assert Play(TWO).start().resume().ignored() == "ResumeRun while the run is running"


def test_a_paused_run_takes_claims_and_geometries_at_once() -> None:
    play = Play(TWO).start().pause()
    play.give(ClaimRun(7)).give(GeometrySet("alpha", {"type": "Point", "coordinates": [1, 2]}))
    assert play.run.state.epoch == 7
    assert play.run.state.geometries == {"alpha": {"type": "Point", "coordinates": [1, 2]}}
    assert play.at == "u drive team scan"


def test_a_paused_run_can_be_stopped_and_cancels_everything() -> None:
    play = Play(TWO).start().pause()
    play.answer("a").orders()
    play.stop()
    assert play.orders() == ["close p1", "cancel b1", "cancel b2", "cancel b3"]
    assert play.ended == "stopped"
    assert play.report("b1", CANCELLED).report("b2", SUCCEEDED).report("b3").ended == "stopped"


def test_a_paused_run_can_be_given_up() -> None:
    play = Play(TWO).start().pause().give(GiveUp("over"))
    assert play.ended == "failed"


def test_the_second_answer_to_a_prompt_is_told_at_once_who_was_first() -> None:
    play = Play(TWO).start().pause().answer("a", by="ann")
    assert play.answer("b", by="bob").ignored() == "prompt p1 was answered by ann"
    assert play.resume().data["user.decision"] == "a"


def test_an_answer_that_means_nothing_does_not_take_the_place_of_one_that_does() -> None:
    play = Play(TWO).start().pause()
    assert play.answer("nonsense").ignored() == "'nonsense' is no decision of prompt p1: a, b"
    assert play.give(PromptAnswer("p9", "a")).ignored().startswith("prompt p9 is not open")
    assert play.answer("b").resume().data["user.decision"] == "b"


def test_a_behavior_that_ended_during_the_pause_needs_no_resume() -> None:
    play = Play(TWO).start().pause()
    play.report("drive").report("team").orders()
    assert play.resume().orders() == ["resume evsg1/ptz"]


def test_a_behavior_that_an_operator_lets_go_on_in_the_pause_is_resumed_once() -> None:
    play = Play(TWO).start()
    play.give(BehaviorMissing("r1.b1", ResumePolicy.HOLD, RUNNING)).orders()
    held = ["hold alpha_1", "hold alpha_2", "hold alpha_3", "hold evsg1/ptz"]
    assert play.pause().orders() == held
    play.answer("resume", prompt="drive")
    assert play.resume().orders() == [
        *(line.replace("hold", "resume") for line in held),
        "close p2 resume",
        "resume evsg1",
    ]


def test_a_run_that_a_deferred_input_ends_ignores_the_later_ones() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <endEvent id="end">terminate</endEvent>
        start -> u -> end
    """).start()
    play.pause().answer().signal("go").resume()
    assert play.ended == "terminated"
    assert play.trace("ignored:") == ["ignored: SignalReceived while the run is ended"]


def test_a_behavior_asked_about_and_ended_within_one_resume_is_not_held() -> None:
    play = Play(TWO).start().pause()
    play.give(BehaviorMissing("r1.b1", ResumePolicy.HOLD))
    play.report("drive")
    play.orders()
    play.resume()
    assert "hold evsg1" not in play.orders()
    assert "unsettled b1" in play.trace()


def test_reports_of_a_behavior_being_cancelled_wait_for_resume_too() -> None:
    play = Play(TWO).start()
    play.signal("go").pause()
    play.report("b1", CANCELLED)
    assert "r1.b1" in play.run.state.behaviors
    assert "r1.b1" not in play.resume().run.state.behaviors


def test_a_deferred_fault_of_a_resource_that_is_free_by_then_is_ignored() -> None:
    play = Play(TWO).start().pause()
    play.report("drive").give(ResourceFault("evsg1", "LINK_LOST")).resume()
    assert play.trace("ignored:") == [
        "ignored: LINK_LOST of evsg1, which does nothing for this run"
    ]


def test_what_is_ignored_in_a_pause_changes_nothing_else() -> None:
    play = Play(TWO).start().pause()
    play.answer("a")
    before = snapshot(play.run.state)
    play.answer("b").give(Tick())
    assert snapshot(play.run.state) == before | {"seq": before["seq"] + 2}


def test_a_message_deferred_twice_by_its_id_is_taken_once() -> None:
    play = Play("""
        <startEvent id="start"/> <receiveTask id="one" messageRef="m"/>
        <receiveTask id="two" messageRef="m"/>
        start -> one -> two
    """).start()
    play.pause().give(MessageReceived("m", id="5")).give(MessageReceived("m", id="5")).resume()
    assert play.at == "two"
    assert play.trace("ignored:") == ["ignored: MessageReceived 5 was taken before"]


def test_a_report_of_progress_is_deferred_like_any_other() -> None:
    play = Play(TWO).start().pause()
    play.give(BehaviorReported("r1.b1", 1, SUCCEEDED))
    assert play.at == "u drive team scan"
