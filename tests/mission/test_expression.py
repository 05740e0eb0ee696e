"""What expressions mean: values, errors, and the Expression object."""

import copy
import itertools
import math
import pickle

import pytest

from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.expression import Dialect, literal, parse, template
from m2pem.mission.expression.operators import MAX_SIZE

DATA = {
    "t": "gpr",
    "i": 3,
    "d": 2.5,
    "yes": True,
    "no": False,
    "list": [1, "a", None, True],
    "map": {"k": 1},
    "big": 2**53 + 1,
    "max": 2**63 - 1,
    "min": -(2**63),
    "huge": 10**30,
    "digits": 10**5000,
    "nan": math.nan,
    "inf": math.inf,
    "long": "x" * MAX_SIZE,
    "a.b.c": "dotted",
}


def value(text):
    return parse(text).evaluate(DATA.get)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        # literals and names
        ("0012", 12),
        ("-9223372036854775808", -(2**63)),
        ("9223372036854775807", 2**63 - 1),
        (".5", 0.5),
        ("1e3", 1000.0),
        ("1e-999", 0.0),
        (r"'it\'s' ", "it's"),
        (r'"a\n\t\\\""', 'a\n\t\\"'),
        ("'ü\N{ROCKET}'", "ü\N{ROCKET}"),
        ("[]", []),
        ("[1, [i, null], 'x']", [1, [3, None], "x"]),
        ("a.b.c", "dotted"),
        ("missing.name", None),
        # equality
        ("null == null", True),
        ("missing == null", True),
        ("null != 'gpr'", True),
        ("t == 'gpr'", True),
        ("'gpr' == t", True),
        ("t != 'GPR'", True),
        ("true == 1", False),
        ("false == 0", False),
        ("no == null", False),
        ("1 == 1.0", True),
        ("big == 9007199254740992.0", False),
        ("[1, 2] == [1.0, 2]", True),
        ("[1] == [true]", False),
        ("[1] == [1, 1]", False),
        ("map == map", True),
        ("map == [1]", False),
        ("nan == nan", False),
        # items, choices
        ("list[0]", 1),
        ("list[-1]", True),
        ("list[4]", None),
        ("list[-5]", None),
        ("missing[0]", None),
        ("list[missing]", None),
        ("[map][0].k", 1),
        ("[map][0].other", None),
        ("list.k", None),
        ("yes ? 1 : 1 / 0", 1),
        ("missing ? 1 : 2", 2),
        ("no ? 1 : yes ? 2 : 3", 2),
        ("(i > 2 ? 'fast' : 'slow') == 'fast'", True),
        # conditions on items
        ("= some x in list satisfies x = t and false", False),
        ('= some x in list satisfies x = "a"', True),
        ("= some x in missing satisfies true", None),
        ("= every x in [i, 4] satisfies x > 2 and x > d", True),
        ("= every x in [i, 1] satisfies x > 2", False),
        ("= every x in [] satisfies false", True),
        ("= every x in missing satisfies true", None),
        ("= some x in [map] satisfies x.k = 1", True),
        ("= some x in [map] satisfies x.k.y = 1 or x.other = 1", False),
        ("= some x in [1, 2] satisfies some y in [2, 3] satisfies x = y", True),
        # times
        ("date('2026-01-01T00:00:00Z') < date('2026-01-01T00:00:00-01:00')", True),
        ("date('1970-01-02')", 86400.0),
        (
            '= date and time("1970-01-01T00:00:00.5Z") + duration("PT1M")',
            "1970-01-01T00:01:00.5Z",
        ),
        ("sum([1, 2.5, i])", 6.5),
        ("sum([])", 0),
        ("sum([1, null])", None),
        # order
        ("i < 4 and i <= 3 and i > 2.5 and i >= 3", True),
        ("big > 9007199254740992.0", True),
        ("max < 9223372036854775808.0", True),
        ("'a' < 'b'", True),
        ("'B' < 'a'", True),
        ("null < 1", False),
        ("1 >= null", False),
        ("null <= null", False),
        ("true > 0", False),
        ("[1] < 2", False),
        # membership
        ("1 in list", True),
        ("1.0 in list", True),
        ("null in list", True),
        ("null in [1]", False),
        ("2 in list", False),
        ("2 not in list", True),
        ("1 in null", False),
        ("1 not in missing", True),
        # logic
        ("not null", True),
        ("null and yes", False),
        ("null or yes", True),
        ("null or null", False),
        ("no and i", False),
        ("yes or i", True),
        ("no and 1 / 0 > 1", False),
        ("not no and yes", True),
        ("not (no and yes)", True),
        ("yes or no and no", True),
        ("(yes or no) and no", False),
        ("not i == 4", True),
        ("not not yes", True),
        ("yes and yes and yes and no", False),
        ("no or no or no or yes", True),
        # arithmetic
        ("1 + 2 * 3", 7),
        ("(1 + 2) * 3", 9),
        ("10 - 3 - 2", 5),
        ("12 / 3 / 2", 2.0),
        ("-i + 1", -2),
        ("- -i", 3),
        ("6 / 3", 2.0),
        ("1 + 0.5", 1.5),
        ("'a' + 'b' + t", "abgpr"),
        ("null + 'a'", None),
        ("yes + missing", None),
        ("-missing", None),
        ("missing / 0", None),
        ("max + 0", 2**63 - 1),
        ("9007199254740993 + 0", 2**53 + 1),
        ("max / max", 1.0),
        # functions
        ("abs(-2.5)", 2.5),
        ("abs(missing)", None),
        ("min(3, i, 2.5)", 2.5),
        ("max(1, missing)", None),
        ("max([])", None),
        ("max([1, null])", None),
        ("round(-2.5)", -3),
        ("round(0.49999999999999994)", 0),
        ("round(i)", 3),
        ("floor(2.9)", 2),
        ("ceil(-2.9)", -2),
        ("sqrt(2.25)", 1.5),
        ("mod(-7, 3)", 2),
        ("mod(7.5, 2)", 1.5),
        ("number(' -12 ')", -12),
        ("number('1e2')", 100.0),
        ("text(2.0)", "2"),
        ("text(0.1)", "0.1"),
        ("text(-0.0)", "0"),
        ("text(true)", "true"),
        ("text(1e300)", "1e+300"),
        ("length('ü')", 1),
        ("length(map)", 1),
        ("contains(t, 'pr')", True),
        ("contains(t, null)", None),
        ("contains(list, null)", True),
        ("contains(list, 1.0)", True),
        ("contains([1], true)", False),
        ("starts_with(missing, 'x')", None),
        ("upper('ß')", "SS"),
        ("exists(no)", True),
        ("is_empty('')", True),
        ("is_empty([])", True),
        ("is_empty(missing)", True),
        ("is_empty(0)", False),
        ("is_empty(no)", False),
    ],
)
def test_an_expression_has_its_value(text, expected):
    assert repr(value(text)) == repr(expected)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("'1' == 1", "'==' compares the text '1' with the number 1; number"),
        ("1 != '1'", "compares the number 1 with the text '1'"),
        ("'1' < 2", "'<' compares the text '1' with the number 2"),
        ("1 / 0", "'/' divides the number 1 by zero"),
        ("i / 0.0", "'/' divides the number 3 by zero"),
        ("max + 1", "'+' of the number 9223372036854775807 and the number 1 does not fit"),
        ("min - 1", "does not fit into a 64-bit integer"),
        ("-min", "does not fit into a 64-bit integer"),
        ("max * max", "does not fit into a 64-bit integer"),
        ("1e300 * 1e300", "'*' of the number 1e+300 and the number 1e+300 is not finite"),
        ("huge * 1e300", "'*' of an integer beyond 64 bits and the number 1e+300 is not finite"),
        ("digits * 1.0", "'*' of an integer beyond 64 bits"),
        ("inf - inf", "is not finite"),
        ("nan + 1", "is not finite"),
        (
            "1 + 'a'",
            "'+' takes two numbers or two texts, not the number 1 and the text 'a'; text(x)",
        ),
        ("'a' - 'b'", "'-' takes two numbers, not the text 'a' and the text 'b'"),
        ("yes + 1", "'+' takes two numbers or two texts, not true and the number 1"),
        ("list * 2", "not a list of 4 and the number 2"),
        ("-t", "'-' takes a number, not the text 'gpr'"),
        ("-yes", "'-' takes a number, not true"),
        ("yes and i", "'and' takes true or false, not the number 3"),
        ("t or yes", "'or' takes true or false, not the text 'gpr'"),
        ("not i", "'not' takes true or false, not the number 3"),
        ("yes < no", "'<' cannot order true and false"),
        ("list < list", "'<' cannot order a list of 4 and a list of 4"),
        (
            "'p' in t",
            "'in' takes a list on its right, not the text 'gpr'; use contains(text, part)",
        ),
        ("1 in map", "'in' takes a list on its right, not a map of 1"),
        ("long + 'x'", "'+' is longer than 100000 characters"),
        ("[long]", "the list is larger than 100000"),
        ("[[long], 1] == 2", "the list is larger than 100000"),
        ("abs('x')", "abs() takes a number, not the text 'x'"),
        ("abs(min)", "abs() of the number -9223372036854775808 does not fit"),
        ("min(1, 'x')", "min() takes a number or list, not the text 'x'"),
        ("min(1, [2])", "min() takes numbers, not a list of 1"),
        ("min([1], 2)", "min() takes numbers, or one list of numbers"),
        ("max([1, true])", "max() takes numbers, not true"),
        ("round(1e300)", "round() of the number 1e+300 does not fit"),
        ("floor(inf)", "floor() of the number inf is not finite"),
        ("ceil(nan)", "ceil() of the number nan is not finite"),
        ("round(nan)", "is not finite"),
        ("sqrt(-1)", "sqrt() takes a number from 0 on, not the number -1"),
        ("sqrt(inf)", "is not finite"),
        ("sqrt(digits)", "does not fit"),
        ("mod(1, 0)", "mod() divides the number 1 by zero"),
        ("mod(digits, 1.5)", "mod() of an integer beyond 64 bits"),
        ("number('12 m')", "number() cannot read the text '12 m'"),
        ("number('--1')", "number() cannot read the text '--1'"),
        ("number('9223372036854775808')", "does not fit into 64 bits"),
        ("number('٣')", "number() cannot read"),
        ("text(list)", "text() takes a boolean or number or text, not a list of 4"),
        ("text(digits)", "does not fit"),
        ("text(nan)", "is not finite"),
        ("contains(t, 1)", "contains() looks for a text in a text, not the number 1"),
        ("distance(list, list)", "distance() takes positions, [latitude, longitude]"),
        ("distance([91, 0], [0, 0])", "distance() takes positions"),
        ("distance([0, 0], [digits, 0])", "distance() takes positions"),
    ],
)
def test_failure_names_the_operator_and_the_values(text, message):
    with pytest.raises(ExpressionError) as caught:
        value(text)
    assert message in str(caught.value)
    assert repr(text[:30])[:-1] in str(caught.value)


