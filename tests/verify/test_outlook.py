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
        (
            '<receiveTask id="next" messageRef="M"><loop>x == 1</loop></receiveTask>',
            "what messages from outside bring",
        ),
        (
            '<intermediateCatchEvent id="next">signal S</intermediateCatchEvent>'
            ' <scriptTask id="later">y = x</scriptTask>',
            "what signals from outside bring",
        ),
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


def test_a_retry_that_fails_again_is_said_beside_another_incident() -> None:
    again = TWO_STOPS.replace("do goto uav1", "throw error X")
    play = Play(mission(again), fleet=stopped(TWO_STOPS, {"z": 0}).fleet).start({"z": 0})
    assert seen(play, "retry") == Outlook(Verdict.MAY_NOT_COMPLETE, "it stops at go: X")


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


def test_a_message_that_brings_nothing_may_come() -> None:
    play = stopped("""
        <startEvent id="start"/> <scriptTask id="go">do goto uav1</scriptTask> <endEvent id="end"/>
        <receiveTask id="next" messageRef="M"/>
        start -> go -> next -> end
    """)
    assert seen(play, "skip") == Outlook(Verdict.COMPLETES)


RACE = """
    <startEvent id="start"/> <endEvent id="end"/> <endEvent id="off">terminate</endEvent>
    <scriptTask id="go">do goto uav1</scriptTask> <userTask id="ask"/> <parallelGateway id="fork"/>
    <scriptTask id="init">late = 0</scriptTask> <scriptTask id="then">early = late</scriptTask>
    <intermediateCatchEvent id="five">timer PT5S</intermediateCatchEvent>
    <intermediateCatchEvent id="other">timer {other}</intermediateCatchEvent>
    <scriptTask id="late">late = 1</scriptTask> <exclusiveGateway id="gate"/>
    start -> init -> go -> fork -> five -> late -> end
    fork -> ask -> then -> other -> gate
    gate -> off if early == late
"""


@pytest.mark.parametrize(
    ("other", "verdict"),
    [("PT4S", Verdict.MAY_NOT_COMPLETE), ("PT6S", Verdict.MAY_NOT_COMPLETE), ("PT0S", "")],
)
def test_an_answer_may_come_so_late_that_timers_are_due_in_the_other_order(
    other: str, verdict: Verdict | str
) -> None:
    """That of 4 s is due behind that of 5 s where the answer comes after a second."""
    found = seen(stopped(RACE.format(other=other)), "skip")
    assert found.verdict is (verdict or Verdict.COMPLETES)


UNDONE = """
    <startEvent id="start"/> <endEvent id="end"/> <scriptTask id="go">do goto uav1</scriptTask>
    <userTask id="ask">ask yes no</userTask>
    <scriptTask id="init">x = 0; user.decision = ''</scriptTask>
    <subProcess id="work"> <startEvent id="s"/> <exclusiveGateway id="which" default="other"/>
      <task id="a"/> <task id="b"/> <scriptTask id="unA" isForCompensation="true">x = 1</scriptTask>
      <scriptTask id="unB" isForCompensation="true">x = 2</scriptTask>
      s -> which -> a if user.decision == 'yes'
      other: which -> b
      a undo unA
      b undo unB
    </subProcess>
    <scriptTask id="forget">user.decision = ''</scriptTask>
    <intermediateThrowEvent id="undo">compensate</intermediateThrowEvent>
    <userTask id="wait"/> <exclusiveGateway id="gate"/>
    start -> init -> go -> ask -> work -> forget -> wait -> undo -> gate
    gate -> end if x == 1
"""


def test_states_that_differ_in_what_will_be_undone_are_two() -> None:
    found = seen(stopped(UNDONE), "skip")
    assert found == Outlook(Verdict.MAY_NOT_COMPLETE, "it stops at gate: NO_FLOW")


