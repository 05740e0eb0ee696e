"""An expression that fails names its smallest part that does, where it is, and what it reads."""

import pytest
from hypothesis import given, settings

from m2pem.errors import ExpressionError
from m2pem.mission.expression import Dialect, parse, template
from m2pem.mission.expression import feel_values as feel
from m2pem.mission.expression.cause import place, trace
from m2pem.mission.expression.evaluate import evaluate
from m2pem.mission.expression.operators import MAX_WORK, begin_work
from m2pem.mission.expression.rules import RULES
from m2pem.mission.expression.tree import And, If, Or, children
from tests.mission.test_expression_random import stores, trees, trees_with_calls, write
from tests.seeds import examples

DATA = {"a": "x", "n": 3, "l": [1, "q"], "m": {"k": 2}, "größe": "x"}

FAILING = [
    ("a + 1 > 3", "'a + 1' at column 1 of 'a + 1 > 3', where a is the text 'x'"),
    ("= a + 1 > 3", "'a + 1' at column 3 of '= a + 1 > 3', where a is the text 'x'"),
    ("${a + 1 > 3}", "'a + 1' at column 3 of '${a + 1 > 3}', where a is the text 'x'"),
    ("  = 2 < größe\n", "'2 < größe' at column 3 of '= 2 < größe', where größe is the text 'x'"),
    ("1 / 0", "'1 / 0' at column 1"),
    ("(n) + (a)", "'(n) + (a)' at column 1, where n is the number 3, a is the text 'x'"),
    ("n > 1 and a + n > 2", "'a + n' at column 11 of 'n > 1 and a + n > 2', where a is the"),
    ("n > 5 or not (a == 1)", "'a == 1' at column 15 of 'n > 5 or not (a == 1)', where a is"),
    ("n and true", "'n and true' at column 1, where n is the number 3"),
    ("max(l) > abs(a)", "'max(l)' at column 1 of 'max(l) > abs(a)', where l is a list of 2"),
    ("n > 2 ? a * 2 : 1", "'a * 2' at column 9 of 'n > 2 ? a * 2 : 1', where a is the text 'x'"),
    ("[n, a - n][0]", "'a - n' at column 5 of '[n, a - n][0]', where a is the text 'x', n is"),
    ("${n gt 2 && a.size() + a > 1}", "'a.size() + a' at column 13 of '${n gt 2 && a.size()"),
    ("${var:gt(n, a)}", "'var:gt(n, a)' at column 3 of '${var:gt(n, a)}', where n is"),
    ("bpmn:getDataObject('l') * 2 > 3", "\"bpmn:getDataObject('l') * 2\" at column 1 of"),
    ("= if n > 2 then a * 2 else 1", "'a * 2' at column 17 of '= if n > 2 then a * 2 else 1'"),
    ("= for i in a + 1 return i", "'a + 1' at column 12 of '= for i in a + 1 return i'"),
    ("= sum(for i in l return i + 1) > 3", "'i + 1' at column 25 of '= sum(for i in l"),
    ("= {q: n, r: -a}.r", "'-a' at column 13 of '= {q: n, r: -a}.r', where a is the text 'x'"),
    (
        "= l[item + 1 > 5][1] + 1",
        "'item + 1' at column 5 of '= l[item + 1 > 5][1] + 1', where item",
    ),
    ("= {q: a - 1}.q", "'a - 1' at column 7 of '= {q: a - 1}.q', where a is the text 'x'"),
    ("= n in [1..a]", "'n in [1..a]' at column 3 of '= n in [1..a]', where n is the number 3"),
    ("= (function(x) x + 1)(a)", "'x + 1' at column 16 of '= (function(x) x + 1)(a)', where x is"),
    ("= -(a)", "'-(a)' at column 3 of '= -(a)', where a is the text 'x'"),
    ('= (n + 1) * date("x").day', "'date(\"x\")' at column 13 of '= (n + 1) * date(\"x\").day'"),
]


@pytest.mark.parametrize(("text", "where"), FAILING)
def test_the_error_names_the_smallest_part_its_place_and_what_it_reads(text, where):
    with pytest.raises(ExpressionError) as caught:
        parse(text).evaluate(DATA.get)
    assert f", in {where}" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("a", "a condition takes true or false, not the text 'x', in 'a' at column 1, where a is"),
        ("= a", "a condition takes true or false, not the text 'x', in 'a' at column 3 of '= a'"),
        ("= n > a and unset", "it has no value: '>' of the number 3 and the text 'x', in 'n > a'"),
    ],
)
def test_a_condition_names_what_is_no_truth_and_what_has_no_value(text, error):
    with pytest.raises(ExpressionError) as caught:
        parse(text).holds(DATA.get)
    assert str(caught.value).startswith(error)


def test_a_text_with_parts_names_the_part():
    with pytest.raises(ExpressionError) as caught:
        template("go ${n} ${a * 2}").evaluate(DATA.get)
    assert "in 'a * 2' at column 11 of 'go ${n} ${a * 2}', where a is the" in str(caught.value)


