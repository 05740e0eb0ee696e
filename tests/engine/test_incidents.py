"""Incidents: errors that no event catches, and what operators do about them."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import pytest

from m2pem.bpmn import parse_mission
from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.inputs import ControlReturned, ControlTaken
from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.elements import ErrorPolicy
from m2pem.mission.mission import Mission
from tests.engine.kit import CANCELLED, FAILED, SUCCEEDED, Play
from tests.engine.notation import mission, xml
from tests.engine.test_random import FEW, LONG_S, graph_run, run_seeds, structured_run
from tests.engine.trace import table
from tests.seeds import seeds_for


def play(text: str | Mission, **options: Any) -> Play:
    """A run whose fleet has `on_error: incident`."""
    parsed = mission(text) if isinstance(text, str) else text
    return Play(parsed, fleet=replace(fleet_for(parsed), on_error=ErrorPolicy.INCIDENT), **options)


PATROL = """
    <startEvent id="start"/> <endEvent id="end"/> <userTask id="other"/> <task id="home"/>
    <scriptTask id="go">do goto uav1 speed=${mission.speed} target=gate</scriptTask>
    <scriptTask id="spare">do goto uav2 target=gate</scriptTask>
    <parallelGateway id="fork"/> <parallelGateway id="join"/>
    start -> fork -> go -> join -> end
    fork -> other -> spare -> join
    home -> end