@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_and_and_or_heed_every_operand(count):
    names = [f"n{index}" for index in range(count)]
    both, either = parse(" and ".join(names)), parse(" or ".join(names))
    for operands in itertools.product([True, False, None], repeat=count):
        read = dict(zip(names, operands, strict=True)).get
        assert both.evaluate(read) is all(operands)
        assert either.evaluate(read) is any(operands)


def test_distance_is_that_of_the_great_circle():
    quarter_m = value("distance([0, 0], [0, 90, 500])")
    assert quarter_m == pytest.approx(6_371_008.8 * math.pi / 2)
    assert value("distance([10, 20], [10, 20])") == 0.0
    assert value("distance([90, 0], [-90, 0])") == pytest.approx(6_371_008.8 * math.pi)


@pytest.mark.parametrize(
    "text",
    [
        "= some a in l satisfies some b in l satisfies some c in l satisfies a + b + c < 0",
        "= every a in l satisfies a in l",
        "= some a in l satisfies l = l and a < 0",
        "= some a in l satisfies sum(l) < 0",
        '= some a in l satisfies upper(t) = "b"',
    ],
)
def test_an_evaluation_that_would_take_long_is_refused(text):
    data = {"l": list(range(1000)), "t": "a" * 100_000}
    with pytest.raises(ExpressionError, match="it looks at more than 100,000 values"):
        parse(text).evaluate(data.get)


