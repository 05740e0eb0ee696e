"""Conditions that begin processes, and what they can read (BPMN 2.0.2, table 10.84)."""

from tests.engine.conditional_events import CATCH, handler, writing
from tests.engine.kit import Play


def two(start: str, body: str, extra: str = "") -> str:
    return f"""
        <process id="MAIN" isExecutable="true"> {body} </process>
        <process id="OTHER"> {start} <userTask id="o"/> {extra}
          on -> o
        </process>
    """


ON = '<startEvent id="on">conditional x > 3</startEvent>'


def test_another_process_gets_an_instance_each_time_its_condition_becomes_true() -> None:
    play = Play(two(ON, writing("x = 4", "x = 0"))).start()
    assert play.at == "first"
    assert play.answer(prompt="first").at == "second o"
    play.answer(prompt="second")
    assert play.at == "o third"
    play = Play(two(ON, writing("x = 5; x = 6", "x = 7"))).start({"x": 4})
    assert play.at == "first o"
    play.answer(prompt="first").answer(prompt="second")
    assert play.at == "o third"


def test_its_condition_reads_the_process_that_the_run_began_with() -> None:
    play = Play(two(ON, writing("x = 4"))).start()
    play.answer(prompt="first")
    [instance] = [
        scope for scope in play.run.state.scopes.values() if scope.container.id == "OTHER"
    ]
    assert instance.data == {}


def test_a_condition_is_awaited_as_long_as_that_process_lasts_even_when_that_is_interrupted() -> (
    None
):
    body = writing("y = 1") + handler(
        "y > 0",
        "",
        '<scriptTask id="set2">x = 4</scriptTask><userTask id="hu"/>\nhs -> set2 -> hu\n',
    )
    play = Play(two(ON, body)).start()
    assert play.answer(prompt="first").at == "hu o"
    play.answer(prompt="hu")
    assert not play.run.state.conditions
    assert play.answer(prompt="o").ended == "completed"


def test_a_condition_that_waits_keeps_no_stuck_run_alive() -> None:
    play = Play(two(ON, CATCH.replace("x > 3", "y > 3"))).start()
    assert play.ended == "failed"


def test_at_the_start_of_another_process_it_ends_the_run() -> None:
    play = Play(two(ON.replace("x > 3", "1 / x > 3"), writing())).start({"x": 0})
    assert play.ended == "failed"
    assert "condition of on" in play.detail