"""


def failed_patrol() -> Play:
    patrol = play(PATROL).start({"mission.speed": 3})
    patrol.trace()
    patrol.orders()
    return patrol.report("go", FAILED, "ROUTE_BLOCKED")


def test_an_error_that_no_event_catches_stops_its_token_and_nothing_else() -> None:
    patrol = failed_patrol()
    assert patrol.trace() == table("""
        ended b1 FAILED ROUTE_BLOCKED; error ROUTE_BLOCKED; incident i1 ROUTE_BLOCKED uav1
    """)
    assert patrol.orders() == ["hold uav1"]
    assert patrol.at == "go other"
    patrol.answer()
    assert patrol.behavior("spare").resources == ("uav2",)
    incident = patrol.run.state.incidents["r1.i1"]
    assert incident.choices == ("retry", "retry_with", "skip", "set_data", "move", "end")
    assert incident.roles == {"role1": ("uav1",)}


def test_a_retry_evaluates_the_parameters_again() -> None:
    patrol = failed_patrol().resolve("set_data", data={"mission": {"speed": 5}})
    assert "r1.i1" in patrol.run.state.incidents
    patrol.orders()
    patrol.resolve("retry")
    assert patrol.behavior("go").parameters["speed"] == 5
    assert patrol.orders() == ["start b2 goto uav1"]
    assert patrol.run.state.incidents == {}


def test_a_retry_with_another_vehicle_is_for_once() -> None:
    patrol = failed_patrol()
    patrol.orders()
    patrol.resolve("retry_with", roles={"role1": ("uav2",)})
    assert patrol.behavior("go").resources == ("uav2",)
    assert patrol.orders() == ["resume uav1", "start b2 goto uav2"]
    patrol.report("go", FAILED).resolve("retry")
    assert patrol.behavior("go").resources == ("uav1",)


def test_a_skipped_task_counts_as_completed() -> None:
    patrol = failed_patrol()
    patrol.orders()
    patrol.resolve("skip")
    assert patrol.orders() == ["resume uav1"]
    patrol.answer().report("spare", SUCCEEDED)
    assert patrol.ended == "completed"


def test_a_token_moves_to_another_element_or_along_a_flow_to_a_join() -> None:
    patrol = failed_patrol()
    assert "comes: f3, f7" in patrol.resolve("move", to="join").ignored()
    assert "did you mean 'home'?" in patrol.resolve("move", to="hom").ignored()
    patrol.resolve("move", to="f3")
    assert patrol.at == "other join"
    assert patrol.answer().report("spare", SUCCEEDED).ended == "completed"
    other = failed_patrol().resolve("move", to="home").answer().report("spare", SUCCEEDED)
    assert other.detail == "stuck: no token can move from join"


def test_what_a_task_with_a_greater_priority_takes_is_not_kept() -> None:
    patrol = play(PATROL).start({"mission.speed": 3})
    patrol.orders()
    patrol.give(i.BehaviorPreempted("r1.b1", "uav1", "r2.a1", "for r2"))
    (incident,) = patrol.run.state.incidents.values()
    assert (incident.code, incident.resources) == ("PREEMPTED", ())
    assert patrol.orders() == ["cancel b1"]
    patrol.report("b1", CANCELLED).resolve("skip").answer().report("spare", SUCCEEDED)
    assert patrol.ended == "completed"


def test_the_end_is_what_an_error_does_without_incidents() -> None:
    patrol = failed_patrol().resolve("end")
    plain = Play(PATROL).start().report("go", FAILED, "ROUTE_BLOCKED")
    assert (patrol.ended, patrol.detail) == (plain.ended, plain.detail) != ("", "")


@pytest.mark.parametrize(
    ("choice", "options", "said"),
    [
        ("retry", {"data": {"a": 1}}, "data is only given with set_data"),
        ("set_data", {}, "set_data needs data"),
        ("move", {}, "move needs an element"),
        ("skip", {"to": "home"}, "only given with move"),
        ("retry_with", {}, "needs resources"),
        ("retry_with", {"roles": {"pilot": ("uav2",)}}, "has no role 'pilot'"),
        ("retry_with", {"roles": {"role1": ("uav9",)}}, "the fleet has no 'uav9'"),
        ("move", {"to": "start"}, "cannot move to 'start'"),
    ],
)
def test_a_wrong_choice_changes_nothing_and_says_what_would_be_right(
    choice: str, options: dict[str, Any], said: str
) -> None:
    assert said in failed_patrol().resolve(choice, **options).ignored()


def test_the_first_of_two_operators_wins() -> None:
    patrol = failed_patrol().resolve("skip")
    item = i.ResolveIncident("r1.i1", i.IncidentChoice.RETRY, "ben")
    assert "is not open" in patrol.give(item).ignored()


def test_the_first_of_two_operators_wins_in_a_paused_run() -> None:
    patrol = failed_patrol().pause()
    patrol.resolve("retry_with", roles={"role1": ("uav9",)})
    assert "the fleet has no" in patrol.ignored()
    patrol.resolve("skip")
    assert "was resolved by ops" in patrol.resolve("retry").ignored()
    assert "r1.i1" in patrol.run.state.incidents
    patrol.orders()
    patrol.resume()
    assert patrol.run.state.incidents == {}
    assert patrol.orders() == ["resume uav1"]


def test_what_failed_stays_with_the_run_and_no_other_task_gets_it() -> None:
    patrol = play("""
        <startEvent id="start"/> <userTask id="ask"/> <endEvent id="end"/>
        <scriptTask id="go">do goto uav1 target=gate</scriptTask>
        <scriptTask id="back">do return_to_launch uav1</scriptTask>
        start -> go -> end
        start -> ask -> back -> end
    """).start()
    patrol.report("go", FAILED).answer()
    assert [each.token.node.id for each in patrol.run.state.incidents.values()] == ["go", "back"]
    reason = patrol.run.state.incidents["r1.i2"].reason
    assert reason == "uav1 is held for incident r1.i1"
    patrol.orders()
    patrol.resolve("skip", "go").resolve("retry", "back")
    assert patrol.orders() == ["resume uav1", "start b2 return_to_launch uav1"]


def test_a_boundary_event_that_fires_ends_the_incident() -> None:
    patrol = play("""
        <startEvent id="start"/> <endEvent id="end"/> <userTask id="late"/> <userTask id="beside"/>
        <scriptTask id="go">do goto uav1 target=gate</scriptTask>
        <boundaryEvent id="soon" attachedToRef="go" cancelActivity="false">
          timer PT1S</boundaryEvent>
        <boundaryEvent id="limit" attachedToRef="go">timer PT60S</boundaryEvent>
        start -> go -> end
        soon -> beside
        limit -> late
    """).start()
    patrol.report("go", FAILED).advance(2)
    assert patrol.at == "go beside"
    patrol.orders()
    patrol.advance(60)
    assert patrol.at == "beside late"
    assert "forget i1" in patrol.trace()
    assert patrol.orders()[0] == "resume uav1"


def test_a_retry_does_not_arm_its_boundary_events_again() -> None:
    patrol = play("""
        <startEvent id="start"/> <endEvent id="end"/> <userTask id="late"/>
        <scriptTask id="go">do goto uav1 target=gate</scriptTask>
        <boundaryEvent id="soon" attachedToRef="go" cancelActivity="false">
          timer PT1S</boundaryEvent>
        start -> go -> end
        soon -> late
    """).start()
    patrol.advance(2).report("go", FAILED).resolve("retry").advance(5)
    assert patrol.entered().split().count("soon") == 1
    assert patrol.behavior("go").phase.value == "active"


def test_a_wrong_timer_of_a_boundary_event_is_armed_by_a_retry() -> None:
    patrol = play("""
        <startEvent id="start"/> <endEvent id="end"/> <userTask id="late"/>
        <userTask id="ask"/>
        <boundaryEvent id="first" attachedToRef="ask">signal S</boundaryEvent>
        <boundaryEvent id="limit" attachedToRef="ask">timer ${limit}</boundaryEvent>
        start -> ask -> end
        first -> late
        limit -> late
    """).start()
    assert patrol.run.state.incidents["r1.i1"].code == "EXPRESSION"
    assert not patrol.run.state.waits
    patrol.resolve("set_data", data={"limit": "PT5S"}).resolve("retry")
    assert len(patrol.run.state.waits) == 2
    assert patrol.run.state.prompts
    assert patrol.advance(6).at == "late"


# --- where errors come from -----------------------------------------------------------------------

GATE = """
    <startEvent id="start"/> <exclusiveGateway id="gate"/> <task id="left"/> <task id="right"/>
    start -> gate
    gate -> left if way == 'left'
    gate -> right if 1 / divisor > 0