def test_what_may_be_looked_at_is_counted_anew_for_each_evaluation():
    found = parse("max(l)")
    data = {"l": list(range(70_000))}
    assert [found.evaluate(data.get) for _ in range(2)] == [69_999] * 2
    with pytest.raises(ExpressionError, match="it looks at more"):
        found.evaluate(data.get, new_limit=False)


def test_lists_that_double_with_every_assignment_are_refused_before_they_are_large():
    grown = [1]
    double = parse("[x, x]")
    with pytest.raises(ExpressionError, match="larger than"):
        for _ in range(40):
            grown = double.evaluate({"x": grown}.get)


def test_lists_that_nest_deeper_with_every_assignment_are_refused():
    grown = [1]
    nest = parse("[x]")
    with pytest.raises(ExpressionError, match="nested deeper"):
        for _ in range(200):
            grown = nest.evaluate({"x": grown}.get)


@pytest.mark.parametrize("wrap", [lambda x: [x], lambda x: {"k": x}])
def test_comparing_values_of_bottomless_depth_is_an_error(wrap):
    left, right = 1, 1
    for _ in range(5000):
        left, right = wrap(left), wrap(right)
    with pytest.raises(ExpressionError, match="nested deeper"):
        parse("a == b").evaluate({"a": left, "b": right}.get)


