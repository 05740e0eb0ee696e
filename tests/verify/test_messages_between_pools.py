"""Processes that talk by messages: what begins, what is kept, and what is one message."""

import itertools

import pytest

from m2pem.bpmn import parse_mission
from m2pem.mission.mission import Mission
from m2pem.verify.check import Report, check
from m2pem.verify.net.petri_net import Exactness
from m2pem.verify.properties.results import Verdict
from m2pem.verify.spin.check import check_with_spin

WORK = (
    '<userTask id="{}"><extensionElements><m2pem:prompt>?</m2pem:prompt>'
    '<m2pem:decision value="ok" label="ok"/></extensionElements></userTask>'
)


def mission(roots: str, pools: str, main: str, other: str) -> Mission:
    """Two processes."""
    text = (
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
        f' xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="x">{roots}{pools}'
        f'<process id="MAIN" isExecutable="true">{main}</process>'
        f'<process id="OTHER">{other}</process></definitions>'
    )
    return parse_mission(text.encode(), "pools.bpmn")


def flows(*names: str) -> str:
    """A row of elements."""
    return "".join(
        f'<sequenceFlow id="{one}~{other}" sourceRef="{one}" targetRef="{other}"/>'
        for one, other in itertools.pairwise(names)
    )


def message(event: str, name: str, ref: str) -> str:
    """An event with a message."""
    definition = f'<messageEventDefinition messageRef="{ref}"/>' if ref else ""
    definition = definition or "<messageEventDefinition/>"
    return f'<{event} id="{name}">{definition}</{event}>'


ORDERED = mission(
    '<message id="Order" m2pem:from="operator"/>',
    "",
    f'<startEvent id="s"/>{WORK.format("t")}<endEvent id="e"/>{flows("s", "t", "e")}',
    message("startEvent", "os", "Order")
    + f'{WORK.format("ot")}<endEvent id="oe"/>{flows("os", "ot", "oe")}',
)
CHATTY = mission(
    '<message id="Order" m2pem:from="operator"/><message id="News"/>',
    "",
    f'<startEvent id="s"/>{WORK.format("t")}'
    + message("intermediateCatchEvent", "hears", "News")
    + f'<endEvent id="e"/>{flows("s", "t", "hears", "e")}',
    message("startEvent", "os", "Order")
    + message("intermediateThrowEvent", "says", "News")
    + f'<endEvent id="oe"/>{flows("os", "says", "oe")}',
)


def not_held(report: Report) -> set[str]:
    """Properties that do not hold."""
    return {each.property for each in report.results if each.verdict is not Verdict.HOLDS}


def test_a_process_that_operators_begin_keeps_no_run_from_its_end() -> None:
    report = check(ORDERED)
    assert report.found.complete
    assert not_held(report) == set()


def test_messages_that_nobody_reads_keep_no_mission_undecided() -> None:
    report = check(CHATTY)
    assert report.found.complete
    assert not_held(report) == set()


def test_a_report_says_that_not_all_messages_are_counted() -> None:
    bounds = [each for each in check(CHATTY).net.approximations if each.element == "MAIN"]
    assert [(each.exactness, each.what) for each in bounds] == [
        (Exactness.BOUNDED, "not all copies of message News that are kept are counted")
    ]


@pytest.mark.parametrize("which", [ORDERED, CHATTY], ids=["ordered", "chatty"])
def test_spin_agrees(which: Mission) -> None:
    report, spins = check(which), check_with_spin(which)
    assert spins.states == report.states
    assert not_held(spins) == not_held(report)


def test_what_comes_to_a_task_and_what_goes_out_of_it_are_two_messages() -> None:
    pools = (
        '<collaboration id="C"><participant id="pm" processRef="MAIN"/>'
        '<participant id="po" processRef="OTHER"/>'
        '<messageFlow id="Asks" sourceRef="ask" targetRef="os"/>'
        '<messageFlow id="Answers" sourceRef="answer" targetRef="ask"/></collaboration>'
    )
    found = mission(
        "",
        pools,
        f'<startEvent id="s"/><task id="ask"/><endEvent id="e"/>{flows("s", "ask", "e")}',
        message("startEvent", "os", "")
        + message("intermediateThrowEvent", "answer", "")
        + f'<endEvent id="oe"/>{flows("os", "answer", "oe")}',
    )
    assert sorted(found.messages) == ["Answers", "Asks"]
