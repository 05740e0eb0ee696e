"""Behaviors and the resources that they hold, from request to release."""

import pytest

from m2pem.engine import records as r
from m2pem.engine.apply import apply
from m2pem.engine.commands import CancelBehavior
from m2pem.engine.inputs import BehaviorReported
from m2pem.mission.catalogue import BehaviorState
from tests.engine.kit import ACCEPTED, CANCELLED, FAILED, RUNNING, SUCCEEDED, Play
from tests.engine.trace import table

DRIVE = '<scriptTask id="{id}">do drive_stop {roles}</scriptTask>'


def two(first: str, second: str) -> Play:
    """Two tasks at once, and what they are allocated to."""
    return Play(f"""
        <startEvent id="start"/> {DRIVE.format(id="one", roles=first)}
        {DRIVE.format(id="two", roles=second)} <userTask id="busy"/>
        <boundaryEvent id="catch" attachedToRef="two">error RESOURCE_UNAVAILABLE</boundaryEvent>
        start -> one
        start -> two
        catch -> busy
    """).start()


# --- holding ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("evsg1", "evsg1"),
        ("evsg1/ptz", "evsg1/ptz"),
        ("team:alpha", "alpha_2"),
        ("alpha_3", "team:alpha"),
        ("evsg1 evsg2", "evsg2 evsg3"),
    ],
)
def test_a_behavior_for_a_held_resource_is_refused_at_once(first: str, second: str) -> None:
    play = two(first, second)
    assert play.at == "one busy"
    error = next(record for record in play.records() if isinstance(record, r.ErrorThrown))
    assert "is held by drive_stop of one (r1.b1)" in error.reason


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("evsg1", "evsg1/ptz"),
        ("evsg1/gpr", "evsg1/ptz"),
        ("evsg1", "evsg2"),
        ("team:alpha", "team:beta"),
        ("evsg1 evsg1", "evsg2"),
    ],
)
def test_vehicles_and_payloads_are_held_apart(first: str, second: str) -> None:
    assert two(first, second).at == "one two"


def test_a_team_holds_its_members_the_lead_first() -> None:
    play = two("team:alpha", "evsg1")
    [first, _] = [x for x in play.records() if isinstance(x, r.BehaviorRequested)]
    assert first.resources == ("alpha_1", "alpha_2", "alpha_3")
    assert first.roles == {"role1": ("alpha_1", "alpha_2", "alpha_3")}


@pytest.mark.parametrize(
    ("state", "code"),
    [(SUCCEEDED, ""), (FAILED, "FAILED"), (BehaviorState.LOST, "LINK_LOST"), (CANCELLED, "FAILED")],
)
def test_the_end_of_a_behavior_releases_its_resources(state: BehaviorState, code: str) -> None:
    play = Play(f"""
        <startEvent id="start"/> {DRIVE.format(id="one", roles="evsg1")}
        {DRIVE.format(id="two", roles="evsg1")}
        <boundaryEvent id="catch" attachedToRef="one">error</boundaryEvent>
        start -> one -> two
        catch -> two
    """).start()
    play.report("one", state)
    assert play.at == "two"
    [ended] = [record for record in play.records() if isinstance(record, r.BehaviorEnded)]
    assert (ended.state, ended.code) == (state, code)
    assert play.orders() == ["start b1 drive_stop evsg1", "start b2 drive_stop evsg1"]


def test_a_success_has_no_error_code_whatever_its_arbiter_says() -> None:
    play = two("evsg1", "evsg2").report("one", SUCCEEDED, "NONSENSE")
    [ended] = [record for record in play.records() if isinstance(record, r.BehaviorEnded)]
    assert ended.code == ""


# --- interrupting -------------------------------------------------------------------------------

INTERRUPTED = """
    <startEvent id="start"/> <scriptTask id="drive">do drive_stop evsg1 evsg2</scriptTask>
    <boundaryEvent id="stop" attachedToRef="drive">signal go</boundaryEvent>
    <scriptTask id="back">do reverse evsg1</scriptTask> <endEvent id="end"/>
    start -> drive -> end
    stop -> back -> end
"""


def test_the_token_moves_at_once_and_the_next_behavior_says_what_it_preempts() -> None:
    play = Play(INTERRUPTED).start()
    play.trace()
    play.orders()
    play.signal("go")
    assert play.trace() == table("""
        signal go; triggered; cancel b1; leave drive interrupted
        enter stop; leave stop; take f3; enter back
        request b2 reverse evsg1 preempts b1
    """)
    assert play.orders() == ["cancel b1", "start b2 reverse evsg1"]
    assert play.run.state.held == {"evsg1": ["r1.b1", "r1.b2"], "evsg2": ["r1.b1"]}


