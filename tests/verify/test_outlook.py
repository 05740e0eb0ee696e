"""Whether a run completes after a choice about an incident: explored from where it is."""

from dataclasses import replace
from typing import Any

import pytest

from m2pem.bpmn import parse_mission
from m2pem.engine import inputs as i
from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.elements import ErrorPolicy
from m2pem.verify.outlook import Outlook, OutlookLimits, Verdict, outlook
from tests.engine.kit import FAILED, Play
from tests.engine.notation import mission, xml

JOINED = """
    <startEvent id="start"/> <endEvent id="end"/> <endEvent id="away"/> <task id="home"/>
    <parallelGateway id="fork"/> <parallelGateway id="join"/>
    <scriptTask id="go">do goto uav1</scriptTask> <scriptTask id="spare">do goto uav2</scriptTask>
    start -> fork -> go -> join -> end
    back: fork -> spare -> join
    home -> away
"""


def stopped(text: str, data: dict[str, Any] | None = None) -> Play:
    parsed = mission(text)
    fleet = replace(fleet_for(parsed), on_error=ErrorPolicy.INCIDENT)
    return Play(parsed, fleet=fleet).start(data).report("go", FAILED)


def seen(play: Play, choice: str, **options: Any) -> Outlook:
    """The outlook of a choice about an incident; the play itself is not changed. `incident`: its
    element, else it is the first one."""
    copied = Play(play.mission, fleet=play.fleet)
    for step in play.steps:
        copied.run.replay(step.records)
    Play.made.remove(copied)
    limits = options.pop("limits", None)
    at = options.pop("incident", "go")
    number = next(e.id for e in play.run.state.incidents.values() if e.token.node.id == at)
    item = i.ResolveIncident(number, i.IncidentChoice(choice), "ops", **options)
    return outlook(copied.run, play.now_us, item, limits)


def test_a_join_that_misses_a_token_cannot_complete() -> None:
    play = stopped(JOINED)
    assert seen(play, "skip") == Outlook(Verdict.COMPLETES)
    assert seen(play, "retry") == Outlook(Verdict.COMPLETES)
    moved = seen(play, "move", to="home")
    assert moved.verdict is Verdict.CANNOT_COMPLETE
    assert "stuck: no token can move from join" in moved.reason
    along = seen(play, "move", to="f3")
    assert along == Outlook(Verdict.COMPLETES)
    assert seen(play, "end").verdict is Verdict.CANNOT_COMPLETE


def test_what_comes_true_for_real_is_what_was_foreseen() -> None:
    play = stopped(JOINED)
    play.resolve("move", to="home").report("spare")
    assert (play.ended, play.detail) == ("failed", "stuck: no token can move from join")


GATE = """
    <startEvent id="start"/> <endEvent id="end"/> <exclusiveGateway id="gate"/>
    <scriptTask id="go">do goto uav1</scriptTask> <userTask id="ask">ask yes no</userTask>
    start -> go -> ask -> gate
    gate -> end if user.decision == 'yes' and speed > 2
"""


def test_a_gateway_that_may_find_no_flow_may_not_complete() -> None:
    found = seen(stopped(GATE, {"speed": 3}), "skip")
    assert found == Outlook(Verdict.MAY_NOT_COMPLETE, "it stops at gate: NO_FLOW")
    slow = seen(stopped(GATE, {"speed": 1}), "skip")
    assert slow == Outlook(Verdict.CANNOT_COMPLETE, "it stops at gate: NO_FLOW")


def test_loops_and_timers_have_few_states() -> None:
    play = stopped("""
        <startEvent id="start"/> <endEvent id="end"/> <exclusiveGateway id="again"/>
        <scriptTask id="go">do goto uav1</scriptTask> <userTask id="ask">ask yes no</userTask>
        <boundaryEvent id="tick" attachedToRef="ask" cancelActivity="false">
          cycle R/PT5S</boundaryEvent>
        <endEvent id="ticked"/>
        start -> go -> ask -> again
        again -> end if user.decision == 'yes'
        again -> go if user.decision == 'no'
        tick -> ticked
    """)
    assert seen(play, "retry") == Outlook(Verdict.COMPLETES)


@pytest.mark.parametrize(
    ("task", "why"),
    [
        ('<serviceTask id="next">call Detector</serviceTask>', "what Detector writes"),
        (
            '<scriptTask id="next">do goto need:requires=true</scriptTask>',
            "chooses its vehicles",
        ),
        ('<receiveTask id="next" messageRef="M"/>', "what messages from outside bring"),
    ],
)
def test_what_the_outside_brings_is_never_called_complete(task: str, why: str) -> None:
    play = stopped(f"""
        <startEvent id="start"/> <scriptTask id="go">do goto uav1</scriptTask> {task}
        <endEvent id="end"/>
        start -> go -> next -> end
    """)
    found = seen(play, "skip")
    assert found.verdict is Verdict.UNKNOWN
    assert why in found.reason


