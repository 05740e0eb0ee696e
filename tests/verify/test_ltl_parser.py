import pytest
from hypothesis import given

from m2pem.errors import ExpressionSyntaxError
from m2pem.verify.ltl import parse, show
from m2pem.verify.ltl.formula import (
    Active,
    Always,
    And,
    Commanded,
    Completed,
    Count,
    Data,
    Ended,
    Eventually,
    Formula,
    Iff,
    Implies,
    Not,
    Once,
    Or,
    Since,
    Until,
    WeakUntil,
    walk,
)
from tests.verify import formulas

A, B, C = Active("a"), Active("b"), Completed("c")


@pytest.mark.parametrize(
    ("text", "formula"),
    [
        ("active(a)", A),
        ("completed( 'Drive route' )", Completed("Drive route")),
        ("commanded(evsg2/ptz, zoom)", Commanded("evsg2/ptz", "zoom")),
        ("commanded(uav1)", Commanded("uav1")),
        ("ended", Ended()),
        ("<> ended(failed)", Eventually(Ended("failed"))),
        ("!active(a) && active(b)", And((Not(A), B))),
        ("not active(a) and active(b) or completed(c)", Or((And((Not(A), B)), C))),
        ("active(a) -> active(b) -> completed(c)", Implies(A, Implies(B, C))),
        ("active(a) <-> active(b) || completed(c)", Iff(A, Or((B, C)))),
        ("[]<>active(a)", Always(Eventually(A))),
        ("active(a) U active(b) && completed(c)", And((Until(A, B), C))),
        ("[] active(a) W active(b)", WeakUntil(Always(A), B)),
        ("once active(a) && active(b)", And((Once(A), B))),
        ("!active(a) since completed(c)", Since(Not(A), C)),
        ("count(completed(c), active(a)) >= 2", Count((C, A), ">=", 2)),
        ("(((active(a))))", A),
    ],
)
def test_a_formula_reads_as_people_mean_it(text: str, formula: Formula) -> None:
    assert parse(text) == formula


@pytest.mark.parametrize(
    ("text", "conditions"),
    [
        ("user.decision == 'U W && ||'", ["user.decision == 'U W && ||'"]),
        ("[](speed > 3 -> <> height <= 2.5)", ["speed > 3", "height <= 2.5"]),
        ("(speed + 1) * 2 > 3 && ready", ["(speed + 1) * 2 > 3", "ready"]),
        ("decision in ['go', 'stop'] U !(ready)", ["decision in ['go', 'stop']", "ready"]),
        ("a.b != 1 || lower(name) == 'x'", ["a.b != 1", "lower(name) == 'x'"]),
        ("(speed - 1) -> ready", ["speed - 1", "ready"]),
    ],
)
def test_comparisons_of_data_end_where_the_formula_goes_on(
    text: str, conditions: list[str]
) -> None:
    found = [each for each in walk(parse(text)) if isinstance(each, Data)]
    assert [each.expression.text for each in found] == conditions


@given(formulas.formulas)
def test_what_is_printed_reads_as_the_same_formula(formula: Formula) -> None:
    assert parse(show(formula)) == formula


@pytest.mark.parametrize(
    ("text", "column", "says"),
    [
        ("[](activ(E) -> ended)", 4, "did you mean 'active'?"),
        ("[](finished(E))", 4, "active(E), completed(E), commanded(RESOURCE, BEHAVIOR)"),
        ("[](completed(A) => ended)", 17, "write '->'"),
        ("active(a) & active(b)", 11, "write '&&'"),
        ("~active(a)", 1, "write '!'"),
        ("active(a) U active(b) U active(c)", 23, "do not chain"),
        ("once <> active(a)", 1, "once looks back"),
        ("<> count([]active(a)) > 1", 4, "count looks back"),
        ("(active(a)", 11, "to close '(' at column 1"),
        ("active(", 8, "the id of an element"),
        ("active('a)", 8, "not closed"),
        ("ended(aborted)", 7, "completed, terminated, failed"),
        ("count(active(a))", 17, "expected a bound such as '>= 2'"),
        ("count(active(a)) >= 100000", 21, "counts go up to"),
        ("X active(a)", 1, "no operator X"),
        ("G active(a)", 1, "write '[]'"),
        ("active(a) R active(b)", 11, "there are U, W and since"),
        ("", 1, "expected a formula"),
        ("active(a) &&", 13, "expected a formula"),
        ("speed = 3", 7, "write '=='"),
        ("speed > 'x", 9, "not closed"),
        ("!" * 500 + "ended", 102, "nested deeper"),
        ("(" * 500 + "ended", 101, "nested deeper"),
    ],
)
def test_a_mistake_is_pointed_at(text: str, column: int, says: str) -> None:
    with pytest.raises(ExpressionSyntaxError) as refused:
        parse(text)
    assert says in str(refused.value)
    assert refused.value.position + 1 == column