def test_the_vehicle_is_released_when_the_cancelled_behavior_has_ended() -> None:
    play = Play(INTERRUPTED).start()
    play.signal("go").report("b1", CANCELLED)
    assert play.run.state.held == {"evsg1": ["r1.b2"]}
    assert play.at == "back"


@pytest.mark.parametrize("state", [SUCCEEDED, FAILED, BehaviorState.LOST])
def test_however_a_cancelled_behavior_ends_its_task_is_not_affected(state: BehaviorState) -> None:
    play = Play(INTERRUPTED).start()
    play.signal("go").report("b1", state, "ROUTE_BLOCKED")
    assert play.at == "back"
    assert play.report("b2").ended == "completed"


def test_a_run_ends_although_a_cancelled_behavior_has_not() -> None:
    play = Play(INTERRUPTED).start()
    play.signal("go").report("b2")
    assert play.ended == "completed"
    assert list(play.run.state.behaviors) == ["r1.b1"]
    assert play.report("b1", CANCELLED).run.state.held == {}


def test_a_third_behavior_preempts_all_that_still_end() -> None:
    play = Play("""
        <startEvent id="start"/> <scriptTask id="one">do drive_stop evsg1</scriptTask>
        <scriptTask id="two">do reverse evsg1</scriptTask>
        <scriptTask id="three">do drive_stop evsg1</scriptTask>
        <boundaryEvent id="a" attachedToRef="one">signal go</boundaryEvent>
        <boundaryEvent id="b" attachedToRef="two">signal go</boundaryEvent>
        start -> one
        a -> two
        b -> three
    """).start()
    play.signal("go").signal("go")
    assert play.behavior("b3").preempts == ("r1.b1", "r1.b2")


def test_a_behavior_requested_and_cancelled_by_one_input_is_never_started() -> None:
    play = Play("""
        <startEvent id="start"/>
        <subProcess id="sub"> <startEvent id="s"/>
          <scriptTask id="drive">do drive_stop evsg1</scriptTask>
          <intermediateThrowEvent id="pause"/> <endEvent id="throw">error E</endEvent>
          s -> drive
          s -> pause -> throw
        </subProcess>
        <boundaryEvent id="catch" attachedToRef="sub">error</boundaryEvent> <userTask id="u"/>
        start -> sub
        catch -> u
    """).start()
    assert play.orders() == ["cancel b1", "open p1 done"]
    assert play.report("b1", CANCELLED).run.state.held == {}


# --- reports ------------------------------------------------------------------------------------


def test_progress_is_recorded_with_the_arbiters_own_reference() -> None:
    play = two("evsg1", "evsg2")
    play.give(BehaviorReported("r1.b1", 1, ACCEPTED, native_ref="goal-7"))
    play.give(BehaviorReported("r1.b1", 2, RUNNING))
    behavior = play.behavior("b1")
    assert (behavior.state, behavior.number, behavior.native_ref) == (RUNNING, 2, "goal-7")
    assert play.at == "one two"


def test_a_report_whose_number_does_not_rise_is_ignored() -> None:
    play = two("evsg1", "evsg2").report("b1", RUNNING, number=5)
    assert play.report("b1", ACCEPTED, number=5).ignored() == "report 5 of r1.b1 came before"
    assert play.behavior("b1").state is RUNNING


def test_a_report_for_a_behavior_that_has_ended_is_ignored() -> None:
    play = two("evsg1", "evsg2").report("b1")
    play.give(BehaviorReported("r1.b1", 9, FAILED))
    assert play.ignored() == "FAILED for r1.b1, which is not active"


# --- faults of resources ------------------------------------------------------------------------

FAULT = """
    <startEvent id="start"/> <scriptTask id="drive">do formation {roles}</scriptTask>
    <boundaryEvent id="lost" attachedToRef="drive">error LINK_LOST</boundaryEvent>
    <userTask id="u"/>
    start -> drive
    lost -> u
"""


def test_a_fault_of_a_reachable_resource_cancels_its_behavior_and_throws() -> None:
    play = Play(FAULT.format(roles="evsg1")).start()
    play.orders()
    play.fault("evsg1")
    assert play.at == "u"
    assert play.orders() == ["cancel b1", "open p1 done"]
    assert play.run.state.held == {"evsg1": ["r1.b1"]}
    assert play.report("b1", CANCELLED).run.state.held == {}