def test_too_many_states_are_not_known() -> None:
    found = seen(stopped(JOINED), "retry", limits=OutlookLimits(states=2))
    assert found == Outlook(Verdict.UNKNOWN, "there are more than 2 states")


def test_a_paused_run_is_looked_at_as_if_it_went_on() -> None:
    assert seen(stopped(JOINED).pause(), "skip") == Outlook(Verdict.COMPLETES)


OUTPUTS = """
    <startEvent id="start"/> <endEvent id="end"/> <dataObject id="all" name="all"/>
    <scriptTask id="init">items = [10, 20]; y = 0</scriptTask>
    <parallelGateway id="fork"/> <parallelGateway id="join"/>
    <scriptTask id="go">do goto uav1</scriptTask>
    <userTask id="each" m2pem:store="q">ask yes no <each m2pem:collection="items"
      m2pem:elementVariable="item" out="all" result="q"></each></userTask>
    start -> init -> fork -> each -> join -> end
    fork -> go -> join
"""


@pytest.mark.parametrize("choice", ["retry", "skip", "end", "move"])
def test_instances_that_collect_outputs_are_explored(choice: str) -> None:
    play = stopped(OUTPUTS)
    play.answer("yes")  # one output is there, by its number
    verdict = Verdict.CANNOT_COMPLETE if choice == "end" else Verdict.COMPLETES
    options = {"to": "f6"} if choice == "move" else {}
    assert seen(play, choice, **options).verdict is verdict


TWO_STOPS = """
    <startEvent id="start"/> <endEvent id="end"/> <exclusiveGateway id="gate"/>
    <parallelGateway id="fork"/> <parallelGateway id="join"/>
    <scriptTask id="go">do goto uav1</scriptTask> <userTask id="ask">ask yes no</userTask>
    start -> fork -> go -> join -> end
    fork -> gate
    ask -> join
    way: gate -> ask if z == 1
"""


def test_another_incident_at_a_gateway_is_for_operators_to_decide() -> None:
    play = stopped(TWO_STOPS, {"z": 0})
    others = Outlook(Verdict.UNKNOWN, "operators must decide about gate, too: NO_FLOW")
    assert seen(play, "skip", incident="go") == others
    assert seen(play, "retry", incident="go") == others
    assert seen(play, "move", incident="gate", to="ask") == Outlook(Verdict.COMPLETES)
    again = seen(play, "retry", incident="gate")
    assert again == Outlook(Verdict.CANNOT_COMPLETE, "it stops at gate: NO_FLOW")
    assert seen(play, "end", incident="go").verdict is Verdict.CANNOT_COMPLETE


def test_a_gateway_is_tried_again_where_its_data_has_become_right() -> None:
    play = stopped(TWO_STOPS, {"z": 0}).resolve("set_data", "gate", data={"z": 1})
    assert seen(play, "skip", incident="go") == Outlook(Verdict.COMPLETES)


UNRECEIVED = """
    <startEvent id="start"/> <endEvent id="end"/> <exclusiveGateway id="again"/>
    <scriptTask id="go">do goto uav1</scriptTask> <userTask id="ask">ask yes no</userTask>
    <intermediateThrowEvent id="tell">message m</intermediateThrowEvent>
    start -> go -> ask -> tell -> again
    again -> ask if user.decision == 'yes'
    again -> end if user.decision != 'yes'
"""


def test_messages_that_nothing_receives_are_no_new_states() -> None:
    assert seen(stopped(UNRECEIVED), "skip") == Outlook(Verdict.COMPLETES)


KEPT_BY_KEY = """
    <process id="P" isExecutable="true">
      <startEvent id="start"/> <scriptTask id="go">do goto uav1</scriptTask>
      <userTask id="ask">ask yes no</userTask> <exclusiveGateway id="gate"/>
      <scriptTask id="right">n = 1</scriptTask> <scriptTask id="wrong">n = 2</scriptTask>
      <intermediateThrowEvent id="send">message M</intermediateThrowEvent>
      <scriptTask id="forget">n = 1; user.decision = ''</scriptTask>
      <scriptTask id="on">do goto uav1</scriptTask>
      <receiveTask id="get" messageRef="M"/> <endEvent id="end"/>
      start -> go -> ask -> gate
      gate -> right if user.decision == 'yes'
      gate -> wrong if user.decision == 'no'
      right -> send
      wrong -> send
      send -> forget -> on -> get -> end
    </process>
"""


def test_states_that_differ_only_in_the_key_of_a_kept_message_are_two() -> None:
    text = xml(KEPT_BY_KEY).replace('<message id="M"', '<message id="M" m2pem:correlationKey="n"')
    parsed = parse_mission(text.encode(), "t.bpmn")
    fleet = replace(fleet_for(parsed), on_error=ErrorPolicy.INCIDENT)
    found = seen(Play(parsed, fleet=fleet).start().report("go", FAILED), "skip")
    assert found == Outlook(Verdict.UNKNOWN, "what messages from outside bring is not known")
