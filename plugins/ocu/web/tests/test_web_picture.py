"""A run folded from its records: what elements show, and what is commanded."""

from collections.abc import Iterable
from typing import Any

import pytest
from m2pem_plugin_web.live.picture import NEWEST, Picture

from m2pem.api import BehaviorState, RunStatus, RunSummary, StampedRecord
from m2pem.api import records as r

P = "Process"


def folded(*records: Any, every_s: float = 1.0) -> Picture:
    """The picture after records, one a second."""
    picture = Picture(RunSummary("r1", "m.bpmn", "", RunStatus.RUNNING, 0))
    apply(picture, records, every_s)
    return picture


def apply(picture: Picture, records: Iterable[Any], every_s: float = 1.0) -> None:
    for record in records:
        seq = picture.seq + 1
        picture.apply(StampedRecord("r1", seq, seq * every_s, record))


def enter(token: int, element: str, **more: Any) -> r.TokenEntered:
    return r.TokenEntered(token=token, process=P, element=element, scope=1, **more)


def leave(token: int, element: str, outcome: str = "completed", **more: Any) -> r.TokenLeft:
    return r.TokenLeft(
        token=token, process=P, element=element, scope=1, outcome=r.TokenOutcome(outcome), **more
    )


def shown(picture: Picture, element: str) -> tuple[int, int, float, bool, bool]:
    state = picture.elements[P, element].state
    return state.active, state.hits, state.last, state.failed, state.asking


def test_tokens_are_counted_as_they_come_and_go() -> None:
    picture = folded(enter(1, "A"), enter(2, "A"), leave(1, "A"))
    assert shown(picture, "A") == (1, 2, 3.0, False, False)
    assert picture.seq == 3


def test_an_element_has_failed_until_it_is_entered_again() -> None:
    picture = folded(enter(1, "A"), leave(1, "A", "failed"))
    assert shown(picture, "A") == (0, 1, 2.0, True, False)
    apply(picture, [enter(2, "A")])
    assert shown(picture, "A") == (1, 2, 3.0, False, False)


def test_of_a_loop_its_instances_are_counted_and_not_what_waits_around_them() -> None:
    opened = r.ScopeOpened(scope=2, process=P, element="A", parent=1, token=1, instances=2)
    picture = folded(enter(1, "A"), opened, enter(2, "A", instance=0), enter(3, "A", instance=1))
    assert shown(picture, "A")[:2] == (2, 2)
    apply(picture, [leave(2, "A", instance=0), leave(3, "A", instance=1), leave(1, "A")])
    assert shown(picture, "A")[:2] == (0, 2)


def test_a_subprocess_is_active_while_its_scope_is() -> None:
    opened = r.ScopeOpened(scope=2, process=P, element="Sub", parent=1, token=1)
    picture = folded(enter(1, "Sub"), opened, enter(2, "Inner"))
    assert shown(picture, "Sub")[:2] == (1, 1)


def asks(prompt: str, element: str = "A") -> r.PromptOpened:
    return r.PromptOpened(
        token=1, process=P, element=element, scope=1, prompt=prompt, text="?", decisions=()
    )


def answers(prompt: str, element: str = "A") -> r.PromptAnswered:
    return r.PromptAnswered(
        token=1, process=P, element=element, scope=1, prompt=prompt, decision="go", by="anna"
    )


def test_an_element_asks_while_one_of_its_prompts_stands() -> None:
    picture = folded(enter(1, "A"), asks("p1"), asks("p2"), answers("p1"))
    assert shown(picture, "A")[4]
    assert picture.asked == {"p2": (P, "A")}
    apply(picture, [r.PromptWithdrawn(prompt="p2")])
    assert not shown(picture, "A")[4]
    assert picture.asked == {}


def test_behaviors_are_known_from_request_to_end() -> None:
    wanted = r.BehaviorRequested(
        token=1, process=P, element="A", scope=1, behavior="r1.b1", name="goto", type="vehicle",
        resources=("ugv1",), roles={}, parameters={},
    )  # fmt: skip
    picture = folded(enter(1, "A"), wanted)
    assert picture.commands["r1.b1"].resources == ("ugv1",)
    assert picture.commands["r1.b1"].since == 2.0
    picture.dirty_commands.clear()
    ended = r.BehaviorEnded(
        token=1, process=P, element="A", scope=1, behavior="r1.b1",
        state=BehaviorState.SUCCEEDED, code="",
    )  # fmt: skip
    apply(picture, [ended])
    assert picture.commands == {}
    assert picture.dirty_commands == {"r1.b1"}


def test_how_a_run_stands_follows_its_records() -> None:
    picture = folded(r.RunStarted(process=P, started_us=1_000_000))
    assert picture.summary.started_us == 1_000_000
    apply(picture, [r.RunPaused(at_us=3_000_000)])
    assert picture.summary.status is RunStatus.PAUSED
    apply(picture, [r.RunResumed(at_us=13_000_000)])
    assert picture.summary.status is RunStatus.RUNNING
    apply(picture, [r.RunEnded(outcome=r.RunOutcome.STOPPED, detail="enough")])
    summary = picture.counted()
    assert summary.status is RunStatus.STOPPED
    assert (summary.ended_us, summary.detail, summary.records) == (15_000_000, "enough", 4)


def test_when_a_run_has_ended_nothing_is_active() -> None:
    ended = r.RunEnded(outcome=r.RunOutcome.STOPPED, detail="")
    picture = folded(enter(1, "A"), asks("p1"), ended)
    assert shown(picture, "A") == (0, 1, 3.0, False, False)
    assert picture.asked == {}


def test_an_interrupted_run_goes_on_when_it_is_claimed() -> None:
    picture = folded(r.RunStarted(process=P, started_us=1), enter(1, "A"))
    picture.interrupted()
    assert picture.summary.status is RunStatus.INTERRUPTED
    apply(picture, [r.RunClaimed(epoch=2)])
    assert picture.summary.status is RunStatus.RUNNING


def test_only_what_changed_is_made_into_json_again() -> None:
    picture = folded(enter(1, "A"), enter(2, "B"))
    before = picture.encoded((P, "A")), picture.encoded((P, "B"))
    apply(picture, [leave(2, "B")])
    assert picture.encoded((P, "A")) is before[0]
    assert picture.encoded((P, "B")) is not before[1]


@pytest.mark.parametrize("count", [1, NEWEST, NEWEST * 2])
def test_only_the_newest_records_are_kept(count: int) -> None:
    picture = folded(*[r.RunYielded(steps=())] * count)
    assert len(picture.newest) == min(count, NEWEST)
    assert picture.newest[-1].seq == picture.seq == count