def test_a_fault_of_an_unreachable_resource_ends_its_behavior_as_lost() -> None:
    play = Play(FAULT.format(roles="evsg1")).start()
    play.orders()
    play.fault("evsg1", reachable=False)
    assert play.at == "u"
    assert play.orders() == ["open p1 done"]
    assert play.run.state.held == {}


def test_an_unreachable_resource_gives_up_what_was_being_cancelled_on_it() -> None:
    play = Play(INTERRUPTED.replace("evsg1 evsg2", "evsg1")).start()
    play.signal("go").fault("evsg1", "BATTERY_LOW", reachable=False)
    assert play.run.state.held == {}
    assert play.ended == "failed"


def test_a_lost_member_ends_a_teams_behavior_and_the_others_are_cancelled() -> None:
    # The others still move: they stay held until they have been brought to a stop.
    play = Play(FAULT.format(roles="team:alpha")).start()
    play.orders()
    play.fault("alpha_2", reachable=False)
    assert play.at == "u"
    assert play.orders() == ["cancel b1", "open p1 done"]
    cancel = next(c for c in play.commands() if isinstance(c, CancelBehavior))
    assert cancel.resources == ("alpha_1", "alpha_2", "alpha_3")
    assert play.report("b1", BehaviorState.LOST).run.state.held == {}


def test_a_lost_member_of_a_cancelled_team_keeps_the_others_held() -> None:
    play = Play(INTERRUPTED).start()
    play.signal("go")
    assert play.fault("evsg2", reachable=False).ignored()
    assert "r1.b1" in play.run.state.behaviors


def test_a_fault_of_a_resource_that_does_nothing_is_ignored() -> None:
    play = two("evsg1", "evsg2")
    assert play.fault("evsg3").ignored() == "LINK_LOST of evsg3, which does nothing for this run"
    assert play.fault("evsg1/ptz").ignored().startswith("LINK_LOST of evsg1/ptz")


def test_a_reachable_resource_whose_behavior_is_being_cancelled_already_is_left_to_it() -> None:
    play = Play(INTERRUPTED).start()
    play.signal("go").report("b2")
    assert play.fault("evsg2").ignored()


def test_a_fault_that_no_event_catches_fails_the_run() -> None:
    play = two("evsg1", "evsg2").fault("evsg1", "BATTERY_LOW")
    assert play.ended == "failed"
    assert "BATTERY_LOW" in play.detail
    assert play.trace("cancel") == ["cancel b1 BATTERY_LOW", "cancel b2"]


COMES_DOWN = """
    <startEvent id="start"/> <scriptTask id="down">do {behavior} evsg1</scriptTask>
    <endEvent id="end"/> {more}
    start -> down -> end
"""
CAUGHT = """
    <boundaryEvent id="low" attachedToRef="down">error BATTERY_LOW</boundaryEvent>
    <userTask id="u"/>
    low -> u
"""


@pytest.mark.parametrize("behavior", ["return_to_launch", "land"])
def test_a_low_battery_does_not_stop_what_brings_the_vehicle_down(behavior: str) -> None:
    play = Play(COMES_DOWN.format(behavior=behavior, more="")).start()
    play.orders()
    ignored = play.fault("evsg1", "BATTERY_LOW").ignored()
    assert ignored == f"BATTERY_LOW of evsg1, which {behavior} brings down"
    assert play.orders() == []
    assert play.report("b1").ended == "completed"


def test_a_mission_may_have_a_return_ended_by_a_low_battery_and_other_faults_end_it() -> None:
    play = Play(COMES_DOWN.format(behavior="return_to_launch", more=CAUGHT)).start()
    assert play.fault("evsg1", "BATTERY_LOW").at == "u"
    play = Play(COMES_DOWN.format(behavior="return_to_launch", more="")).start()
    assert play.fault("evsg1", "LINK_LOST").ended == "failed"


def test_parameters_that_were_adjusted_are_in_the_order_of_their_records() -> None:
    # The same in each process that replays the run, whatever its hashes of strings.
    play = two("evsg1", "evsg2")
    names = [f"p{number}" for number in range(20)]
    behavior = play.behavior("one")
    for some in (names[:12], names[8:]):
        apply(play.run.state, r.BehaviorAdjusted(behavior.id, dict.fromkeys(some, 1)))
    assert behavior.adjusted == tuple(names)
    Play.made.clear()  # no input has led to these records