"""


def test_a_gateway_without_a_true_flow_is_tried_again_with_other_data() -> None:
    stopped = play(GATE).start({"divisor": -1})
    assert [each.code for each in stopped.run.state.incidents.values()] == ["NO_FLOW"]
    assert stopped.run.state.incidents["r1.i1"].choices == ("retry", "set_data", "move", "end")
    stopped.resolve("set_data", data={"way": "left"}).resolve("retry")
    assert stopped.entered().split()[-1] == "left"


def test_the_token_of_a_gateway_can_be_moved_on() -> None:
    stopped = play(GATE).start({"divisor": 0})
    assert stopped.run.state.incidents["r1.i1"].code == "EXPRESSION"
    assert stopped.resolve("move", to="right").ended == "completed"


def test_an_inclusive_join_that_fails_has_its_token_once() -> None:
    stopped = play("""
        <startEvent id="start"/> <inclusiveGateway id="join"/> <task id="a"/> <task id="b"/>
        <endEvent id="end"/>
        start -> a -> join
        start -> b -> join
        join -> end if go
    """).start()
    assert stopped.at == "join"
    assert stopped.resolve("retry").at == "join"
    assert stopped.run.state.last_incident == 2
    assert stopped.resolve("set_data", data={"go": True}).resolve("retry").ended == "completed"


def test_an_error_end_event_can_be_skipped_or_left_but_not_tried_again() -> None:
    ended = play("""
        <startEvent id="start"/> <endEvent id="bad">error E</endEvent> <endEvent id="good"/>
        <task id="other"/>
        start -> bad
        other -> good
    """).start()
    incident = ended.run.state.incidents["r1.i1"]
    assert incident.choices == ("skip", "set_data", "move", "end")
    assert ended.resolve("skip").ended == "completed"


def test_a_prompt_that_timed_out_is_withdrawn_and_asked_again() -> None:
    text = xml("""
        <startEvent id="start"/> <userTask id="ask" m2pem:timeout="PT5S"/> <endEvent id="end"/>
        start -> ask -> end
    """)
    asked = play(parse_mission(text.encode(), "ask.bpmn")).start().advance(6)
    assert asked.run.state.incidents["r1.i1"].code == "PROMPT_TIMEOUT"
    assert not asked.run.state.prompts
    asked.resolve("retry")
    assert list(asked.run.state.prompts) == ["p2"]
    assert asked.advance(6).resolve("skip").ended == "completed"


def test_a_service_that_failed_is_called_again() -> None:
    served = play("""
        <startEvent id="start"/> <serviceTask id="s">call Detector</serviceTask> <endEvent id="e"/>
        start -> s -> e
    """).start()
    served.fail("s", "NO_SENSOR").resolve("retry").complete("s")
    assert served.ended == "completed"


def test_a_catch_event_with_a_wrong_timer_waits_when_it_is_tried_again() -> None:
    waits = play("""
        <startEvent id="start"/> <endEvent id="end"/>
        <intermediateCatchEvent id="wait">timer ${pause}</intermediateCatchEvent>
        start -> wait -> end
    """).start()
    waits.resolve("set_data", data={"pause": "PT5S"}).resolve("retry")
    assert waits.at == "wait"
    assert waits.advance(6).ended == "completed"


def test_an_event_gateway_arms_all_its_events_again() -> None:
    waits = play("""
        <startEvent id="start"/> <endEvent id="end"/> <eventBasedGateway id="either"/>
        <intermediateCatchEvent id="said">signal S</intermediateCatchEvent>
        <intermediateCatchEvent id="wait">timer ${pause}</intermediateCatchEvent>
        start -> either -> said -> end
        either -> wait -> end
    """).start()
    assert not waits.run.state.waits
    waits.resolve("set_data", data={"pause": "PT5S"}).resolve("retry")
    assert len(waits.run.state.waits) == 2
    assert waits.advance(6).ended == "completed"


INSTANCES = """
    <startEvent id="start"/> <endEvent id="end"/>
    <scriptTask id="go">do goto uav1 target=${place}
      <each isSequential="true" m2pem:collection="${places}" m2pem:elementVariable="place"></each>
    </scriptTask>
    start -> go -> end
