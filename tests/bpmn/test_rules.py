"""The registry of rules: numbers, clauses, tests and documentation."""

import re
from collections import Counter
from pathlib import Path

import pytest
import test_rules_activities
import test_rules_attributes
import test_rules_collaboration
import test_rules_compensation
import test_rules_data
import test_rules_definitions
import test_rules_events
import test_rules_sequence_flows
from bpmn_text import around, findings, process, summary

from m2pem.bpmn.pages import rules_page
from m2pem.bpmn.rules.registry import RULES
from m2pem.bpmn.rules.rule import Rule

HERE = Path(__file__).parent
REPOSITORY = HERE.parent.parent
OF_BPMN = [rule for rule in RULES if rule.code[0] == "B"]
OWN = [rule for rule in RULES if rule.code[0] == "M"]
TABLES = (
    test_rules_activities,
    test_rules_collaboration,
    test_rules_compensation,
    test_rules_data,
    test_rules_events,
    test_rules_sequence_flows,
    test_rules_definitions,
    test_rules_attributes,
)
ELSEWHERE = {"no-target-namespace", "unreachable"}
"""BPMN's rules whose tests are no cases: of the root element, and of the whole mission."""


def test_every_rule_of_bpmn_has_a_case() -> None:
    tested = {case.rule for table in TABLES for case in table.CASES}
    assert {rule.slug for rule in OF_BPMN} == tested | ELSEWHERE


@pytest.mark.parametrize("slug", sorted({*ELSEWHERE, *(rule.slug for rule in OWN)}))
def test_every_other_rule_is_tested_by_name(slug: str) -> None:
    tests = [*HERE.glob("test_*.py"), *(HERE.parent / "fleet").glob("test_*.py")]
    assert any(f'"{slug}"' in each.read_text(encoding="utf-8") for each in tests)


def test_there_are_enough_rules() -> None:
    assert len(OF_BPMN) >= 150


def test_numbers_and_names_are_used_once() -> None:
    for counted in (Counter(rule.number for rule in RULES), Counter(rule.slug for rule in RULES)):
        assert [each for each, times in counted.items() if times > 1] == []


@pytest.mark.parametrize("rule", OF_BPMN, ids=lambda rule: rule.slug)
def test_a_number_is_the_section_and_two_digits(rule: Rule) -> None:
    chapter, section = re.fullmatch(r"(\d+)\.(\d+)(?:\.\d+)?", rule.clause).groups()  # type: ignore[union-attr]
    assert rule.number // 100 == int(chapter + section)


def test_every_finding_of_the_readers_has_a_number() -> None:
    unnumbered = {
        each.rule
        for data in (
            around('<task id="T" colour="red"/>'),
            around('<choreographyTask id="T"/>'),
            process(""),
            b"<html/>",
            b"",
        )
        for each in findings(data)
        if not each.number
    }
    assert unnumbered == set()


def test_every_rule_is_used() -> None:
    """Each is named again in the code, beside its declaration."""
    package = REPOSITORY / "m2pem" / "bpmn"
    used = Counter(
        name
        for file in package.rglob("*.py")
        for name in re.findall(
            r"\b[A-Z_]+\b(?! = (?:error|warning|_names_no)\()", file.read_text(encoding="utf-8")
        )
    )
    assert [rule.slug for rule in RULES if not used[rule.slug.upper().replace("-", "_")]] == []


def test_the_docs_list_the_rules_as_they_are() -> None:
    written = (REPOSITORY / "docs" / "rules.md").read_text(encoding="utf-8")
    assert written == rules_page(), "make it anew: python -m m2pem.bpmn.pages rules > docs/rules.md"


def test_what_a_reader_has_said_a_rule_does_not_say_again() -> None:
    data = around('<adHocSubProcess id="T"/>')
    assert [
        rule for rule, _, _ in summary(data) if rule in ("empty-subprocess", "ad-hoc-activities")
    ] == ["empty-subprocess"]


def test_a_deep_and_wide_file_is_checked_in_one_pass() -> None:
    """Enough elements that a search for each would be felt; the time is not measured."""
    tasks = "".join(f'<task id="t{number}" startQuantity="0"/>' for number in range(2000))
    found = findings(process(tasks))
    assert sum(each.rule == "start-quantity" for each in found) == 2000
