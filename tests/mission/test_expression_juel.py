"""JUEL coerces values as Jakarta Expression Language says."""

import csv
import json
import os
from pathlib import Path

import pytest

from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.expression import parse
from m2pem.mission.expression.partial import possible_truth

CORPORA = os.environ.get("M2PEM_CORPORA", "")
DATA = {"n": 3, "d": 2.5, "zero": 0, "t": True, "three": "3", "half": "2.5", "yes": "TRUE"}
DATA |= {"a": "a", "blank": "", "list": [1], "neg": -7}
INFINITE = ("Double Infinity", "Double -Infinity", "Double NaN")
READ = {"Boolean": lambda text: text == "true", "Long": int, "Double": float, "String": str}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("three + half", 5.5),
        ("three + n", 6),
        ("three * three", 9),
        ("none + none", 0),
        ("none + n", 3),
        ("blank - n", -3),
        ("n / 2", 1.5),
        ("neg % n", -1),
        ("7 mod d", 2.0),
        ("-three", -3),
        ("-none", 0),
        ("three < 40", True),
        ("half >= 2.5", True),
        ("three == n", True),
        ("none < n", False),
        ("none <= none", True),
        ("none == blank", False),
        ("t == 'true'", True),
        ("t == yes", True),
        ("t != 'yes'", True),
        ("a < 'b'", True),
        ("n / zero > 5", True),
        ("n == n == t", True),
        ("t == n < 4", True),
        ("1 - 2 - 3", -4),
        ("yes ? 'y' : 'n'", "y"),
        ("a ? 'y' : 'n'", "n"),
        ("!a and !blank and empty blank", True),
        ("mod(7, 4) + 7 mod 4", 6),
        ("list == list", True),
        ("a < t", True),
        ("a < not t", False),
        ("a >= not t", True),
        ("'x' < t", False),
        ("t > blank", True),
    ],
)
def test_values_are_coerced(text: str, value: object) -> None:
    assert repr(parse(f"${{{text}}}").evaluate(DATA.get)) == repr(value)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("a + n", "the text 'a' is no whole number"),
        ("a * d", "the text 'a' is no number"),
        ("half == n", "the text '2.5' is no whole number"),
        ("a > n", "the text 'a' is no whole number"),
        ("t + n", "true is no"),
        ("n == t", "true is no"),
        ("!n", "'not' takes true or false"),
        ("n ? 1 : 2", "a condition takes true or false"),
        ("-blank", "not an empty text"),
        ("n / zero", "is not finite"),
        ("n % zero", "divides the number 3 by zero"),
        ("zero / zero == d", "is not a number"),
        ("list < list", "have no order"),
        ("list == a", "is not compared with a text"),
        ("list + 1", "is no"),
        ("9223372036854775807 + 1", "64-bit"),
    ],
)
def test_what_has_no_value_is_an_error(text: str, why: str) -> None:
    with pytest.raises(ExpressionError, match=why):
        parse(f"${{{text}}}").evaluate(DATA.get)


def test_a_condition_is_coerced_also_where_only_a_part_is_known() -> None:
    assert parse("${yes}").holds(DATA.get)
    assert not parse("${a}").holds(DATA.get)
    condition = parse("${yes or other}")
    assert possible_truth(condition, lambda name: name == "yes", DATA.get) is True
    condition = parse("${three > 4 and other}")
    assert possible_truth(condition, lambda name: name == "three", DATA.get) is False


NESTED = Path(__file__).with_name("el_nested.csv")
NESTED_DATA = {
    **{"n3": 3, "n0": 0, "nneg": -7, "d2": 2.5, "d3": 3.0, "big": 9007199254740993},
    **{"bt": True, "bf": False, "s3": "3", "s25": "2.5", "strue": "true", "sa": "a", "sb": "b"},
    **{"se": "", "d": "2026-01-31", "dt": "2026-01-31T12:00:00Z", "l0": [], "l1": [1, 2, 3]},
    **{"ls": ["a", "b"], "m": {"k": 1, "t": "x"}, "m.k": 1, "m.t": "x"},
}


def test_nested_operators_have_the_values_of_tomcat() -> None:
    """Answers of Apache Tomcat 10.1.60; a refusal or an error is never another value."""
    same = errors = 0
    for text, answer in [*csv.reader(NESTED.read_text(encoding="utf-8").splitlines())][1:]:
        kind, _, written = answer.partition(" ")
        try:
            value = parse(text).evaluate(NESTED_DATA.get)
        except (ExpressionError, ExpressionSyntaxError):
            errors += answer != "error" and answer not in INFINITE
            continue
        assert answer != "error", (text, value)
        expected = None if kind == "null" else READ[kind](written)
        assert repr(value) == repr(expected), (text, answer)
        same += 1
    assert same > 300
    assert errors < 0.1 * same


@pytest.mark.skipif(not CORPORA, reason="M2PEM_CORPORA names no folder of Tomcat's answers")
def test_operators_have_the_values_of_tomcat() -> None:
    """Apache Tomcat 10.1.60. What is infinite there, or no number, is an error here."""
    path = Path(CORPORA) / "el" / "cases.json"
    given = json.loads(path.read_text(encoding="utf-8"))
    same = 0
    for text, answer in given["cases"]:
        kind, _, written = answer.partition(" ")
        try:
            value = parse(text).evaluate(given["values"].get)
        except ExpressionError:
            assert kind == "ERR" or answer in INFINITE, text
            continue
        assert kind != "ERR", (text, value)
        assert repr(value) == repr(READ[kind](written)), (text, answer)
        same += 1
    assert same > 900