"""


def test_an_instance_begins_anew_with_its_own_item() -> None:
    rounds = play(INSTANCES).start({"places": ["a", "b"]})
    rounds.report("go", SUCCEEDED).report("go", FAILED)
    incident = rounds.run.state.incidents["r1.i1"]
    assert incident.token.instance == 1
    assert i.IncidentChoice.MOVE not in incident.choices
    rounds.resolve("retry")
    assert rounds.behavior("go").parameters["target"] == "b"
    assert rounds.report("go", SUCCEEDED).ended == "completed"


def test_a_skipped_instance_counts_as_completed() -> None:
    rounds = play(INSTANCES).start({"places": ["a", "b"]}).report("go", FAILED).resolve("skip")
    assert rounds.behavior("go").parameters["target"] == "b"


def test_a_call_that_cannot_pass_its_data_back_begins_anew_or_is_skipped() -> None:
    text = """
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <endEvent id="end"/>
          <callActivity id="call" calledElement="P">in 1 as x, out 1/x as y</callActivity>
          start -> call -> end
        </process>
        <process id="P"> <startEvent id="s"/> <userTask id="u"/>
          <scriptTask id="zero">x = 0</scriptTask>
          s -> u -> zero
        </process>
    """
    called = play(text).start().answer()
    assert called.at == "call"
    assert called.resolve("retry").at == "u"
    assert called.answer().resolve("skip").ended == "completed"


def test_an_error_in_a_called_process_stops_only_its_own_token() -> None:
    called = play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <endEvent id="end"/>
          <callActivity id="call" calledElement="P"/> <userTask id="other"/>
          start -> call -> end
          start -> other
        </process>
        <process id="P"> <startEvent id="s"/> <scriptTask id="bad">throw error E</scriptTask>
          s -> bad
        </process>
    """).start()
    assert called.at == "other bad"
    assert called.resolve("skip").answer().ended == "completed"


def test_an_error_of_a_loop_ends_its_instances_and_holds_what_they_commanded() -> None:
    loop = play("""
        <startEvent id="start"/> <endEvent id="end"/>
        <subProcess id="both"> <each>2 until 1 / zero > 1</each> <startEvent id="s"/>
          <exclusiveGateway id="which"/> <scriptTask id="go">do goto uav1</scriptTask>
          <userTask id="ask"/>
          s -> which
          which -> go if loopCounter == 0
          which -> ask if loopCounter == 1
        </subProcess>
        start -> both -> end
    """).start({"zero": 0})
    loop.orders()
    loop.answer()
    (incident,) = loop.run.state.incidents.values()
    assert (incident.token.node.id, incident.resources) == ("both", ("uav1",))
    assert loop.orders() == ["close p1 done", "cancel b1", "hold uav1"]
    assert loop.at == "both"
    loop.resolve("set_data", data={"zero": 0.5}).resolve("retry")
    assert loop.orders() == ["start b2 goto uav1", "open p2 done"]
    assert loop.answer().ended == "completed"


