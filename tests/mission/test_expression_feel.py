"""FEEL is that of DMN 1.5, clause 10.3."""

import json
import math
import operator
import os
from collections.abc import Callable
from decimal import Context, Decimal, getcontext
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.expression import parse
from m2pem.mission.expression import temporal as t
from m2pem.mission.expression.operators import MAX_WORK
from m2pem.mission.expression.partial import possible_truth
from tests.seeds import examples

PAIRS = list(pairwise("abcdefghijklmnopqrstuvw"))
CORPORA = os.environ.get("M2PEM_CORPORA", "")
DATA: dict[str, Any] = {
    t.NOW: "2026-11-30T12:00:00Z",
    "armed": True,
    "lap": 3,
    "speed": 2.5,
    "kind": "gpr",
    "areas": ["north", "east"],
    "orders": [{"id": 1, "price": 10}, {"id": 2, "price": 30.5}],
    "vehicle": {"home": {"alt": 7}},
}
TYPES = {"date": t.read_date, "dateTime": t.read_moment, "time": t.read_time}


def value(text: str) -> Any:
    return parse(f"= {text}").evaluate(DATA.get)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0.1 + 0.2", 0.3),
        ("1 / 3 * 3", 1.0),
        ("12345678901234567890 - 12345678901234567889", 1),
        ("-0.1234567890123456789 * 10 ** 19", -1234567890123456789),
        ("1e400 / 1e399", 10),
        ("2 ** 3 ** 2", 64),
        ("-3 ** 2", 9),
        ("1 + /* two */ 2 // three", 3),
        ('"a\\u00e9\\U01F40E\\n"', "aé🐎\n"),
        ("lap + speed", 5.5),
        ("{a b: 1, c-d: a b + 1}.c-d", 2),
        ("{lap: 5, twice: lap * 2}.twice", 10),
        ("vehicle.home.alt", 7),
        ("orders.price", [10, 30.5]),
        ("orders[price > 20].id", [2]),
        ("orders[item.id = 1][1].price", 10),
        ("areas[-1]", "east"),
        ("areas[1] = kind", False),
        ("for a in areas, n in 1..2 return a + string(n)", ["north1", "north2", "east1", "east2"]),
        ("for i in 1..4 return if i < 3 then 1 else partial[-1] + partial[-2]", [1, 1, 2, 3]),
        ('for d in @"2026-02-27"..@"2026-03-01" return d.day', [27, 28, 1]),
        ("for i in 3..1 return i", [3, 2, 1]),
        ('some a in areas, o in orders satisfies o.price > 30 and a = "east"', True),
        ("every o in orders satisfies o.price > 10", False),
        ("lap in (< 2, [3..4])", True),
        ("lap in ]3..5]", False),
        ("[1..3].end included", True),
        ("5 in (> 3)", True),
        ("(function(x, y) x - y)(y: 1, x: 3)", 2),
        ("sort(areas, function(a, b) a < b)", ["east", "north"]),
        ("orders instance of list<context<id: number>>", True),
        ("today() instance of date and time", False),
        ("substring(string: kind, start position: -2)", "pr"),
        ('date("2024-02-29") + duration("P1Y")', "2025-02-28"),
        ('time("23:30:00") + duration("PT1H")', "00:30:00"),
        ('@"2026-07-01T10:00:00@Europe/Berlin"', "2026-07-01T10:00:00+02:00"),
        ('string(@"2026-07-01T10:00:00@Europe/Berlin")', "2026-07-01T10:00:00@Europe/Berlin"),
        ('@"2026-10-25T02:30:00@Europe/Berlin".time offset', "PT2H"),
        ('@"2026-03-01" - @"2026-02-01" = duration("P28D")', True),
        ('years and months duration(@"2024-05-31", @"2026-05-30")', "P1Y11M"),
        ('before(@"2026-01-01", [@"2026-02-01"..@"2026-03-01"])', True),
        ('replace("a1b22", "[0-9]+", "<$0>")', "a<1>b<22>"),
        ('split("a; b;c", ";\\\\s*")', ["a", "b", "c"]),
        ('context put({a: {b: 1}}, ["a", "c"], 2)', {"a": {"b": 1, "c": 2}}),
        ("round half up(2.5, 0) + decimal(2.5, 0)", 5),
        ('string([1, {a: "x"}])', '[1, {a: "x"}]'),
        ("get or else(nothing, lap)", 3),
        ('last day of month(@"2028-02-03")', "2028-02-29"),
        ("distance([38, -77], [38, -77])", 0.0),
        ("max(areas)", "north"),
        ("not(nothing)", None),
        ("nothing and false", False),
        ("nothing or armed", True),
        ("nothing + 1", None),
        ("if nothing then 1 else 2", 2),
        ('lap = "3" or armed', True),
        ("count([1, null])", 2),
    ],
)
def test_an_expression_has_the_value_of_the_standard(text: str, expected: Any) -> None:
    assert repr(value(text)) == repr(expected)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ('lap = "3"', "'=' of the number 3 and the text '3'"),
        ('lap + "3"', "'+' of the number 3 and the text '3'"),
        ("kind < lap", "'<' of the text 'gpr' and the number 3"),
        ("lap and armed", "the number 3 is not true or false"),
        ("areas[7] ", "there is no item 7 of 2"),
        ("kind.length", "the text 'gpr' has no 'length'"),
        ("abs(kind)", "abs() takes a number or a"),
        ("substring(kind)", "substring() of 1 arguments"),
        ("substring(text: kind, start position: 1)", "substring() of"),
        ("modulo(lap, 0)", "modulo() of the number 3, the number 0"),
        ('matches(kind, "(a)\\\\1")', "refers to a group"),
        ('assert(lap, lap > 5, "too few laps")', "too few laps"),
        ('@"2026-02-30"', "is no date, time or duration"),
        ('time("10:00:00.1234567")', "time() of the text"),
        ("9 ** 99999", "'**' of the number 9"),
        ("for i in [3..1] return i", "a range from a higher value to a lower one"),
    ],
)
def test_null_that_comes_of_a_wrong_operation_is_an_error_with_the_first_cause(
    text: str, why: str
) -> None:
    with pytest.raises(ExpressionError) as caught:
        value(text)
    assert "it has no value: " in str(caught.value)
    assert why in str(caught.value)
    with pytest.raises(ExpressionError):
        parse(f"= {text}").holds(DATA.get)


