"""The kinds of values that an expression can have."""

import pytest

from m2pem.mission.expression import parse, template
from m2pem.mission.expression.kinds import kinds

DURATIONS = {"days and time duration", "years and months duration"}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("= x", {"boolean", "number", "text", "list", "map"}),
        ("= x + y", {"number", "text"}),
        ("= x * 2", {"number"}),
        ("= duration(x)", DURATIONS),
        ("= duration(x) * y", DURATIONS),
        ("= -duration(x)", DURATIONS),
        ("= now() + x", set()),
        ("= now() + duration(x)", {"date and time"}),
        ("= now() - date(x)", {"days and time duration"}),
        ("= date(x)", {"date"}),
        ('= time(x) + duration("PT1H")', {"time"}),
        ("= time(x) - time(y)", {"days and time duration"}),
        ("= now() - time(x)", set()),
        ("date(x)", {"number"}),
        ("= cycle(x, duration(y))", {"text"}),
        ('= cycle(x, "PT5S")', set()),
        ("= cycle(duration(x), 3)", set()),
        ("= max(duration(x), y)", {"boolean", "number", "text", "list", "map"}),
        ('= date("2026-01-01", 1)', set()),
        ("= for a in x return a", {"list"}),
        ("= abs(now())", set()),
        ("= is defined(null)", {"boolean"}),
        ('= if x then "PT1S" else 5', {"text", "number"}),
        ("= if x then null else now()", {"date and time"}),
        ("= x > 2", {"boolean"}),
        ("= not(x)", {"boolean"}),
        ("= [x]", {"list"}),
        ("PT${x}S", {"text"}),
        ("null", set()),
        ("upper(x)", {"text"}),
        ("length(x)", {"number"}),
        ("is_empty(x)", {"boolean"}),
    ],
)
def test_an_expression_has_only_values_of_its_kinds(text, expected):
    read = template if text.startswith("PT") else parse
    assert kinds(read(text).tree) == expected


def test_arithmetic_that_coerces_gives_numbers():
    assert kinds(parse("${a + 'x'}").tree, coerced=True) == {"number"}
    assert kinds(parse("${a ? -'3' : b * c}").tree, coerced=True) == {"number"}