@pytest.mark.parametrize(("text", "holds"), [("yes", True), ("no", False), ("missing", False)])
def test_a_condition_holds_if_it_is_true(text, holds):
    assert parse(text).holds(DATA.get) is holds


@pytest.mark.parametrize("text", ["i", "t", "list", "'true'", "1"])
def test_a_condition_that_is_no_boolean_is_an_error(text):
    with pytest.raises(ExpressionError, match="a condition takes true or false"):
        parse(text).holds(DATA.get)


def test_names_are_those_read_even_if_evaluation_would_skip_them():
    expression = parse("a.b == 1 and max(c, -d) in [e]")
    assert expression.names == {"a.b", "c", "d", "e"}
    assert not expression.constant
    assert parse("1 + length('x')").constant


def test_only_as_much_is_read_as_the_value_needs():
    read = []
    parse("a and b").evaluate(read.append)
    assert read == ["a"]


def test_an_expression_never_changes():
    expression = parse("a")
    with pytest.raises(AttributeError):
        expression.text = "b"


def test_expressions_are_equal_by_text_and_dialect():
    assert parse("a == 1") == parse("a == 1")
    assert hash(parse("a == 1")) == hash(parse("a == 1"))
    assert parse("a") != parse("b")
    assert parse("5") != template("5")
    assert literal(2) != literal(2.0)
    assert parse("a") != "a"


@pytest.mark.parametrize(
    "make", [copy.copy, copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e))]
)
def test_expressions_can_be_copied_and_pickled(make):
    expression = template("route_${i + 1}")
    again = make(expression)
    assert again == expression
    assert again.names == {"i"}
    assert again.evaluate(DATA.get) == "route_4"


@pytest.mark.parametrize(
    "given", [None, True, False, 0, -5, 2.0, 1e22, -0.5, "", "x", "${a}", "=b"]
)
def test_a_literal_is_its_value(given):
    expression = literal(given)
    assert repr(expression.evaluate(DATA.get)) == repr(given)
    assert expression.constant
    if not isinstance(given, str):
        assert parse(expression.text) == expression


@pytest.mark.parametrize(
    ("text", "dialect", "expected"),
    [
        ("route_alpha", Dialect.TEXT, "route_alpha"),
        ("  5 m/s ", Dialect.TEXT, "  5 m/s "),
        ("", Dialect.TEXT, ""),
        ("a == b }", Dialect.TEXT, "a == b }"),
        ("$i {i} $ {i}", Dialect.TEXT, "$i {i} $ {i}"),
        (r"\${i}", Dialect.TEXT, "${i}"),
        (r"\${i} ${i}", Dialect.TEMPLATE, "${i} 3"),
        ("${i}", Dialect.JUEL, 3),
        (" #{ d } ", Dialect.JUEL, 2.5),
        ("= i + 1", Dialect.FEEL, 4),
        ("${missing}", Dialect.JUEL, None),
        ("route_${i}", Dialect.TEMPLATE, "route_3"),
        ("${t}_${i + 1}_${d}", Dialect.TEMPLATE, "gpr_4_2.5"),
        ("${i}${yes}", Dialect.TEMPLATE, "3true"),
        ("${'}'}", Dialect.JUEL, "}"),
        (r"${'\'}'} m", Dialect.TEMPLATE, "'} m"),
        ("PT${i * 2}S", Dialect.TEMPLATE, "PT6S"),
    ],
)
def test_a_template_has_its_dialect_and_value(text, dialect, expected):
    expression = template(text)
    assert expression.text == text
    assert expression.dialect is dialect
    assert repr(expression.evaluate(DATA.get)) == repr(expected)


@pytest.mark.parametrize("text", ["route_${missing}", "${i} ${list}", "${map} m"])
def test_a_part_of_a_text_that_cannot_be_written_is_an_error(text):
    with pytest.raises(ExpressionError, match="part of a text must not be"):
        template(text).evaluate(DATA.get)


@pytest.mark.parametrize(
    ("text", "position"), [("${", 0), ("x ${a", 2), ("x ${'}", 2), ("a ${1 +} b", 7), ("=", 1)]
)
def test_a_broken_template_says_where(text, position):
    with pytest.raises(ExpressionSyntaxError) as caught:
        template(text)
    assert caught.value.position == position