def test_what_waits_while_something_is_undone_is_explored() -> None:
    play = stopped("""
        <startEvent id="start"/> <endEvent id="end"/> <scriptTask id="go">do goto uav1</scriptTask>
        <task id="a"/> <userTask id="b" isForCompensation="true"/>
        <intermediateThrowEvent id="undo">compensate</intermediateThrowEvent>
        start -> a -> go -> undo -> end
        a undo b
    """)
    assert seen(play, "skip") == Outlook(Verdict.COMPLETES)


OTHERS = """
    <signal id="S" name="S" m2pem:from="operator"/>
    <process id="MAIN" isExecutable="true">
      <startEvent id="start"/> <scriptTask id="go">do goto uav1</scriptTask> <userTask id="ask"/>
      start -> go -> ask
    </process>
    <process id="OTHER"> <startEvent id="begin">signal S</startEvent>
      <exclusiveGateway id="gate"/> <task id="never"/>
      begin -> gate
      gate -> never if 1 == 2
    </process>
"""


def test_operators_may_begin_another_process_by_their_signal() -> None:
    found = seen(stopped(OTHERS), "skip")
    assert found == Outlook(Verdict.MAY_NOT_COMPLETE, "it stops at gate: NO_FLOW")
    thrown = OTHERS.replace(' m2pem:from="operator"', "")
    assert seen(stopped(thrown), "skip") == Outlook(Verdict.COMPLETES)


def test_an_incident_that_was_open_before_may_be_tried_again_as_well_as_skipped() -> None:
    play = stopped("""
        <startEvent id="start"/> <endEvent id="end"/>
        <parallelGateway id="fork"/> <exclusiveGateway id="gate"/>
        <scriptTask id="go">do goto uav1</scriptTask>
        <scriptTask id="spare">do goto uav2</scriptTask>
        <boundaryEvent id="seen" attachedToRef="spare" cancelActivity="false">signal S
          </boundaryEvent>
        <scriptTask id="init">x = 0</scriptTask> <scriptTask id="one">x = 1</scriptTask>
        <intermediateThrowEvent id="tell">signal S</intermediateThrowEvent>
        <boundaryEvent id="failed" attachedToRef="spare">error BLOCKED</boundaryEvent>
        start -> init -> fork -> go
        fork -> spare -> gate
        failed -> one -> gate
        gate -> end if x == 1
    """).report("spare", FAILED, "OTHER")
    assert seen(play, "skip", incident="go").verdict is Verdict.MAY_NOT_COMPLETE


def test_a_way_to_go_round_beside_an_incident_that_operators_must_decide_about() -> None:
    """It is not known whether the mission completes: operators may move the token of the other."""
    play = stopped(
        TWO_STOPS.replace(
            "start -> fork",
            '<subProcess id="watch" triggeredByEvent="true">'
            '<startEvent id="seen" isInterrupting="false">signal S</startEvent></subProcess>\n'
            "start -> fork",
        ),
        {"z": 0},
    )
    others = Outlook(Verdict.UNKNOWN, "operators must decide about gate, too: NO_FLOW")
    assert seen(play, "skip", incident="go") == others


def test_processes_that_call_themselves_for_long_are_not_known() -> None:
    play = stopped(
        """
        <process id="MAIN" isExecutable="true">
          <startEvent id="start"/> <scriptTask id="go">do goto uav1</scriptTask>
          <callActivity id="call" calledElement="DEEP">in n as n</callActivity>
          start -> go -> call
        </process>
        <process id="DEEP"> <startEvent id="s"/> <exclusiveGateway id="more" default="no"/>
          <scriptTask id="count">n = n + 1</scriptTask> <userTask id="ask"/>
          <callActivity id="again" calledElement="DEEP">in n as n</callActivity>
          s -> count -> more -> again if n < 400
          no: more -> ask
        </process>
    """,
        {"n": 0},
    )
    found = seen(play, "skip")
    assert found == Outlook(Verdict.UNKNOWN, "its subprocesses are too deep in each other")
