"""How expressions are written: dialects, trees, limits and refusals."""

import pytest

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.expression import Dialect, parse, template
from m2pem.mission.expression.descent import MAX_PARTS
from m2pem.mission.expression.tree import (
    MAX_DEPTH,
    And,
    Arithmetic,
    Call,
    Compare,
    Comparison,
    In,
    ListOf,
    Literal,
    Name,
    Negate,
    Not,
    Operation,
    Or,
    walk,
)

FEEL_URI = "https://www.omg.org/spec/DMN/20191111/FEEL/"


def test_the_tree_has_a_node_for_each_thing_said():
    tree = parse("not a.b >= -1 and (c in [x, 'y'] or abs(d) + 1 == null) and e").tree
    assert tree == And(
        (
            Not(Compare(Comparison.GREATER_EQUAL, Name("a.b"), Literal(-1))),
            Or(
                (
                    In(Name("c"), ListOf((Name("x"), Literal("y")))),
                    Compare(
                        Comparison.EQUAL,
                        Arithmetic(Operation.ADD, Call("abs", (Name("d"),)), Literal(1)),
                        Literal(None),
                    ),
                )
            ),
            Name("e"),
        )
    )
    assert parse("-(1)").tree == Negate(Literal(1))


@pytest.mark.parametrize(
    ("bare", "juel", "feel"),
    [
        ("a == 'x'", "${a eq 'x'}", '= a = "x"'),
        ("a != 1", "#{a ne 1}", "=a != 1"),
        ("a < 1 and b <= 2", "${a lt 1 && b le 2}", "= a < 1 and b <= 2"),
        ("a > 1 or b >= 2", "${a gt 1 || b ge 2}", "= a > 1 or b >= 2"),
        ("not (a)", "${!a}", "= not(a)"),
        ("not (a == 1)", "${not (a == 1)}", "= not(a = 1)"),
        ("is_empty(a)", "${empty a}", "= is_empty(a)"),
        ("not is_empty(a) and b", "${!empty a and b}", "= not(is_empty(a)) and b"),
        ("(not a) == b", "${(!a) == b}", "= not(a) = b"),
        ("a / 2", "${a div 2}", "= a / 2"),
        ("a in [1, 2]", "${a in [1, 2]}", "= a in [1, 2]"),
        ("length(a)", "${length(a)}", "= length(a)"),
        ("null", "${null}", "=null"),
    ],
)
def test_all_dialects_give_one_tree(bare, juel, feel):
    trees = [parse(text).tree for text in (bare, juel, feel)]
    assert repr(trees[0]) == repr(trees[1]) == repr(trees[2])


@pytest.mark.parametrize(
    ("text", "language", "dialect"),
    [
        ("a == 1", None, Dialect.BARE),
        ("a == 1", "", Dialect.BARE),
        ("a == 1", "m2pem", Dialect.BARE),
        ("\n ${a == 1} \n", None, Dialect.JUEL),
        ("a eq 1", "juel", Dialect.JUEL),
        ("${a eq 1}", "JUEL", Dialect.JUEL),
        (" = a = 1", None, Dialect.FEEL),
        ("a = 1", "FEEL", Dialect.FEEL),
        ("= a = 1", "feel", Dialect.FEEL),
        ("a = 1", FEEL_URI, Dialect.FEEL),
        ("a = 1", "http://www.omg.org/spec/DMN/20180521/FEEL", Dialect.FEEL),
        ("a = 1", "http://www.omg.org/spec/FEEL/20140401", Dialect.FEEL),
        ("${a == 1}", FEEL_URI, Dialect.JUEL),
        ("${a == 1}", "http://www.w3.org/1999/XPath", Dialect.JUEL),
        ("= a = 1", "http://www.w3.org/1999/XPath", Dialect.FEEL),
    ],
)
def test_marks_and_language_say_the_dialect(text, language, dialect):
    expression = parse(text, language)
    assert expression.dialect is dialect
    assert expression.text == text
    assert expression.tree == parse("a == 1").tree


@pytest.mark.parametrize(
    "language",
    [
        "groovy",
        "http://groovy.codehaus.org/",
        "javascript",
        "steel",
    ],
)
def test_other_languages_are_refused_by_name(language):
    with pytest.raises(ExpressionSyntaxError, match=language) as caught:
        parse("a == 1", language)
    assert "FEEL" in str(caught.value)


