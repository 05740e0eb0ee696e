"""What the instances of a multi-instance activity throw (BPMN 2.0.2, tables 10.29 and 10.30)."""

import pytest

from m2pem.engine import records as r
from tests.engine.kit import Play
from tests.engine.trace import table

MULTI_INSTANCE = "multiInstanceLoopCharacteristics"


def thrown(
    definition: str, attributes: str, *, boundary: str, cancel: str = "false", count: int = 3
) -> Play:
    """A user task with instances that throw; what catches leads to user task `caught`."""
    return Play(f"""
        {definition}
        <process id="MAIN" isExecutable="true">
          <startEvent id="s"/> <userTask id="caught"/> <userTask id="after"/>
          <userTask id="u"><{MULTI_INSTANCE} {attributes}><loopCardinality>{count}</loopCardinality>
          </{MULTI_INSTANCE}></userTask>
          <boundaryEvent id="b" attachedToRef="u" cancelActivity="{cancel}">{boundary}
          </boundaryEvent>
          s -> u -> after
          b -> caught
        </process>
    """).start()


SIGNAL = '<signalEventDefinition id="d" signalRef="S"/>'
NONE = 'behavior="None" noneBehaviorEventRef="d"'
ONE = 'behavior="One" oneBehaviorEventRef="d"'


def test_the_behavior_all_throws_nothing() -> None:
    play = thrown(SIGNAL, "", boundary="signal S")
    for _ in range(3):
        play.answer(prompt="u")
    assert play.at == "after"
    assert not any(isinstance(each, r.SignalThrown) for each in play.records())


def test_the_behavior_none_throws_at_each_completion() -> None:
    play = thrown(SIGNAL, NONE, boundary="signal S")
    play.answer(prompt="u").answer(prompt="u")
    assert play.at == "u caught caught"
    assert play.answer(prompt="u").at == "caught caught after caught"


def test_the_behavior_one_throws_at_the_first_completion() -> None:
    play = thrown(SIGNAL, ONE, boundary="signal S")
    play.answer(prompt="u").answer(prompt="u")
    assert play.at == "u caught"


def test_what_interrupts_ends_the_whole() -> None:
    play = thrown(SIGNAL, ONE, boundary="signal S", cancel="true")
    play.trace()
    assert play.answer(prompt="u").trace("leave", "signal", "close", "enter") == table("""
        leave u; signal S; leave u interrupted; leave u interrupted; close u interrupted
        leave u interrupted; enter b; leave b; enter caught
    """)


@pytest.mark.parametrize(
    ("definition", "boundary", "cancel"),
    [
        ('<messageEventDefinition id="d" messageRef="M"/>', "message M", "true"),
        ('<escalationEventDefinition id="d" escalationRef="X"/>', "escalation X", "true"),
        ('<errorEventDefinition id="d" errorRef="E"/>', "error E", "true"),
        ('<messageEventDefinition id="d" messageRef="M"/>', "message M", "false"),
        ('<escalationEventDefinition id="d" escalationRef="X"/>', "escalation", "false"),
    ],
)
def test_its_own_boundary_events_catch_what_it_throws(
    definition: str, boundary: str, cancel: str
) -> None:
    play = thrown(definition, ONE, boundary=boundary, cancel=cancel)
    play.answer(prompt="u")
    assert play.at == ("caught" if cancel == "true" else "u u caught")


def test_a_message_goes_to_its_own_boundary_event_before_others_who_wait_longer() -> None:
    play = Play(f"""
        <messageEventDefinition id="d" messageRef="M"/>
        <process id="MAIN" isExecutable="true">
          <startEvent id="s"/> <receiveTask id="other" messageRef="M"/> <userTask id="caught"/>
          <task id="late"/>
          <userTask id="u"><{MULTI_INSTANCE} {ONE}><loopCardinality>2</loopCardinality>
          </{MULTI_INSTANCE}></userTask>
          <boundaryEvent id="b" attachedToRef="u">message M</boundaryEvent>
          s -> other
          s -> late -> u
          b -> caught
        </process>
    """).start()
    assert play.answer(prompt="u").at == "other caught"


def test_an_error_that_no_event_catches_fails_the_run() -> None:
    play = thrown('<errorEventDefinition id="d" errorRef="E"/>', ONE, boundary="signal S")
    assert play.answer(prompt="u").ended == "failed"
    assert "error E from u" in play.detail


