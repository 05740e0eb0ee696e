"""A check ends within its limits, whatever stands in the mission, and says what was too large."""

import itertools
import time
import tracemalloc

import pytest

from m2pem.bpmn import parse_mission
from m2pem.mission.mission import Mission
from m2pem.verify.check import check, search
from m2pem.verify.net import concurrency
from m2pem.verify.net.simplify import simplify
from m2pem.verify.properties.results import Verdict
from m2pem.verify.search.explore import Limits, Stopped, explore
from m2pem.verify.translate import Options, SizeLimit, TooLargeError, translate
from tests.verify.models import branches

SEARCHED = {"no-deadlock", "proper-completion", "can-complete", "no-dead-element", "one-token"}


def mission(body: str) -> Mission:
    """A mission of one process."""
    text = (
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
        ' xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="x">'
        f'<process id="P" isExecutable="true">{body}</process></definitions>'
    )
    return parse_mission(text.encode(), "m.bpmn")


def choice_of(count: int) -> Mission:
    """A gateway with so many conditions that nobody knows anything of."""
    body = ['<startEvent id="s"/><exclusiveGateway id="Which"/><endEvent id="e"/>']
    body.append('<sequenceFlow id="f" sourceRef="s" targetRef="Which"/>')
    body += [
        f'<sequenceFlow id="f{n}" sourceRef="Which" targetRef="e"><conditionExpression>'
        f"unknown.n{n}</conditionExpression></sequenceFlow>"
        for n in range(count)
    ]
    return mission("".join(body))


def row_of(count: int) -> Mission:
    """Works one after the other, each of which may fail and end all."""
    names = ["s", *(f"t{n}" for n in range(count)), "e"]
    tasks = "".join(f'<serviceTask id="{n}" m2pem:class="Work"/>' for n in names[1:-1])
    flows = "".join(
        f'<sequenceFlow id="f{n}" sourceRef="{one}" targetRef="{other}"/>'
        for n, (one, other) in enumerate(itertools.pairwise(names))
    )
    return mission(f'<startEvent id="s"/>{tasks}<endEvent id="e"/>{flows}')


def test_conditions_without_end_leave_a_mission_undecided_and_are_named() -> None:
    report = check(choice_of(30), limits=Limits(seconds=60))
    assert report.verdict is Verdict.UNDECIDED
    assert report.found.stopped is Stopped.TRANSITIONS
    undecided = {each.property for each in report.results if each.verdict is Verdict.UNDECIDED}
    assert undecided >= SEARCHED
    for each in report.results:
        if each.verdict is Verdict.UNDECIDED:
            assert each.covered.startswith("too large to search: ")
            assert each.covered.endswith("while spelling out Which")


def test_what_needs_no_search_is_said_of_a_mission_that_is_too_large() -> None:
    report = check(choice_of(30), limits=Limits(seconds=60))
    held = {each.property for each in report.results if each.verdict is Verdict.HOLDS}
    assert held == {"can-be-triggered", "prompts-have-decisions"}


def test_the_limit_of_time_holds_for_the_context_of_transitions() -> None:
    began = time.monotonic()
    report = check(choice_of(30), limits=Limits(seconds=0.05))
    assert report.found.stopped is Stopped.TIME
    assert time.monotonic() - began < 60  # without the limit: for ever
    assert "while spelling out Which" in report.results[0].covered


def test_no_more_transitions_are_made_than_fit_into_memory() -> None:
    with pytest.raises(TooLargeError, match="more than 100 transitions"):
        translate(row_of(200), size_limit=SizeLimit(most_transitions=100))
    report = check(row_of(2_000), limits=Limits(memory_mb=1))
    assert report.found.stopped is Stopped.TRANSITIONS


def test_a_long_row_of_works_that_may_fail_is_decided() -> None:
    report = check(
        row_of(400), options=Options(service_writes={"Work": ()}), limits=Limits(seconds=60)
    )
    assert report.found.complete
    assert {each.property for each in report.results if each.verdict is not Verdict.HOLDS} == {
        "failures-handled"
    }


@pytest.mark.parametrize("proven", [True, False])
def test_the_limit_of_time_holds_for_context_transitions_fewer(
    proven: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not proven:
        monkeypatch.setattr(concurrency, "MOST_PLACES", 0)
    net = translate(branches(40))
    with pytest.raises(TooLargeError, match="limit of time"):
        simplify(net, size_limit=SizeLimit(until_s=time.monotonic() - 1))


def test_what_may_fire_in_states_that_wait_counts_as_memory() -> None:
    net = simplify(translate(branches(100)))
    tracemalloc.start()
    try:
        found = explore(net, Limits(states=100_000, memory_mb=20))
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert found.stopped is Stopped.MEMORY
    assert 10e6 < most < 25e6


def test_of_short_time_enough_is_left_for_a_search_that_leaves_orders_out() -> None:
    net = simplify(translate(branches(12)))
    found = search(net, Limits(seconds=20, states=10_000_000))
    assert found.complete
    assert found.reduced