@pytest.mark.parametrize("language", ["groovy", "javascript"])
def test_a_mark_does_not_excuse_a_language_that_has_it_too(language):
    with pytest.raises(ExpressionSyntaxError, match=language):
        parse("${a}", language)


def test_what_a_range_doubles_is_bounded():
    text = "= a"
    for _ in range(40):
        text = f"= ({text[2:]}) between 1 and 2"
    with pytest.raises(ExpressionSyntaxError, match="too large, written out"):
        parse(text)


@pytest.mark.parametrize(
    ("levels", "text"),
    [
        (9, "= {}a{}".format("(" * 9, " in(1..2))" * 9)),
        (4, "= {}a{}".format("every x in " * 4, " satisfies b" * 4)),
        (98, "-" * 98 + "a"),
    ],
)
def test_a_short_text_is_within_the_limits_without_being_measured(levels, text):
    assert len(text) <= MAX_DEPTH + len("= ")
    parts = list(walk(parse(text).tree))
    assert levels < max(depth for _, depth in parts) <= MAX_DEPTH
    assert len(parts) <= MAX_PARTS


def test_feel_names_may_hold_spaces():
    assert parse('= Vacation   Approval.state = "ok"').names == {"Vacation Approval.state"}
    assert parse("Vacation Approval in [lead time]", "FEEL").names == {
        "Vacation Approval",
        "lead time",
    }


@pytest.mark.parametrize(
    ("text", "same_as"),
    [
        ("${a ? b : c ? d : e}", "a ? b : (c ? d : e)"),
        ("= if a then b else c + 1", "a ? b : c + 1"),
        ("= a between b + 1 and 5 and c", "(a >= b + 1 and a <= 5) and c"),
        ("= a in [1..5]", "a >= 1 and a <= 5"),
        ("= a in (1..b)", "a > 1 and a < b"),
        ("= a in ]1..2[", "a > 1 and a < 2"),
        ('= a in ("x", "y")', "a in ['x', 'y']"),
        ("= a in (1)", "a in [1]"),
        ("= a in (b)", "a in b"),
        ("= a in []", "a in []"),
        ("${a['b'].c}", "a['b'].c"),
        ("a['b']", "a.b"),
        ("${a.get(0)}", "a[0]"),
        ("${a.equals('yes') && !b.isEmpty()}", "a == 'yes' and not is_empty(b)"),
        ("${a.b.equalsIgnoreCase(c)}", "lower(a.b) == lower(c)"),
        ("${a[0].b.size() > 1}", "length(a[0].b) > 1"),
        ("${a.toUpperCase().startsWith('X')}", "starts_with(upper(a), 'X')"),
        ("${execution.getVariable('a') == 1}", "a == 1"),
        ("${execution.hasVariable('a')}", "exists(a)"),
        ("${var:equals(a, 1) ? b:c}", "a == 1 ? b : c"),
        ("${vars:lte('a', 1)}", "a <= 1"),
        ("${variables:getOrDefault(a, 5)}", "exists(a) ? a : 5"),
        ("${var:containsAny(a, 1, 2)}", "contains(a, 1) or contains(a, 2)"),
        ("bpmn:getDataObject('clarified') = 'yes'", "clarified == 'yes'"),
        ("not(getDataObject('a')) and true()", "not a and true"),
        ("getProcessProperty('p', 'a') div 2 >= 1", "a / 2 >= 1"),
    ],
)
def test_what_others_write_is_what_the_bare_dialect_writes(text, same_as):
    assert parse(text).tree == parse(same_as).tree


def test_xpath_is_read_where_it_is_declared():
    expression = parse("count(a) = 2 or not (b)", "http://www.w3.org/1999/XPath")
    assert expression.dialect is Dialect.XPATH
    assert expression.tree == parse("length(a) == 2 or not b").tree


def test_what_a_condition_on_items_calls_an_item_is_no_name_of_the_store():
    assert parse("= some r in levels satisfies r.risk > limit and s").names == {
        "levels",
        "limit",
        "s",
    }
    assert parse("= every a in a satisfies a > 1").names == {"a"}


def test_words_of_one_dialect_are_names_in_another():
    assert parse("empty + lt + some").names == {"empty", "lt", "some"}
    assert parse("$" + "{if + then}").names == {"if", "then"}
    assert parse("= empty + lt").names == {"empty", "lt"}
    assert parse("not.a and in.b").names == {"not.a", "in.b"}