def test_a_condition_that_cannot_be_evaluated_holds_the_work_of_its_activity() -> None:
    text = """
        <startEvent id="start"/> <endEvent id="end"/> <userTask id="ask"/>
        <scriptTask id="go">do goto uav1 target=gate</scriptTask>
        <boundaryEvent id="low" attachedToRef="go">conditional 1 / level > 2</boundaryEvent>
        start -> go -> end
        start -> ask -> end
        low -> end
    """
    watched = play(text).start({"level": 1})
    watched.orders()
    watched.give(i.ResolveIncident("r1.i1", i.IncidentChoice.RETRY))
    wrong = play(text).start({"level": 0})
    assert wrong.run.state.incidents["r1.i1"].code == "EXPRESSION"
    wrong.answer()  # the data changes: the condition is wrong again, and that is known
    assert wrong.run.state.last_incident == 1


def test_the_process_comes_before_the_fleet_and_the_caller_before_that() -> None:
    text = xml("""
        <process id="MAIN" isExecutable="true" m2pem:onError="MAINSAYS"> <startEvent id="start"/>
          <callActivity id="call" calledElement="P"/>
          start -> call
        </process>
        <process id="P" m2pem:onError="PSAYS"> <startEvent id="s"/>
          <scriptTask id="bad">throw error E</scriptTask>
          s -> bad
        </process>
    """)

    def opens(main: str, called: str, fleet: ErrorPolicy) -> bool:
        said = text
        for word, value in (("MAINSAYS", main), ("PSAYS", called)):
            attribute = f' m2pem:onError="{value}"' if value else ""
            said = said.replace(f' m2pem:onError="{word}"', attribute)
        parsed = parse_mission(said.encode(), "policy.bpmn")
        run = Play(parsed, fleet=replace(fleet_for(parsed), on_error=fleet)).start()
        return bool(run.run.state.incidents)

    assert not opens("", "", ErrorPolicy.END)
    assert opens("", "", ErrorPolicy.INCIDENT)
    assert opens("incident", "", ErrorPolicy.END)
    assert not opens("end", "", ErrorPolicy.INCIDENT)
    assert opens("end", "incident", ErrorPolicy.END)
    assert not opens("incident", "end", ErrorPolicy.INCIDENT)


# --- operators and vehicles -----------------------------------------------------------------------


def test_a_vehicle_that_an_operator_took_is_not_held_until_it_is_given_back() -> None:
    patrol = play(PATROL).start()
    patrol.orders()
    patrol.give(ControlTaken("uav1", "anna"))
    assert patrol.run.state.incidents["r1.i1"].code == "TAKEN_OVER"
    assert patrol.orders() == ["cancel b1"]
    assert "with anna" in patrol.resolve("retry").run.state.incidents["r1.i2"].reason
    again = play(PATROL).start().give(ControlTaken("uav1", "anna"))
    again.orders()
    again.give(ControlReturned("uav1", "anna"))
    assert again.orders() == ["hold uav1"]


def test_a_lost_vehicle_keeps_its_incident() -> None:
    patrol = play(PATROL).start()
    patrol.orders()
    patrol.fault("uav1", reachable=False)
    assert patrol.run.state.incidents["r1.i1"].resources == ("uav1",)
    assert patrol.orders() == ["hold uav1"]


def test_a_stop_ends_an_open_incident() -> None:
    patrol = failed_patrol().stop()
    assert patrol.ended == "stopped"
    assert "forget i1" in patrol.trace()
    assert "while the run is ended" in patrol.resolve("retry", "r1.i1").ignored()


def test_a_run_that_waits_only_for_a_choice_is_not_stuck_and_is_taken_up_as_it_was() -> None:
    alone = play("""
        <startEvent id="start"/> <scriptTask id="go">do goto uav1</scriptTask> <endEvent id="end"/>
        start -> go -> end
    """).start()
    alone.report("go", FAILED)
    assert not alone.ended
    assert [type(each).__name__ for each in alone.run.outstanding()] == ["HoldResource"]
    alone.give(i.GiveUp("nothing is scheduled any more"))
    assert "go (a choice about incident r1.i1: FAILED)" in alone.detail


