"""Gateways without a default: conditions that leave a case out, and those that do not."""

from collections.abc import Sequence
from xml.sax.saxutils import escape

import pytest
from bpmn_text import definitions, load

from m2pem.bpmn.covering_conditions import uncovered_case
from m2pem.bpmn.lint import lint
from m2pem.findings import Finding
from m2pem.mission.expression import parse


@pytest.mark.parametrize(
    "conditions",
    [
        ["hot", "not hot"],
        ["hot == true", "hot == false"],
        ["t < 5", "t >= 5"],
        ["t < -5", "t >= -5 and t < 5", "t >= 5"],
        ["n <= 3", "n >= 4"],
        ["a < b", "a == b", "a > b"],
        ["mode == 'a'", "mode != 'a'"],
        ["mode in ['a', 'b']", "not (mode in ['a', 'b'])"],
        ["x == null", "x != null"],
        ["length(found) > 3", "length(found) <= 3"],
        ["a and b", "not a", "not b"],
        ["true"],
        ["${mode == 'a'}", "${mode != 'a'}"],
    ],
)
def test_complete_conditions(conditions: Sequence[str]) -> None:
    assert uncovered_case([parse(each) for each in conditions], {}) is None


@pytest.mark.parametrize(
    ("conditions", "case"),
    [
        (["hot"], "hot is false"),
        (["t < 5", "t > 5"], "t is 5"),
        (["t < 5", "t >= 6"], "t is 5"),
        (["t < 5", "t > 8"], "t is 5"),
        (["mode == 'a'", "mode == 'b'"], "mode is none of 'a', 'b'"),
        (["mode == 'a'"], "mode is not 'a'"),
        (["hot and wet", "not hot"], "hot is true and wet is false"),
        (["x == 1", "x == true"], "x is false"),
        (["length(found) > 3"], ""),
        (["false"], ""),
    ],
)
def test_a_case_that_is_left_out(conditions: Sequence[str], case: str) -> None:
    assert uncovered_case([parse(each) for each in conditions], {}) == case


def test_known_values_leave_no_other_case() -> None:
    conditions = [parse("mode == 'a'"), parse("mode == 'b'")]
    assert uncovered_case(conditions, {"mode": ("a", "b")}) is None
    assert uncovered_case(conditions, {"mode": ("a", "b", "c")}) == "mode is 'c'"


def test_too_many_cases_are_not_looked_at() -> None:
    assert uncovered_case([parse(" and ".join(f"v{n}" for n in range(20)))], {}) is None


def ask(name: str, *answers: str) -> str:
    decisions = "".join(f'<m2pem:decision value="{each}" label="{each}"/>' for each in answers)
    prompt = f"<m2pem:prompt>What?</m2pem:prompt>{decisions}"
    return f'<userTask id="{name}"><extensionElements>{prompt}</extensionElements></userTask>'


def flow(source: str, target: str, condition: str = "") -> str:
    inside = f"<conditionExpression>{escape(condition)}</conditionExpression>" if condition else ""
    name = f"{source}_{target}"
    ends = f'sourceRef="{source}" targetRef="{target}"'
    return f'<sequenceFlow id="{name}" {ends}>{inside}</sequenceFlow>'


def mission(before: str, *conditions: str, kind: str = "exclusiveGateway", more: str = "") -> bytes:
    """A mission whose gateway G has a flow for each condition; `before` leads to it."""
    ends = "".join(
        f'<endEvent id="E{n}"/>{flow("G", f"E{n}", each)}' for n, each in enumerate(conditions)
    )
    inside = f'<startEvent id="S"/>{before}<{kind} id="G"/>{ends}{more}'
    return definitions(f'<process id="P" isExecutable="true">{inside}</process>')


def incomplete(data: bytes, **known: Sequence[str]) -> list[Finding]:
    return [each for each in lint(load(data), **known) if each.rule == "incomplete-conditions"]


GO, WAIT = "user.decision == 'go'", "user.decision == 'wait'"
ASKED = ask("Ask", "go", "wait") + flow("S", "Ask") + flow("Ask", "G")


@pytest.mark.parametrize("kind", ["exclusiveGateway", "inclusiveGateway"])
def test_a_gateway_that_leaves_an_answer_out(kind: str) -> None:
    (finding,) = incomplete(mission(ASKED, GO, kind=kind))
    assert finding.element == "G"
    assert "for example if user.decision is 'wait'; the run then ends with error NO_FLOW" in (
        finding.message
    )
    assert f'<{kind} id="G" default="G_E0">' in finding.remedy
    assert "m2pem verify" in finding.remedy


def test_a_gateway_that_covers_the_answers_of_the_question_before_it() -> None:
    other = ask("Other", "again") + flow("S", "Other") + flow("Other", "Ask")
    before = ask("Ask", "go", "wait") + other + flow("Ask", "G")
    assert incomplete(mission(before, GO, WAIT)) == []


def test_the_answers_of_every_way_to_the_gateway_count() -> None:
    second = ask("Other", "again") + flow("S", "Other") + flow("Other", "G")
    (finding,) = incomplete(mission(ASKED + second, GO, WAIT))
    assert "user.decision is 'again'" in finding.message


def test_constants_that_a_script_writes_are_all_there_is() -> None:
    script = "<scriptTask id='Set'><script>mode = 'a'</script></scriptTask>"
    before = script + flow("S", "Set") + flow("Set", "G")
    assert incomplete(mission(before, "mode == 'a'")) == []
    (finding,) = incomplete(mission(before, "mode == 'b'"))
    assert "mode is 'a'" in finding.message
    assert incomplete(mission(before, "mode == 'a'"), known_names=["mode"]) != []


def test_an_answer_that_may_come_from_a_part_beside_is_no_finding() -> None:
    beside = ask("Ask", "go", "wait") + flow("S", "Ask") + flow("S", "G")
    assert incomplete(mission(beside, GO)) == []


def test_what_is_counted_in_a_loop_and_set_nowhere_before_it_is_no_finding() -> None:
    """The nodes before the gateway are looked at in another order at each reading."""
    scripts = "".join(
        f"<scriptTask id='Add{n}'><script>n = n + {n}</script></scriptTask>"
        + flow(f"Add{n}", "Join")
        for n in range(4)
    )
    into = "<exclusiveGateway id='Join'/>" + flow("S", "Join") + flow("Join", "G")
    back = "".join(flow("G", f"Add{n}", f"n >= {n}") for n in range(4))
    data = mission(scripts + into, "n > 9", more=back, kind="inclusiveGateway")
    assert [incomplete(data) for _ in range(20)] == [[]] * 20


def test_an_event_that_names_the_error_or_a_default_is_enough() -> None:
    catch = (
        '<subProcess id="On" triggeredByEvent="true"><startEvent id="Caught">'
        '<errorEventDefinition errorRef="err"/></startEvent></subProcess>'
    )
    data = mission(ASKED, GO, more=catch)
    data = data.replace(b"<process ", b'<error id="err" errorCode="NO_FLOW"/><process ', 1)
    assert incomplete(data) == []
    default = mission(ASKED, GO, WAIT).replace(b'id="G"/>', b'id="G" default="G_E1"/>', 1)
    assert incomplete(default) == []