@pytest.mark.parametrize("name", ["größe", "距離", "दूरी", "_x1", "a.1.b", "A", "Ж.ж"])
def test_names_may_be_of_any_script(name):
    assert parse(f"{name} == 1").names == {name}


@pytest.mark.parametrize(
    ("text", "position", "message"),
    [
        ("", 0, "an expression is missing"),
        ("  ", 2, "an expression is missing"),
        ("=", 1, "an expression is missing"),
        ("${ }", 3, "an expression is missing"),
        ("a = 'x'", 2, "write '=='"),
        ("= a == 1", 5, "expected a value, found '='"),
        ("a < b < c", 6, "comparisons do not chain"),
        ("a == b == c", 7, "comparisons do not chain"),
        ("a in b in c", 7, "comparisons do not chain"),
        ("1 +", 3, "expected a value, found the end"),
        ("and a", 0, "expected a value, found 'and'"),
        ("a b", 2, "expected an operator or the end, found 'b'"),
        ("a.b.", 3, "missing after '.'"),
        ("a..b", 1, "missing after '.'"),
        (".a", 0, "expected a value, found '.'"),
        ("a[0].", 5, "expected a name after '.'"),
        ("a[0", 3, "expected ']' to close '['"),
        ("'abc'[0]", 5, "expected an operator"),
        ("(a", 2, "expected ')' to close '(' at column 1, found the end"),
        ("a)", 1, "expected an operator or the end, found ')'"),
        ("[1, ]", 4, "expected a value, found ']'"),
        ("[1 2]", 3, "expected ']'"),
        ("[1, 2", 5, "expected ']' to close '['"),
        ("'abc", 0, "the text is not closed by '"),
        ("'abc\\", 0, "the text is not closed by '"),
        (r"'\x41'", 0, r"'\x' is no escape"),
        ("3m", 1, "a number cannot be followed by 'm'"),
        ("1.2.3", 3, "a number cannot be followed by '.'"),
        ("0x10", 1, "a number cannot be followed by 'x'"),
        ("1_000", 1, "a number cannot be followed by '_'"),
        ("9223372036854775808", 0, "64 bits"),
        ("-9223372036854775809", 1, "64 bits"),
        ("1e999", 0, "too large for a double"),
        ("2 ** 3", 3, "expected a value, found '*'"),
        ("2 ^ 3", 2, "no power operator"),
        ("a % 2", 2, "mod(x, y)"),
        ("a && b", 2, "write 'and'"),
        ("a || b", 2, "write 'or'"),
        ("!a", 0, "write 'not'"),
        ("a ? b", 5, "expected ':' between the two values after '?'"),
        ("= a ? b : c", 4, "write 'if a then b else c'"),
        ("a b", 2, "a name has no spaces (in FEEL it may: begin with '=')"),
        ("a == “x”", 5, "straight quotes"),
        ("a == ${b}", 5, "one '${...}'"),
        ("${a} and ${b}", 4, "put all of it between the braces"),
        ("${a", 0, "not closed by '}'"),
        ("${a.b('x')}", 2, "'b()' would run a method of an object"),
        ("${a.equals()}", 2, "equals() takes another number of arguments"),
        ("${a[0].b('x')}", 7, "'b()' would run a method of an object"),
        ("a.equals('x')", 0, "'a.equals' would run a method of an object"),
        ("${execution.getVariable(1)}", 2, "takes the name of a variable"),
        ("${var:base64(a)}", 2, "after 'var:' there are get,"),
        ("${var:eq(a + 1, 2)}", 2, "takes the name of a variable"),
        ("foor(1)", 0, "did you mean 'floor'?"),
        ("eval('x')", 0, "there is no function 'eval'"),
        ("abs()", 0, "expected abs(x), found 0 arguments"),
        ("abs(1, 2)", 0, "expected abs(x), found 2 arguments"),
        ("min()", 0, "expected min(x, ...)"),
        ("true()", 4, "expected an operator"),
        ("a == not b", 5, "parentheses"),
        ("a not b", 6, "expected 'in' after 'not'"),
        ("${!a == b}", 2, "ambiguous"),
        ("${not a in b}", 2, "ambiguous"),
        ("${empty a + 1}", 2, "ambiguous"),
        ("= not a", 6, "expected '(' after FEEL's 'not'"),
        ("= if a then b", 13, "expected 'else' after 'if'"),
        ("= a in [1..5", 12, "to close the range"),
        ("= a in ]1, 2[", 9, "expected '..' in a range"),
        ("= a in 1..5", 8, "expected an operator"),
        ("= a between 1", 13, "expected 'and' after 'between'"),
        ("= a between 1 and 2 between 3 and 4", 20, "comparisons do not chain"),
        ("= some 1 in a satisfies b", 7, "expected a name after 'some'"),
        ("= for a in b", 12, "expected 'return' after 'for'"),
        ("= {a: 1", 7, "expected '}' to close '{' at column 3"),
        ("= {a: 1, a: 2}", 12, "the key 'a' is there twice"),
        ("= function(a) external {}", 14, "functions of Java"),
        ("= a instance of thing", 16, "expected a type such as number"),
        ("= f(a: 1, 2)", 10, "all arguments have names, or none"),
        ("= 'a'", 2, "double quotes"),
        ("getDataObject('a')/b", 18, "paths into XML"),
        ("getDataObject(1) = 2", 0, "takes the name of a variable"),
        ("a;", 1, "unexpected ';'"),
        ("a\x00b", 1, "unexpected"),
        ("\ud800", 0, "unexpected"),
        ("{'a': 1}", 0, "maps cannot be written"),
    ],
)
def test_refusal_says_where_and_what_was_expected(text, position, message):
    with pytest.raises(ExpressionSyntaxError) as caught:
        parse(text)
    assert message in caught.value.message
    assert caught.value.position == position


