"""Findings that do not help are found."""

import dataclasses

import pytest

from m2pem.findings import MAX_SHOWN, Finding, Severity
from tools.corpora.flaws import flaws

DATA = b'<a id="A">\n<b id="B"/>\n<c/><c/>\n</a>'
GOOD = Finding(Severity.ERROR, "m.bpmn", 2, "B", "some-rule", "it is wrong", "correct it")


def changed(**values: object) -> Finding:
    return dataclasses.replace(GOOD, **values)  # type: ignore[arg-type]


def test_a_good_finding_has_no_flaw() -> None:
    assert list(flaws(DATA, "m.bpmn", [GOOD, changed(line=3, element="")])) == []


@pytest.mark.parametrize(
    ("finding", "said"),
    [
        (changed(file="n.bpmn"), "no such file"),
        (changed(line=0), "no such line"),
        (changed(line=5), "no such line"),
        (changed(element="C"), "no such element"),
        (changed(element=""), "the element has an id"),
        (changed(rule="Some rule"), "no rule"),
        (changed(message=" "), "no message"),
        (changed(remedy=""), "no remedy"),
        (changed(rule="x" * 2000), "too long"),
    ],
)
def test_a_flaw_is_named(finding: Finding, said: str) -> None:
    (flaw,) = flaws(DATA, "m.bpmn", [finding])
    assert said in flaw


def test_a_finding_prints_what_it_quotes_on_one_line_of_bounded_length() -> None:
    long = changed(message="one\ntwo " + "x" * 10_000 + " end")
    assert "one two xxx" in str(long)
    assert " ... " in str(long)
    assert str(long).endswith(" end; correct it [some-rule]")
    assert len(str(long)) < MAX_SHOWN + 100
