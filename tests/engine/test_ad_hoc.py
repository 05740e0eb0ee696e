"""Ad-hoc subprocesses (clauses 10.3.5 and 13.3.5, table 10.22)."""

import pytest

from m2pem.engine import records as r
from tests.engine.kit import Play


def ad_hoc(attributes: str = "", inside: str = "", after: str = "") -> str:
    return f"""
        <startEvent id="start"/>
        <adHocSubProcess id="look" {attributes}>
          <userTask id="a"/> <userTask id="b"/> <task id="then"/>
          {inside}
          b -> then
        </adHocSubProcess>
        <userTask id="after"/>
        start -> look -> after
        {after}
    """


def until(condition: str) -> str:
    return f"<completionCondition>{condition}</completionCondition>"


def offered(play: Play) -> list[str]:
    """What the operators are asked to choose from."""
    [prompt] = [p for p in play.run.state.prompts.values() if p.token.node.id == "look"]
    return [decision["value"] for decision in prompt.decisions]


def test_operators_choose_what_is_done_how_often_and_when_it_is_enough() -> None:
    play = Play(ad_hoc()).start()
    assert offered(play) == ["a", "b", "complete"]
    assert play.answer("b", prompt="look").entered() == "start look b"
    assert offered(play) == ["a", "complete", "b"]
    assert play.answer(prompt="b").entered() == "then"
    assert play.answer("b", prompt="look").answer(prompt="b").entered() == "b then"
    assert play.answer("complete", prompt="look").at == "after"


def test_several_may_run_at_a_time() -> None:
    play = Play(ad_hoc()).start()
    play.answer("a", prompt="look").answer("b", prompt="look").answer("a", prompt="look")
    assert play.at == "a b a"


def test_completing_cancels_what_is_still_active() -> None:
    play = Play(ad_hoc()).start()
    play.answer("a", prompt="look").answer("complete", prompt="look")
    assert play.at == "after"
    assert "leave a interrupted" in play.trace("leave")


def test_without_cancelling_it_cannot_be_completed_while_something_is_active() -> None:
    play = Play(ad_hoc('cancelRemainingInstances="false"')).start()
    play.answer("a", prompt="look")
    assert offered(play) == ["b", "a"]
    play.answer(prompt="a")
    assert offered(play) == ["b", "complete", "a"]


def test_sequential_asks_only_when_nothing_is_active() -> None:
    play = Play(ad_hoc('ordering="Sequential"')).start()
    play.answer("b", prompt="look")
    assert [p.token.node.id for p in play.run.state.prompts.values()] == ["b"]
    play.answer(prompt="b")
    assert offered(play) == ["a", "complete", "b"]


def test_the_completion_condition_is_asked_after_each_activity_and_cancels_the_rest() -> None:
    play = Play(ad_hoc(inside=until("user.decision == 'found'"))).start()
    assert offered(play) == ["a", "b"]
    play.answer("a", prompt="look").answer("b", prompt="look")
    [prompt] = [p for p in play.run.state.prompts.values() if p.token.node.id == "a"]
    assert prompt.decisions
    text = ad_hoc(inside=until("n > 0") + '<scriptTask id="c">n = 1</scriptTask>')
    play = Play(text).start()
    play.answer("a", prompt="look").answer("c", prompt="look")
    assert play.at == "after"
    assert not any(p.token.node.id == "look" for p in play.run.state.prompts.values())


def test_the_condition_waits_for_the_rest_when_it_must_not_cancel() -> None:
    inside = until("n > 0") + '<scriptTask id="c">n = 1</scriptTask>'
    play = Play(ad_hoc('cancelRemainingInstances="false"', inside)).start()
    play.answer("a", prompt="look").answer("c", prompt="look")
    assert play.at == "a"
    assert [p.token.node.id for p in play.run.state.prompts.values()] == ["a"]
    assert play.answer(prompt="a").at == "after"


def test_an_expression_may_choose_instead_of_operators() -> None:
    play = Play(ad_hoc('m2pem:activeElements="todo"')).start({"todo": ["b", "a", "b"]})
    assert play.at == "b a b"
    play.answer(prompt="a").answer(prompt="b").answer(prompt="b")
    assert play.at == "after"


def test_a_sequential_one_begins_them_one_after_the_other() -> None:
    attributes = 'ordering="Sequential" m2pem:activeElements="todo"'
    play = Play(ad_hoc(attributes)).start({"todo": ["b", "a"]})
    assert play.at == "b"
    assert play.answer().at == "a"
    assert play.answer().at == "after"


@pytest.mark.parametrize("todo", [["b", "then"], "a", None, [1]])
def test_an_expression_that_chooses_what_cannot_begin_is_an_error(todo: object) -> None:
    play = Play(ad_hoc('m2pem:activeElements="todo"')).start({"todo": todo})  # type: ignore[dict-item]
    assert play.ended == "failed"
    assert "that can begin there: a, b" in play.detail


def test_nothing_chosen_completes_at_once() -> None:
    assert Play(ad_hoc('m2pem:activeElements="todo"')).start({"todo": []}).at == "after"


def test_a_boundary_event_ends_it_with_its_prompt() -> None:
    after = """
        <boundaryEvent id="stop" attachedToRef="look">signal S</boundaryEvent> <task id="stopped"/>
        stop -> stopped
    """
    play = Play(ad_hoc(after=after)).start().answer("a", prompt="look").signal("S")
    assert play.ended == "completed"
    assert any(isinstance(each, r.PromptWithdrawn) for each in play.records())


def test_a_wrong_completion_condition_is_an_error_at_the_subprocess() -> None:
    play = Play(ad_hoc(inside=until("1 / n > 0") + '<scriptTask id="c">n = 0</scriptTask>')).start()
    assert play.answer("c", prompt="look").ended == "failed"
    assert "completionCondition of look" in play.detail