def test_the_bare_language_admits_no_marks():
    for text in ("${a}", "= a"):
        with pytest.raises(ExpressionSyntaxError):
            parse(text, "m2pem")


@pytest.mark.parametrize(
    "text",
    [
        "(" * 101 + "a" + ")" * 101,
        "[" * 101 + "]" * 101,
        "-" * 101 + "a",
        "not " * 101 + "a",
        "abs(" * 101 + "a" + ")" * 101,
        "a" + " + a" * 101,
        "(" * 9_999,
        "${" + "!" * 5_000 + "a}",
        "= " + "not(" * 2_000,
    ],
)
def test_deep_nesting_is_refused(text):
    with pytest.raises(ExpressionSyntaxError, match="nested deeper than 100"):
        parse(text)


@pytest.mark.parametrize(
    "text",
    [
        "(" * 99 + "a" + ")" * 99,
        "not " * 98 + "a",
        "a" + " + 1" * 98,
        " and ".join(["a"] * 1_400),
        " or ".join(["a and b"] * 700),
        "[" + ",".join("1" * 1_000) + "]",
    ],
)
def test_what_is_within_the_limits_is_read_and_evaluated(text):
    expression = parse(text)
    expression.evaluate(lambda name: None)
    assert max(depth for _, depth in walk(expression.tree)) <= 100


@pytest.mark.parametrize(
    "text",
    [
        "a" * 10_001,
        "(" * 100_000,
        "9" * 100_000,
        "'" * 100_001,
        "${" + "'\\" * 100_000,
        "${" * 100_000,
        "=" * 100_000,
        "\\" * 100_000 + "=",
        "é" * 100_000,
    ],
)
def test_long_text_is_refused_with_a_short_message(text):
    with pytest.raises(ExpressionSyntaxError, match="longer than 10000") as caught:
        parse(text)
    assert len(str(caught.value)) < 200


def test_a_long_text_without_an_expression_is_a_literal_and_with_one_is_refused():
    assert template("x" * 100_000).evaluate(lambda name: None) == "x" * 100_000
    with pytest.raises(ExpressionSyntaxError, match="longer than 10000"):
        template("x" * 100_000 + "${a}")


@pytest.mark.parametrize("text", ["[" + ",".join("1" * 1_001) + "]", "max(" + "1," * 1_000 + "1)"])
def test_long_lists_are_refused(text):
    with pytest.raises(ExpressionSyntaxError, match="more than 1000 items"):
        parse(text)


@pytest.mark.parametrize("digits", ["9" * 9_999, "1" + "0" * 4_999, "-" + "9" * 5_000])
def test_long_integers_are_refused(digits):
    with pytest.raises(ExpressionSyntaxError, match="64 bits"):
        parse(digits)


def test_leading_zeros_do_not_count():
    assert parse("0" * 9_000 + "7").evaluate(lambda name: None) == 7