def test_a_terminate_end_event_ends_an_incident_of_its_scope() -> None:
    patrol = play("""
        <startEvent id="start"/> <userTask id="ask"/> <endEvent id="all">terminate</endEvent>
        <scriptTask id="go">do goto uav1</scriptTask>
        start -> go
        start -> ask -> all
    """).start()
    assert patrol.report("go", FAILED).answer().ended == "terminated"


# --- every error and every choice -----------------------------------------------------------------

REJECTED = BehaviorState.REJECTED
ENDS: dict[str, Any] = {
    "FAILED": lambda p: p.report("go", FAILED),
    "REJECTED": lambda p: p.report("go", REJECTED),
    "TIMEOUT": lambda p: p.report("go", FAILED, "TIMEOUT"),
    "LINK_LOST": lambda p: p.fault("uav1", "LINK_LOST", reachable=False),
    "BATTERY_LOW": lambda p: p.fault("uav1", "BATTERY_LOW"),
    "ROUTE_BLOCKED": lambda p: p.report("go", FAILED, "ROUTE_BLOCKED"),
    "RESOURCE_UNAVAILABLE": lambda p: p.report(
        "go", BehaviorState.REJECTED, "RESOURCE_UNAVAILABLE"
    ),
    "TAKEN_OVER": lambda p: p.give(ControlTaken("uav1", "anna")),
}
CHOICES: dict[str, dict[str, Any]] = {
    "retry": {},
    "retry_with": {"roles": {"role1": ("uav2",)}},
    "skip": {},
    "set_data": {"data": {"x": 1}},
    "move": {"to": "home"},
    "end": {},
}


@pytest.mark.parametrize("choice", CHOICES)
@pytest.mark.parametrize("code", ENDS)
def test_every_error_can_be_answered_with_every_choice(code: str, choice: str) -> None:
    run = play("""
        <startEvent id="start"/> <scriptTask id="go">do goto uav1 target=gate</scriptTask>
        <scriptTask id="spare">do goto uav2</scriptTask> <userTask id="home"/> <endEvent id="end"/>
        start -> go -> home -> end
        home -> spare if false
    """).start()
    ENDS[code](run)
    (incident,) = run.run.state.incidents.values()
    assert (incident.code, incident.resources) == (code, ("uav1",))
    run.resolve(choice, **CHOICES[choice])
    match choice:
        case "retry" if code == "TAKEN_OVER":
            assert [each.code for each in run.run.state.incidents.values()] == [
                "RESOURCE_UNAVAILABLE"
            ]
        case "retry" | "retry_with":
            expected = "uav1" if choice == "retry" else "uav2"
            assert run.behavior("go").resources == (expected,)
        case "set_data":
            assert run.run.state.incidents
            assert run.data["x"] == 1
        case "skip" | "move":
            assert run.at == "home"
        case "end":
            assert run.ended == "failed"
            assert code in run.detail
    for behavior in [each.id for each in run.run.state.behaviors.values()]:
        run.report(behavior.rpartition(".")[2], CANCELLED)
    check_journaled(run)


def check_journaled(run: Play) -> None:
    """Every choice is an input with its operator, and a record of what it did."""
    for step in run.steps:
        if isinstance(step.input, i.ResolveIncident):
            kinds = {type(each) for each in step.records}
            assert kinds & {r.IncidentResolved, r.IncidentUpdated, r.InputIgnored}
            assert step.input.by


# --- random missions ------------------------------------------------------------------------------

RUNS = pytest.mark.parametrize("run", [structured_run, graph_run])


@RUNS
def test_random_choices_about_random_errors_keep_the_laws(run: Callable[..., None]) -> None:
    run_seeds(partial(run, on_error=ErrorPolicy.INCIDENT), range(FEW // 2))


@pytest.mark.long
@pytest.mark.timeout(3600)
@RUNS
def test_many_random_choices_keep_the_laws(run: Callable[..., None]) -> None:
    run_seeds(partial(run, on_error=ErrorPolicy.INCIDENT), seeds_for(LONG_S))