def test_an_escalation_climbs_to_what_is_around() -> None:
    play = Play(f"""
        <escalationEventDefinition id="d" escalationRef="X"/>
        <process id="MAIN" isExecutable="true">
          <startEvent id="s"/> <userTask id="caught"/>
          <subProcess id="sub">
            <userTask id="u"><{MULTI_INSTANCE} {NONE}><loopCardinality>2</loopCardinality>
            </{MULTI_INSTANCE}></userTask>
          </subProcess>
          <boundaryEvent id="b" attachedToRef="sub">escalation X</boundaryEvent>
          s -> sub
          b -> caught
        </process>
    """).start()
    assert play.answer(prompt="u").at == "caught"


COMPLEX = f"""
    <process id="MAIN" isExecutable="true">
      <startEvent id="s"/> <userTask id="many"/> <userTask id="last"/> <userTask id="after"/>
      <userTask id="u"><{MULTI_INSTANCE} behavior="Complex"><loopCardinality>4</loopCardinality>
        <complexBehaviorDefinition><condition>numberOfCompletedInstances >= 2</condition>
          <event id="two"><signalEventDefinition signalRef="TWO"/></event>
        </complexBehaviorDefinition>
        <complexBehaviorDefinition><condition>{{condition}}</condition>
          <event id="none"><escalationEventDefinition escalationRef="LAST"/></event>
        </complexBehaviorDefinition>
      </{MULTI_INSTANCE}></userTask>
      <boundaryEvent id="b1" attachedToRef="u" cancelActivity="false">signal TWO</boundaryEvent>
      <boundaryEvent id="b2" attachedToRef="u">escalation LAST</boundaryEvent>
      s -> u -> after
      b1 -> many
      b2 -> last
    </process>
"""


def test_complex_behavior_throws_what_its_conditions_say() -> None:
    play = Play(COMPLEX.format(condition="numberOfActiveInstances == 1")).start()
    assert play.answer(prompt="u").at == "u u u"
    assert play.answer(prompt="u").at == "u u many"
    assert play.answer(prompt="u").at == "many many last"


def test_a_wrong_complex_condition_is_an_error_of_the_activity() -> None:
    play = Play(COMPLEX.format(condition="1 / 0 > 1")).start()
    assert play.answer(prompt="u").ended == "failed"
    assert "behavior condition of u" in play.detail


def test_without_an_event_it_throws_a_signal_of_its_own_with_its_counts() -> None:
    play = thrown("", 'behavior="None"', boundary="signal")
    play.answer(prompt="u")
    assert play.at == "u u caught"
    assert play.data == {
        "user.decision": "done",
        "numberOfInstances": 3,
        "numberOfActiveInstances": 2,
        "numberOfCompletedInstances": 1,
        "numberOfTerminatedInstances": 0,
    }


def test_an_interrupted_whole_asks_no_completion_condition() -> None:
    play = Play(f"""
        <signalEventDefinition id="d" signalRef="S"/>
        <process id="MAIN" isExecutable="true">
          <startEvent id="s"/> <userTask id="caught"/> <userTask id="after"/>
          <userTask id="u"><{MULTI_INSTANCE} {ONE}><loopCardinality>2</loopCardinality>
            <completionCondition>true</completionCondition>
          </{MULTI_INSTANCE}></userTask>
          <boundaryEvent id="b" attachedToRef="u">signal S</boundaryEvent>
          s -> u -> after
          b -> caught
        </process>
    """).start()
    assert play.answer(prompt="u").at == "caught"


def test_instances_that_wake_each_other_come_one_after_the_other() -> None:
    play = Play(f"""
        <messageEventDefinition id="d" messageRef="M"/>
        <process id="MAIN" isExecutable="true">
          <startEvent id="s"/> <endEvent id="e"/>
          <receiveTask id="t" messageRef="M"><{MULTI_INSTANCE} {NONE}>
            <loopCardinality>2000</loopCardinality></{MULTI_INSTANCE}></receiveTask>
          s -> t -> e
        </process>
    """).start()
    assert play.message("M").ended == "completed"


def test_compensation_undoes_what_was_done_around_while_it_goes_on() -> None:
    play = Play(f"""
        <compensateEventDefinition id="d"/>
        <process id="MAIN" isExecutable="true">
          <startEvent id="s"/> <task id="done"/> <userTask id="undo" isForCompensation="true"/>
          <userTask id="u"><{MULTI_INSTANCE} {ONE}><loopCardinality>2</loopCardinality>
          </{MULTI_INSTANCE}></userTask>
          <boundaryEvent id="b" attachedToRef="done">compensate</boundaryEvent>
          b ~> undo
          s -> done -> u
        </process>
    """).start()
    assert play.answer(prompt="u").at == "u undo"