def test_what_is_wrong_beside_the_value_is_no_failure():
    assert parse("= l[item > a - 1]").evaluate(DATA.get) == []
    with pytest.raises(ExpressionError, match=r"^a condition takes true or false, not a list of 0"):
        parse("= l[item > a - 1]").holds(DATA.get)
    assert parse("a - unset - 1").evaluate(DATA.get) is None


def test_a_part_that_reads_a_name_which_is_not_set_says_so():
    with pytest.raises(ExpressionError) as caught:
        parse("n + (unset == null)").evaluate(DATA.get)
    assert str(caught.value).endswith(", where n is the number 3, unset is not set")


def test_beyond_the_bound_of_work_the_whole_is_named_and_the_bound():
    data = {"l": list(range(40_000)), "a": "x"}
    with pytest.raises(ExpressionError, match=r"^it looks at more than 100,000 values, in 'max"):
        parse("max(l) + max(l) + max(l) > 3").evaluate(data.get)


def test_what_finding_the_cause_looks_at_does_not_count():
    begin_work()
    data = {"l": [1] * (MAX_WORK * 2 // 5), "a": "x"}
    with pytest.raises(ExpressionError, match=r"in 'a \+ 1' at"):
        parse("max(l) > 3 or a + 1 > 0").evaluate(data.get, new_limit=False)
    assert parse("max(l)").evaluate(data.get, new_limit=False) == 1


def test_an_expression_that_is_nested_deep_still_says_why_it_fails():
    for depth in (20, 95):
        for mark in ("", "="):
            with pytest.raises(ExpressionError, match="text 'x'"):
                parse(mark + "(" * depth + "a * 2" + ")" * depth).evaluate(DATA.get)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("= armed", "armed is not set"),
        ("= n > 2 and armed", "armed is not set"),
        ("= m.k > 1 and m.j > 1", "m.j is not set"),
        ("= unset > 5 or n > 5", "unset is not set"),
        ("= if n > 2 then armed else true", "armed is not set"),
        ("= l[5]", None),
        ("= get value(m, 3)", ""),
        ("armed", "armed is not set"),
        ("${armed}", "armed is not set"),
    ],
)
def test_a_condition_that_is_null_says_which_name_is_not_set(text, why):
    condition = parse(text)
    if why is None:  # an item that is not there is wrong in FEEL
        with pytest.raises(ExpressionError, match="there is no item 5 of 2"):
            condition.truth(DATA.get)
        return
    assert condition.truth(DATA.get) is None
    assert not condition.holds(DATA.get)
    assert condition.why_null(DATA.get) == why


# --- random expressions ---------------------------------------------------------------------------


def fails(node, read, rules, raises=True):
    """Whether evaluating a node alone raises, or else has no value by a wrong operation."""
    begin_work()
    feel.begin()
    try:
        evaluate(node, read, rules)
    except ExpressionError:
        return raises
    return not raises and bool(feel.cause())


def reached(node, read, rules, raises):
    """The children of a node that its value depends on, as the standards of the languages say."""
    match node:
        case And(operands) | Or(operands):
            decisive = isinstance(node, Or)
            for number, each in enumerate(operands):
                yield each
                if fails(each, read, rules, raises):
                    return
                before = type(node)(operands[: number + 1])
                if fails(before, read, rules, raises) or evaluate(before, read, rules) is decisive:
                    return
        case If(condition, then, otherwise):
            yield condition
            test = And((condition,))
            if not fails(test, read, rules, raises):
                yield then if evaluate(test, read, rules) is True else otherwise
        case _:
            yield from children(node)


def check_cause(tree, store, dialect):
    rules, read = RULES[dialect], store.get
    raises = fails(tree, read, rules)
    if not raises and not fails(tree, read, rules, False):
        return

    part, _ = trace(tree, rules, read, {})
    assert fails(part.node, read, rules, raises)
    assert not any(
        fails(each, read, rules, raises) for each in reached(part.node, read, rules, raises)
    )
    if dialect is Dialect.BARE:
        text = write(tree)
        placed, spans = place(text, dialect, tree)
        again, _ = trace(placed, rules, read, spans)
        assert repr(again.node) == repr(part.node)
        assert repr(parse(text[again.span]).tree) == repr(part.node)


@settings(max_examples=examples(100, 400), deadline=None)
@given(trees, stores)
def test_the_part_that_is_named_fails_alone_and_its_operands_do_not(tree, store):
    for dialect in (Dialect.BARE, Dialect.JUEL, Dialect.XPATH, Dialect.FEEL):
        check_cause(tree, store, dialect)


@pytest.mark.long
@settings(max_examples=5_000, deadline=None)
@given(trees_with_calls, stores)
def test_the_part_of_many_that_is_named_fails_alone_and_its_operands_do_not(tree, store):
    for dialect in (Dialect.BARE, Dialect.JUEL, Dialect.XPATH, Dialect.FEEL):
        check_cause(tree, store, dialect)