def test_a_condition_of_null_is_false() -> None:
    assert not parse("= not(nothing)").holds(DATA.get)
    assert parse("= nothing or armed").holds(DATA.get)


@pytest.mark.parametrize(
    ("text", "truth"),
    [
        ("not(nothing)", False),
        ("not(nothing) or unknown", None),
        ("not(nothing) and unknown", False),
        ("not(lap = 3) or unknown", None),
        ("lap = 3 or unknown", True),
        ("not(unknown)", None),
        ("if unknown then nothing else lap = 4", False),
    ],
)
def test_a_condition_of_which_a_part_is_known_is_no_more_than_that(
    text: str, truth: bool | None
) -> None:
    known = ("lap", "nothing").__contains__
    assert possible_truth(parse(f"= {text}"), known, DATA.get) is truth


def test_the_names_of_an_expression_are_those_that_it_reads_of_data() -> None:
    text = "= {f: function(a) a + b, g: f(c)}.g + (for x in d, y in x return x + y + e)[item > h]"
    assert parse(text).names == {"b", "c", "d", "e", "h"}
    assert parse("= orders[price > least].id").names == {"orders", "price", "least"}


@pytest.mark.parametrize(
    "text",
    [
        "for a in 1..1000000 return a",
        "for a in 1..1000, b in 1..1000 return 1",
        "{f: function(g) g(g)}.f({f: function(g) g(g)}.f)",
        "some a in 1..1000000 satisfies a < 0",
        "sort(for a in 1..60000 return -a)",
        "{a: [1, 1], " + ", ".join(f"{b}: {{x: {a}, y: {a}}}" for a, b in PAIRS) + "}",
        "duplicate values(for a in 1..50000 return modulo(a, 1400))",
        "list replace(for a in 1..40000 return a, 1, for a in 1..80000 return a)",
        'replace(string join(for a in 1..40000 return "a"), "a", "%s")' % ("$0" * 50),
    ],
)
def test_an_expression_that_looks_at_too_much_is_an_error(text: str) -> None:
    with pytest.raises(ExpressionError, match=f"{MAX_WORK:,} values|deeper than|larger than"):
        value(text)


