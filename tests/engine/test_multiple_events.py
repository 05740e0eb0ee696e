"""Events with several definitions: multiple and parallel multiple (clause 10.5.1)."""

import pytest

from tests.engine.kit import Play

S = '<signalEventDefinition signalRef="S"/>'
M = '<messageEventDefinition messageRef="M"/>'
T = "<timerEventDefinition><timeDuration>PT10S</timeDuration></timerEventDefinition>"
BOTH = f"{S}{M}"
PARALLEL = 'parallelMultiple="true"'


def catching(attributes: str = "", definitions: str = BOTH) -> str:
    return f"""
        <startEvent id="start"/>
        <intermediateCatchEvent id="catch" {attributes}>{definitions}</intermediateCatchEvent>
        <task id="after"/>
        start -> catch -> after
    """


def test_any_one_trigger_of_a_multiple_catch_event_is_enough() -> None:
    play = Play(catching(definitions=S + M + T)).start()
    assert play.at == "catch"
    assert play.message("M").ended == "completed"
    assert Play(catching(definitions=S + M + T)).start().signal("S").ended == "completed"
    assert Play(catching(definitions=S + M + T)).start().advance(10).ended == "completed"


@pytest.mark.parametrize("first", ["signal", "message"])
def test_a_parallel_multiple_one_needs_all_in_any_order(first: str) -> None:
    play = Play(catching(PARALLEL)).start()
    give = {"signal": lambda: play.signal("S"), "message": lambda: play.message("M", {"n": 1})}
    give.pop(first)()
    assert play.at == "catch"
    give.popitem()[1]()
    assert play.entered() == "start catch after"
    assert play.data == {"n": 1}


def on(attributes: str) -> str:
    return f"""
        <startEvent id="start"/> <userTask id="work"/>
        <boundaryEvent id="on" attachedToRef="work" {attributes}>{BOTH}</boundaryEvent>
        <task id="then"/>
        start -> work
        on -> then
    """


def test_a_multiple_boundary_event_interrupts_on_any() -> None:
    assert Play(on("")).start().message("M").entered() == "start work on then"


def test_a_multiple_boundary_event_that_does_not_interrupt_catches_each_again() -> None:
    play = Play(on('cancelActivity="false"')).start()
    play.signal("S").signal("S").message("M")
    assert play.entered() == "start work on then on then on then"
    assert play.at == "work"


def test_a_parallel_multiple_boundary_event_interrupts_on_all() -> None:
    play = Play(on(PARALLEL)).start()
    assert play.signal("S").signal("S").at == "work"
    assert play.message("M").entered() == "start work on then"


def test_a_parallel_multiple_boundary_event_catches_all_again() -> None:
    play = Play(on(f'{PARALLEL} cancelActivity="false"')).start()
    assert play.signal("S").message("M").entered() == "start work on then"
    assert play.message("M").at == "work"
    assert play.signal("S").entered() == "on then"


def test_a_multiple_throw_event_throws_everything() -> None:
    play = Play(f"""
        <startEvent id="start"/> <startEvent id="other"/> <userTask id="wait"/>
        <intermediateThrowEvent id="throw">{BOTH}</intermediateThrowEvent>
        <intermediateCatchEvent id="s">signal S</intermediateCatchEvent>
        <receiveTask id="m" messageRef="M"/> <startEvent id="third"/>
        other -> s
        third -> m
        start -> wait -> throw
    """).start()
    assert play.at == "wait s m"
    assert play.answer().ended == "completed"


def test_a_multiple_end_event_terminates_only_after_it_has_thrown_the_rest() -> None:
    play = Play(f"""
        <process id="MAIN" isExecutable="true">
          <startEvent id="start"/>
          <endEvent id="end"><terminateEventDefinition/>{S}{M}</endEvent>
          start -> end
        </process>
        <process id="OTHER"> <startEvent id="told">message M</startEvent> <task id="x"/>
          told -> x
        </process>
    """).start()
    assert play.trace("signal", "message", "end")[-1] == "end terminated"
    assert play.ended == "terminated"
    kinds = [type(record).__name__ for record in play.records()]
    assert kinds.index("SignalThrown") < kinds.index("MessageThrown") < kinds.index("RunEnded")


MAIN = """
    <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <userTask id="wait"/>
      start -> wait
    </process>
"""


def test_each_trigger_of_a_multiple_start_event_makes_an_instance() -> None:
    play = Play(
        MAIN
        + f"""
        <process id="OTHER"> <startEvent id="go">{BOTH}</startEvent> <task id="x"/> go -> x
        </process>
        """.replace(" go -> x", "\n go -> x\n")
    ).start()
    assert play.signal("S").message("M").entered() == "start wait go x go x"


def test_a_parallel_multiple_start_event_makes_one_that_waits_for_the_rest() -> None:
    play = Play(
        MAIN
        + f"""
        <process id="OTHER"> <startEvent id="go" {PARALLEL}>{BOTH}</startEvent> <task id="x"/>
          go -> x
        </process>
        """
    ).start()
    assert play.signal("S").at == "wait go"
    assert play.message("M").entered() == "start wait go x"
    assert play.at == "wait"
