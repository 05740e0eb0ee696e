"""Findings as they are printed: bounded, and without what would steer a terminal."""

import pytest

from m2pem.errors import MissionError
from m2pem.findings import MAX_OF_A_KIND, Finding, Severity, escaped, lines


def finding(rule: str, message: str = "wrong", element: str = "T") -> Finding:
    return Finding(Severity.WARNING, "m.bpmn", 1, element, rule, message)


@pytest.mark.parametrize(
    ("text", "printed"),
    [
        ("Übergabe 1", "Übergabe 1"),
        ("abort\u202etrobA", "abort\\u202etrobA"),
        ("a\u2066b\u2069", "a\\u2066b\\u2069"),
        ("\x1b[31mred", "\\x1b[31mred"),
        ("\udc80", "\\udc80"),
        ("\u0645\u06cc\u200c\u062e", "\u0645\u06cc\u200c\u062e"),
    ],
)
def test_what_steers_a_terminal_is_escaped(text: str, printed: str) -> None:
    assert escaped(text) == printed


def test_ids_messages_and_files_are_escaped() -> None:
    said = Finding(Severity.ERROR, "m\u202e.bpmn", 1, "T\u202e", "r", "a\u202e", "b\u202e")
    assert "\u202e" not in str(said)
    assert str(said).count("\\u202e") == 4


def test_findings_of_one_rule_are_bounded() -> None:
    many = [finding("many", element=f"T{number}") for number in range(100_000)]
    shown = lines([*many, finding("few")])
    assert len(shown) == MAX_OF_A_KIND + 2
    assert shown[-1] == "... and 99,980 more: warning [many]"


def test_errors_print_their_findings_bounded() -> None:
    error = MissionError("wrong", [finding("many")] * 1000)
    assert len(str(error).splitlines()) == MAX_OF_A_KIND + 2
    assert len(error.findings) == 1000
