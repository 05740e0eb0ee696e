"""Event-based gateways: exclusive, and those that begin a process (clauses 10.6.6, 13.4.4)."""

import pytest

from tests.engine.kit import Play

RACE = """
    <startEvent id="start"/> <eventBasedGateway id="race"/>
    <intermediateCatchEvent id="found">signal S</intermediateCatchEvent>
    <intermediateCatchEvent id="late">timer PT10S</intermediateCatchEvent>
    <receiveTask id="told" messageRef="M"/>
    <task id="a"/> <task id="b"/> <task id="c"/>
    start -> race -> found -> a
    race -> late -> b
    race -> told -> c
"""


def test_the_first_event_decides_and_the_others_are_no_longer_awaited() -> None:
    play = Play(RACE).start()
    assert play.at == "race"
    assert play.entered() == "start race"
    assert play.signal("S").entered() == "found a"
    assert play.ended == "completed"
    assert not play.run.state.waits


def test_a_timer_behind_the_gateway_starts_when_the_token_comes() -> None:
    play = Play(RACE).start().advance(9.9)
    assert play.at == "race"
    assert play.advance(0.1).entered() == "start race late b"


def test_a_receive_task_behind_the_gateway_takes_its_message() -> None:
    play = Play(RACE).start()
    assert play.message("M", {"who": "uav1"}).entered() == "start race told c"
    assert play.data == {"who": "uav1"}


def test_a_message_that_came_before_decides_at_once() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="wait"/> <eventBasedGateway id="race"/>
        <receiveTask id="told" messageRef="M"/>
        <intermediateCatchEvent id="late">timer PT10S</intermediateCatchEvent>
        start -> wait -> race -> told
        race -> late
    """).start()
    play.message("M")
    assert play.answer().entered() == "start wait race told"
    assert play.ended == "completed"


def test_each_token_at_the_gateway_waits_for_itself() -> None:
    play = Play("""
        <startEvent id="s1"/> <startEvent id="s2"/> <eventBasedGateway id="race"/>
        <receiveTask id="told" messageRef="M"/>
        <intermediateCatchEvent id="late">timer PT10S</intermediateCatchEvent>
        s1 -> race
        s2 -> race -> told
        race -> late
    """).start()
    assert play.message("M").at == "race"
    assert play.advance(10).ended == "completed"
    assert play.entered() == "s1 s2 race race told late"


def test_a_wrong_timer_behind_the_gateway_is_an_error_there() -> None:
    play = Play(RACE.replace("PT10S", "${when}")).start({"when": True})
    assert play.ended == "failed"
    assert "EXPRESSION" in play.detail


def test_boundary_interruption_ends_the_wait_at_the_gateway() -> None:
    play = Play("""
        <startEvent id="start"/>
        <subProcess id="sub"> <startEvent id="in"/> <eventBasedGateway id="race"/>
          <intermediateCatchEvent id="x">signal X</intermediateCatchEvent>
          <intermediateCatchEvent id="y">signal Y</intermediateCatchEvent>
          in -> race -> x
          race -> y
        </subProcess>
        <boundaryEvent id="stop" attachedToRef="sub">signal STOP</boundaryEvent>
        start -> sub
    """).start()
    play.signal("STOP")
    assert play.ended == "completed"
    assert not play.run.state.waits


# --- that begin a process -----------------------------------------------------------------------

MAIN = """
    <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <userTask id="wait"/>
      start -> wait
    </process>
"""
BEGINS = """
    <process id="OTHER"> <eventBasedGateway id="first" instantiate="true" {kind}/>
      <receiveTask id="a" messageRef="A"/>
      <intermediateCatchEvent id="b">message B</intermediateCatchEvent>
      <task id="a2"/> <task id="b2"/>
      first -> a -> a2
      first -> b -> b2
    </process>
"""


def test_an_instantiating_gateway_makes_an_instance_for_each_event() -> None:
    play = Play(MAIN + BEGINS.format(kind="")).start()
    assert play.message("A").message("B").message("B").answer().ended == "completed"
    assert play.entered() == "start wait first a a2 first b b2 first b b2"


def test_a_parallel_one_waits_in_its_instance_for_the_other_events() -> None:
    kind = 'eventGatewayType="Parallel"'
    play = Play(MAIN + BEGINS.format(kind=kind)).start()
    assert play.message("B").entered() == "start wait first b b2"
    assert play.at == "wait first"
    assert play.message("A").entered() == "a a2"
    assert play.at == "wait"
    assert play.message("A").entered() == "first a a2"
    assert play.message("B").answer().ended == "completed"


@pytest.mark.parametrize("order", ["AB", "BA"])
def test_the_process_a_run_begins_with_waits_at_a_parallel_one_for_all(order: str) -> None:
    text = BEGINS.format(kind='eventGatewayType="Parallel"').replace(
        'id="OTHER"', 'id="MAIN" isExecutable="true"'
    )
    play = Play(text).start()
    assert play.at == "first"
    assert play.message(order[0]).at == "first"
    assert play.message(order[1]).ended == "completed"


def test_an_instantiating_receive_task_makes_an_instance_for_each_message() -> None:
    play = Play(
        MAIN
        + """
        <process id="OTHER"> <receiveTask id="got" messageRef="M" instantiate="true"/>
          <userTask id="do"/>
          got -> do
        </process>
        """
    ).start()
    play.message("M", {"n": 1}).message("M", {"n": 2})
    assert play.entered() == "start wait got do got do"
    assert [scope.data for scope in play.run.state.scopes.values()] == [{}, {"n": 1}, {"n": 2}]


def test_an_instantiating_receive_task_of_the_process_a_run_begins_with_waits() -> None:
    play = Play("""
        <receiveTask id="got" messageRef="M" instantiate="true"/> <task id="after"/>
        got -> after
    """).start()
    assert play.at == "got"
    assert play.message("M").entered() == "got after"