@pytest.mark.parametrize("text", ["for i in", "{a 1}", "[1, 2", "f(", "a[", "x instance of", "@1"])
def test_what_is_cut_off_is_refused(text: str) -> None:
    with pytest.raises(ExpressionSyntaxError):
        parse(f"= {text}")


def same(wanted: dict[str, Any], found: Any) -> bool:
    kind, written = wanted["t"], wanted["v"]
    if kind == "null" or written is None:
        return found is None
    if kind == "boolean":
        return found is (written == "true")
    if kind == "decimal":
        if isinstance(found, bool | str | None):
            return False
        number = Decimal(written)
        return abs(Decimal(str(found)) - number) <= Decimal("1e-8") * max(1, abs(number))
    if kind == "list":
        return len(found) == len(written) and all(map(same, written, found))
    if kind == "context":
        return found.keys() == written.keys() and all(same(written[k], found[k]) for k in written)
    if kind == "duration":
        return t.read_duration(written) == t.read_duration(found)
    read = TYPES.get(kind)
    return found == written if read is None else t.iso(read(written)) == t.iso(read(found))


@pytest.mark.skipif(not CORPORA, reason="M2PEM_CORPORA names no folder of the tests of DMN")
def test_expressions_have_the_values_of_the_tests_of_the_standard() -> None:
    """dmn-tck, July 2026. Where the standard has null, here is an error that says why."""
    cases = json.loads((Path(CORPORA) / "feel" / "cases.json").read_text(encoding="utf-8"))
    right, wrong = 0, []
    for case in cases:
        try:
            found = value(case["text"])
        except ExpressionSyntaxError:
            continue
        except ExpressionError:
            right += case["exp"]["v"] is None
            continue
        if same(case["exp"], found):
            right += 1
        else:
            wrong.append((case["text"], case["exp"], found))
    assert wrong == []
    assert right >= 0.97 * len(cases)


CONTEXT = Context(prec=34, Emin=-6143, Emax=6144)
SIGNS: dict[str, Callable[[Decimal, Decimal], Any]] = {
    **{"+": CONTEXT.add, "-": CONTEXT.subtract, "*": CONTEXT.multiply, "/": CONTEXT.divide},
    **{"<": operator.lt, "<=": operator.le, "=": operator.eq, "!=": operator.ne},
}
numbers = st.one_of(
    st.sampled_from([0, 1, -3, 2**53, 2**53 + 1, -(2**63), 0.0, 0.1, 2.5, 1e22, 2.0**53]),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False, allow_infinity=False),
)


@settings(max_examples=examples(100, 1000), deadline=None)
@given(numbers, numbers, st.sampled_from([*SIGNS]))
def test_numbers_are_decimals_of_34_digits(a: float, b: float, sign: str) -> None:
    """As Python's decimals compute, of the digits that integers and doubles are written with."""
    try:
        wanted = SIGNS[sign](Decimal(repr(a)), Decimal(repr(b)))
    except ArithmeticError:
        wanted = None
    if isinstance(wanted, Decimal):
        whole = wanted == wanted.to_integral_value() and -(2**63) <= wanted < 2**63
        wanted = int(wanted) if whole else float(wanted)
    for text in (f"= a {sign} b", f"= a {sign} {b!r}", f"= [a][1] {sign} sum(b)"):
        if wanted is None or math.isinf(wanted):
            with pytest.raises(ExpressionError):
                parse(text).evaluate({"a": a, "b": b}.get)
        else:
            found = parse(text).evaluate({"a": a, "b": b}.get)
            assert (found, type(found)) == (wanted, type(wanted))


def test_functions_leave_the_context_of_decimals_as_it_was() -> None:
    before = getcontext()
    assert value("sqrt(2) * sqrt(2)") == 2
    assert value("floor(lap / speed)") == 1
    with pytest.raises(ExpressionError):
        value("sqrt(-1)")
    assert getcontext() is before
