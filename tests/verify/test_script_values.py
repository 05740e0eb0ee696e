"""Names that scripts write: what cannot be evaluated throws, what is not told apart is no error."""

import pytest

from m2pem.verify.check import Report, check
from m2pem.verify.net.petri_net import Exactness
from m2pem.verify.properties.results import Verdict
from tests.bpmn.bpmn_text import flow
from tests.verify.missions import mission


def counting(script: str, condition: str, before: str = "a = 0") -> Report:
    """Something is written before; a script writes again and again until the condition holds."""
    return check(
        mission(
            '<startEvent id="S"/><endEvent id="E"/><exclusiveGateway id="Again"/>',
            f'<scriptTask id="First" scriptFormat="m2pem"><script>{before}</script></scriptTask>',
            f'<scriptTask id="Count" scriptFormat="m2pem"><script>{script}</script></scriptTask>',
            '<exclusiveGateway id="Enough" default="Enough-Again"/>',
            flow("S", "First"),
            flow("First", "Again"),
            flow("Again", "Count"),
            flow("Count", "Enough"),
            flow("Enough", "Again"),
            '<sequenceFlow id="Enough-E" sourceRef="Enough" targetRef="E">'
            f"<conditionExpression>{condition}</conditionExpression></sequenceFlow>",
        )
    )


def violated(report: Report) -> dict[str, tuple[str, ...]]:
    return {r.property: r.violations[0].elements for r in report.results if r.violations}


def test_a_counter_is_not_stuck_for_values_that_it_never_has() -> None:
    report = counting("a = a + 1", "a &gt;= limit")
    assert report.judged(strict=True) is Verdict.HOLDS
    rough = {a.element: (a.exactness, a.what) for a in report.net.approximations}
    assert rough["Count"] == (Exactness.MORE, "'a' has more values than are distinguished")


def test_a_counter_that_is_followed_value_by_value_is_no_approximation() -> None:
    report = counting("a = 1", "a == 1")
    assert report.judged(strict=True) is Verdict.HOLDS
    assert report.net.approximations == ()


@pytest.mark.parametrize(
    ("before", "script"), [("a = 'x'", "a = a * 2"), ("a = 1", "a = 'x'\na = -a\na = 2")]
)
def test_a_script_that_cannot_be_evaluated_throws(before: str, script: str) -> None:
    report = counting(script, "a == 2", before)
    found = violated(report)
    assert found["errors-caught"] == ("Count",)
    assert "no-deadlock" not in found
    assert "E" in {v.elements[0] for r in report.results for v in r.violations if v.elements}


def test_what_a_condition_reads_of_the_time_is_either_way() -> None:
    report = counting("a = now()", "= now() &gt; date and time(&quot;2026-01-01T00:00:00Z&quot;)")
    assert report.judged(strict=True) is not Verdict.VIOLATED


@pytest.mark.parametrize("variable", ["code", "other"])
def test_the_code_of_a_caught_error_may_be_any(variable: str) -> None:
    """Also where a script writes the same name before: both ends are reached."""
    report = check(
        mission(
            '<startEvent id="S"/><endEvent id="Low"/><endEvent id="E"/><endEvent id="Done"/>',
            '<scriptTask id="T" scriptFormat="m2pem"><script>code = 0\nthrow error LOW</script>'
            '</scriptTask><boundaryEvent id="B" attachedToRef="T"><errorEventDefinition '
            'xmlns:c="http://camunda.org/schema/1.0/bpmn" '
            f'c:errorCodeVariable="{variable}"/></boundaryEvent>',
            '<exclusiveGateway id="G" default="G-E"/>',
            flow("S", "T"),
            flow("T", "Done"),
            flow("B", "G"),
            flow("G", "E"),
            '<sequenceFlow id="G-Low" sourceRef="G" targetRef="Low">'
            "<conditionExpression>code == 'LOW'</conditionExpression></sequenceFlow>",
        )
    )
    dead = {v.elements[0] for r in report.results for v in r.violations if v.elements}
    assert ("Low" in dead) is (variable == "other")
