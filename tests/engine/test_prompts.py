"""Prompts: who may answer, what an answer does, and when the question is taken back."""

import pytest

from m2pem.engine.commands import ClosePrompt
from m2pem.engine.inputs import PromptAnswer
from tests.engine.kit import Play
from tests.engine.snapshot import snapshot
from tests.engine.trace import table

ASK = """
    <startEvent id="start"/>
    <userTask id="ask">ask yes no</userTask> <userTask id="other"/> <userTask id="after"/>
    <boundaryEvent id="stop" attachedToRef="ask">signal go</boundaryEvent>
    start -> ask -> after
    start -> other
    stop -> after
"""


def test_the_first_answer_wins_and_the_others_are_told() -> None:
    play = Play(ASK).start()
    play.give(PromptAnswer("p1", "yes", "ann"))
    assert [c for c in play.commands() if isinstance(c, ClosePrompt)] == [
        ClosePrompt("p1", "yes", "ann")
    ]
    before = snapshot(play.run.state)
    play.give(PromptAnswer("p1", "no", "bob"))
    assert play.ignored() == "prompt p1 is not open: it was answered or withdrawn"
    assert snapshot(play.run.state) == before | {"seq": before["seq"] + 1}
    assert play.data["user.decision"] == "yes"


def test_an_unknown_decision_is_ignored_and_the_prompt_stays_open() -> None:
    play = Play(ASK).start()
    play.give(PromptAnswer("p1", "maybe"))
    assert play.ignored() == "'maybe' is no decision of prompt p1: yes, no"
    assert play.answer("no", prompt="p1").at == "other after"


def test_an_answer_to_a_prompt_that_was_never_asked_is_ignored() -> None:
    play = Play(ASK).start().give(PromptAnswer("p7", "yes"))
    assert play.ignored().startswith("prompt p7 is not open")


def test_an_interruption_takes_the_question_back() -> None:
    play = Play(ASK).start()
    play.trace()
    play.orders()
    play.signal("go")
    assert play.trace() == table("""
        signal go; triggered; withdraw p1; leave ask interrupted; enter stop
        leave stop; take f4; enter after; ask p3 after
    """)
    assert play.orders() == ["close p1", "open p3 done"]
    assert play.give(PromptAnswer("p1", "yes")).ignored().startswith("prompt p1 is not open")


TIMED = """
    <startEvent id="start"/> <userTask id="ask"><extensionElements>
      <m2pem:userTask timeout="{timeout}"/></extensionElements></userTask>
    <userTask id="after"/>
    <boundaryEvent id="late" attachedToRef="ask">error {error}</boundaryEvent>
    start -> ask
    late -> after
"""


def test_a_prompt_that_is_not_answered_in_time_throws_prompt_timeout() -> None:
    play = Play(TIMED.format(timeout="PT5M", error="PROMPT_TIMEOUT")).start()
    assert play.advance(299).at == "ask"
    assert play.advance(1).at == "after"
    assert play.orders() == ["open p1 done", "close p1", "open p2 done"]


def test_an_answer_in_time_disarms_the_timeout() -> None:
    play = Play(TIMED.format(timeout="PT5M", error="PROMPT_TIMEOUT")).start()
    play.advance(299).answer()
    assert play.ended == "completed"
    assert play.run.next_due_us is None


def test_a_timeout_that_no_event_catches_fails_the_run() -> None:
    play = Play(TIMED.format(timeout="PT5M", error="OTHER")).start()
    assert play.advance(300).ended == "failed"
    assert play.detail.startswith("error PROMPT_TIMEOUT from ask")


@pytest.mark.parametrize("value", ["soon", True, None, "-1"])
def test_a_timeout_that_is_no_duration_throws_expression(value: object) -> None:
    play = Play(TIMED.format(timeout="${wait}", error="EXPRESSION"))
    assert play.start({"wait": value}).at == "after"  # type: ignore[dict-item]
    assert play.orders() == ["open p1 done"]


def test_a_timeout_may_be_an_expression() -> None:
    play = Play(TIMED.format(timeout="${wait}", error="PROMPT_TIMEOUT")).start({"wait": "PT1S"})
    assert play.advance(1).at == "after"


def test_each_round_of_a_loop_asks_anew() -> None:
    play = Play("""
        <startEvent id="start"/> <exclusiveGateway id="merge"/>
        <userTask id="ask">ask again enough</userTask> <exclusiveGateway id="which"/>
        <endEvent id="end"/>
        start -> merge -> ask -> which
        which -> merge if user.decision == 'again'
        which -> end if user.decision == 'enough'
    """).start()
    assert play.answer("again").orders() == [
        "open p1 again enough",
        "close p1 again",
        "open p2 again enough",
    ]
    assert play.answer("enough").ended == "completed"


def test_a_question_taken_back_by_the_input_that_asked_it_is_never_put() -> None:
    play = Play("""
        <startEvent id="start"/>
        <subProcess id="sub"> <startEvent id="s"/> <userTask id="u"/>
          <serviceTask id="look">call X</serviceTask>
          <intermediateThrowEvent id="pause"/> <endEvent id="throw">error E</endEvent>
          s -> u
          s -> look
          s -> pause -> throw
        </subProcess>
        <boundaryEvent id="catch" attachedToRef="sub">error</boundaryEvent> <endEvent id="end"/>
        start -> sub
        catch -> end
    """).start()
    assert play.trace("ask", "call", "withdraw") == table("""
        ask p1 u; call s1 X; withdraw p1; withdraw s1
    """)
    assert play.orders() == []
