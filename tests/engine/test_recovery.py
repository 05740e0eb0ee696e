"""After a restart: claims, and behaviors that are no longer as they were."""

import pytest

from m2pem.engine import records as r
from m2pem.engine.commands import CancelBehavior, StartBehavior
from m2pem.engine.inputs import BehaviorMissing, ClaimRun, ResourceFault
from m2pem.engine.state import BehaviorPhase
from m2pem.mission.catalogue import BehaviorState, ResumePolicy
from tests.engine.kit import CANCELLED, FAILED, RUNNING, Play
from tests.engine.trace import line, table

DRIVE = """
    <startEvent id="start"/> <scriptTask id="drive" name="Drive">do drive_stop evsg1</scriptTask>
    <boundaryEvent id="stop" attachedToRef="drive">signal go</boundaryEvent>
    <boundaryEvent id="failed" attachedToRef="drive">error FAILED</boundaryEvent>
    <userTask id="after"/> <userTask id="rescue"/> <userTask id="stopped"/>
    start -> drive -> after
    failed -> rescue
    stop -> stopped
"""


def missing(
    policy: ResumePolicy, state: BehaviorState = BehaviorState.UNKNOWN, behavior: str = "r1.b1"
) -> BehaviorMissing:
    return BehaviorMissing(behavior, policy, state)


def claimed() -> Play:
    play = Play(DRIVE).start().give(ClaimRun(2, "host"))
    play.trace()
    play.orders()
    return play


def test_a_claim_raises_the_epoch_of_every_later_command() -> None:
    play = claimed().give(missing(ResumePolicy.RESTART)).signal("go")
    later = list(play.commands())[1:]
    assert [c.epoch for c in later if isinstance(c, StartBehavior | CancelBehavior)] == [2, 2]


def test_what_is_outstanding_is_read_off_the_state() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="u"/> <serviceTask id="look">call X</serviceTask>
        <scriptTask id="drive">do drive_stop evsg1</scriptTask>
        <scriptTask id="scan">do ptz_track evsg1/ptz</scriptTask>
        <scriptTask id="other">do drive_stop evsg2</scriptTask>
        <boundaryEvent id="stop" attachedToRef="drive">signal go</boundaryEvent>
        start -> u
        start -> look
        start -> drive
        start -> scan
        start -> other
    """).start()
    play.signal("go").give(missing(ResumePolicy.HOLD, behavior="r1.b3"))
    assert [line(c) for c in play.run.outstanding()] == [
        "cancel b1",
        "start b2 ptz_track evsg1/ptz",
        "hold evsg2",
        "open p1 done",
        "open p2 resume skip abort",
        "run s1 X",
    ]
    play.pause()
    assert [line(c) for c in play.run.outstanding()][-1] == "hold evsg1/ptz"


def test_policy_restart_requests_the_behavior_again_under_its_id() -> None:
    play = Play(DRIVE).start().report("drive", RUNNING, number=3).give(ClaimRun(2))
    play.trace()
    play.orders()
    play.give(missing(ResumePolicy.RESTART))
    assert play.steps[-1].records == [r.BehaviorRestarted("r1.b1", 2)]
    assert play.orders() == ["start b1 drive_stop evsg1"]
    behavior = play.behavior("b1")
    assert (behavior.state, behavior.number, behavior.native_ref) == (None, 0, None)
    assert play.report("drive").at == "after"


def test_policy_fail_ends_the_task_with_an_error() -> None:
    play = claimed().give(missing(ResumePolicy.FAIL))
    assert play.trace("ended", "error") == ["ended b1 LOST FAILED", "error FAILED caught by failed"]
    assert play.at == "rescue"


def test_policy_hold_holds_the_vehicle_and_asks() -> None:
    play = claimed().give(missing(ResumePolicy.HOLD))
    assert play.trace() == ["unsettled b1", "ask p1 drive"]
    assert play.orders() == ["hold evsg1", "open p1 resume skip abort"]
    assert play.at == "drive"


@pytest.mark.parametrize(
    ("state", "order"),
    [(BehaviorState.UNKNOWN, "start b1 drive_stop evsg1"), (RUNNING, "resume evsg1")],
)
def test_resume_lets_go_on_what_still_runs_and_starts_again_what_does_not(
    state: BehaviorState, order: str
) -> None:
    play = claimed().give(missing(ResumePolicy.HOLD, state))
    play.orders()
    play.answer("resume")
    assert play.orders() == ["close p1 resume", order]
    assert play.behavior("b1").phase is BehaviorPhase.ACTIVE
    assert play.report("drive").at == "after"


def test_skip_cancels_the_behavior_and_goes_on_after_the_task() -> None:
    play = claimed().give(missing(ResumePolicy.HOLD))
    play.orders()
    play.answer("skip")
    assert play.at == "after"
    assert play.orders() == ["close p1 skip", "cancel b1", "open p2 done"]
    assert "user.decision" not in play.data
    assert play.report("b1", CANCELLED).run.state.held == {}


def test_abort_stops_the_run() -> None:
    play = claimed().give(missing(ResumePolicy.HOLD))
    play.orders()
    play.answer("abort", by="ann")
    assert (play.ended, play.detail) == ("stopped", "aborted by ann")
    assert play.orders() == ["close p1 abort", "cancel b1"]


def test_an_interruption_takes_the_recovery_prompt_back() -> None:
    play = claimed().give(missing(ResumePolicy.HOLD))
    play.orders()
    play.signal("go")
    assert play.at == "stopped"
    assert play.orders() == ["cancel b1", "close p1", "open p2 done"]


@pytest.mark.parametrize(("state", "at"), [(BehaviorState.SUCCEEDED, "after"), (FAILED, "rescue")])
def test_a_report_that_comes_after_all_settles_it(state: BehaviorState, at: str) -> None:
    play = claimed().give(missing(ResumePolicy.HOLD))
    play.orders()
    play.report("drive", state)
    assert play.at == at
    assert play.orders() == ["close p1", "open p2 done"]


def test_a_fault_settles_it_too() -> None:
    play = claimed().give(missing(ResumePolicy.HOLD))
    play.orders()
    play.fault("evsg1", "FAILED")
    assert play.at == "rescue"
    assert play.orders() == ["close p1", "cancel b1", "open p2 done"]


def test_an_unsettled_behavior_still_holds_its_vehicle() -> None:
    play = Play("""
        <startEvent id="start"/> <scriptTask id="drive">do drive_stop evsg1</scriptTask>
        <userTask id="u"/> <scriptTask id="more">do drive_stop evsg1</scriptTask>
        start -> drive
        start -> u -> more
    """).start()
    play.give(missing(ResumePolicy.HOLD)).answer(prompt="u")
    assert play.ended == "failed"
    assert "evsg1 is held by drive_stop of drive" in play.detail


def test_a_behavior_that_was_being_cancelled_has_ended_then() -> None:
    play = Play(DRIVE).start().signal("go")
    play.give(missing(ResumePolicy.HOLD))
    assert play.trace()[-1] == "ended b1 CANCELLED"
    assert play.run.state.held == {}


def test_what_is_missing_twice_is_asked_once() -> None:
    play = claimed().give(missing(ResumePolicy.HOLD)).give(missing(ResumePolicy.RESTART))
    assert play.ignored() == "an operator is asked about r1.b1 already"


def test_a_behavior_that_is_no_more_cannot_be_missing() -> None:
    play = claimed().report("drive").give(missing(ResumePolicy.HOLD))
    assert play.ignored() == "r1.b1 is not active"


def test_a_run_that_has_ended_still_lets_go_of_what_it_was_cancelling() -> None:
    play = Play(DRIVE).start().stop().give(ClaimRun(2))
    assert list(play.run.state.held) == ["evsg1"]
    play.give(missing(ResumePolicy.HOLD))
    assert play.run.state.held == {}
    assert play.ended == "stopped"


def test_a_run_that_has_ended_loses_what_it_was_cancelling_with_its_vehicle() -> None:
    play = Play(DRIVE).start().stop()
    play.give(ResourceFault("evsg1", "LINK_LOST", reachable=False))
    assert play.run.state.held == {}


def test_a_claim_in_a_batch_goes_on_with_the_steps_left_over() -> None:
    play = Play(
        """
        <startEvent id="start"/> <task id="a"/> <task id="b"/> <task id="c"/> <userTask id="u"/>
        start -> a -> b -> c -> u
    """,
        batch=2,
    )
    play.goes_on = False
    assert play.start().at == "b"
    assert play.give(ClaimRun(2)).at == "u"
    assert play.trace("yield") == table("yield 1; yield; yield 1")
