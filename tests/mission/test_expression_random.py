"""Random expressions against a tiny evaluator of the tree, and random text against the parser."""

import contextlib
import math
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.expression import literal, parse, template
from m2pem.mission.expression.feel_functions import FEEL_FUNCTIONS
from m2pem.mission.expression.functions import FUNCTIONS
from m2pem.mission.expression.tree import (
    And,
    Arithmetic,
    Call,
    Compare,
    Comparison,
    If,
    In,
    Index,
    ListOf,
    Literal,
    Name,
    Negate,
    Not,
    Operation,
    Or,
)
from tests.seeds import examples

NAMES = ("a", "b.c", "d_1", "größe")
BIG = 2**63

# --- data and trees -----------------------------------------------------------------------------

integers = st.one_of(st.integers(-3, 3), st.integers(-BIG, BIG - 1))
doubles = st.floats(allow_nan=False, allow_infinity=False)
texts = st.sampled_from(["", "a", "b", "1", "a'\"\\\n", "ü"])
scalars = st.one_of(st.none(), st.booleans(), integers, doubles, texts)
values = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(texts, inner, max_size=2),
    max_leaves=5,
)
stores = st.dictionaries(st.sampled_from(NAMES), values)


def _calls(inner):
    def of(name):
        return st.lists(inner, min_size=1, max_size=3).map(lambda args: Call(name, tuple(args)))

    return (
        st.sampled_from(list(FUNCTIONS))
        .flatmap(of)
        .filter(lambda call: FUNCTIONS[call.function].accepts(len(call.arguments)))
    )


def _inner(inner, calls):
    several = st.lists(inner, min_size=2, max_size=4).map(tuple)
    nodes = [
        st.builds(Compare, st.sampled_from(Comparison), inner, inner),
        st.builds(Arithmetic, st.sampled_from([*Operation][:4]), inner, inner),
        st.builds(And, several),
        st.builds(Or, several),
        st.builds(Not, inner),
        st.builds(Negate, inner),
        st.builds(In, inner, inner),
        st.builds(If, inner, inner, inner),
        st.builds(Index, st.builds(ListOf, st.lists(inner, max_size=3).map(tuple)), inner),
        st.builds(ListOf, st.lists(inner, max_size=3).map(tuple)),
    ]
    return st.one_of(*nodes, _calls(inner)) if calls else st.one_of(*nodes)


leaves = st.one_of(st.builds(Literal, scalars), st.builds(Name, st.sampled_from(NAMES)))
trees = st.recursive(leaves, lambda inner: _inner(inner, calls=False), max_leaves=12)
trees_with_calls = st.recursive(leaves, lambda inner: _inner(inner, calls=True), max_leaves=12)


def write(node):
    """The tree in the bare dialect, with parentheses round everything."""
    match node:
        case Literal(str() as text):
            escaped = text.replace("\\", "\\\\").replace("'", "\\'").replace("\n", "\\n")
            return f"'{escaped}'"
        case Literal(value):
            return literal(value).text
        case Name(name):
            return name
        case ListOf(items):
            return "[" + ", ".join(map(write, items)) + "]"
        case Call(name, arguments):
            return f"{name}(" + ", ".join(map(write, arguments)) + ")"
        case And(operands):
            return "(" + " and ".join(map(write, operands)) + ")"
        case Or(operands):
            return "(" + " or ".join(map(write, operands)) + ")"
        case Not(operand):
            return f"(not ({write(operand)}))"
        case Negate(operand):
            return f"(-({write(operand)}))"
        case In(item, container):
            return f"({write(item)} in {write(container)})"
        case If(condition, then, otherwise):
            return f"({write(condition)} ? {write(then)} : {write(otherwise)})"
        case Index(container, key):
            return f"{write(container)}[{write(key)}]"
    return f"({write(node.left)} {node.operator.value} {write(node.right)})"


# --- the reference ------------------------------------------------------------------------------


class FailsError(Exception):
    """The reference says that the expression fails."""


def confused(a, b):
    return (is_number(a) and isinstance(b, str)) or (isinstance(a, str) and is_number(b))


def same(a, b):
    if confused(a, b):
        raise FailsError
    number = (int, float)
    if isinstance(a, bool) or isinstance(b, bool):
        return a is b
    if isinstance(a, number) and isinstance(b, number):
        return Fraction(a) == Fraction(b)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict) and isinstance(b, dict):
        return set(a) == set(b) and all(same(a[key], b[key]) for key in a)
    return type(a) is type(b) and a == b


def is_number(x):
    return isinstance(x, (int, float)) and not isinstance(x, bool)


def truth(x):
    if x is None or isinstance(x, bool):
        return bool(x)
    raise FailsError


def order(operator, a, b):
    if is_number(a) and is_number(b):
        a, b = Fraction(a), Fraction(b)
    elif confused(a, b):
        raise FailsError
    elif a is None or type(a) is not type(b):
        return False
    elif not isinstance(a, str):
        raise FailsError
    return {"<": a < b, "<=": a <= b, ">": a > b, ">=": a >= b}[operator]


def arithmetic(operator, a, b):
    if a is None or b is None:
        return None
    if operator == "+" and isinstance(a, str) and isinstance(b, str):
        return a + b
    if not (is_number(a) and is_number(b)):
        raise FailsError
    try:
        if operator == "/":
            result = a / b
        else:
            result = {"+": a + b, "-": a - b, "*": a * b}[operator]
    except (ZeroDivisionError, OverflowError):
        raise FailsError from None
    if isinstance(result, int) and not -BIG <= result < BIG:
        raise FailsError
    if not math.isfinite(result):
        raise FailsError
    return result


def reference(node, store):
    match node:
        case Literal(value):
            return value
        case Name(name):
            return store.get(name)
        case ListOf(items):
            return [reference(item, store) for item in items]
        case And(operands):
            return all(truth(reference(operand, store)) for operand in operands)
        case Or(operands):
            return any(truth(reference(operand, store)) for operand in operands)
        case Not(operand):
            return not truth(reference(operand, store))
        case Negate(operand):
            value = reference(operand, store)
            if value is not None and not is_number(value):
                raise FailsError
            return value if value is None else arithmetic("*", value, -1)
        case In(item, container):
            a, b = reference(item, store), reference(container, store)
            if b is None:
                return False
            if not isinstance(b, list):
                raise FailsError
            return any(not confused(a, each) and same(a, each) for each in b)
        case If(condition, then, otherwise):
            return reference(then if truth(reference(condition, store)) else otherwise, store)
        case Index(container, key):
            a, b = reference(container, store), reference(key, store)
            if b is None:
                return None
            if isinstance(b, bool) or not isinstance(b, int):
                raise FailsError
            return a[b] if -len(a) <= b < len(a) else None
    a, b = reference(node.left, store), reference(node.right, store)
    if isinstance(node, Arithmetic):
        return arithmetic(node.operator.value, a, b)
    match node.operator.value:
        case "==":
            return same(a, b)
        case "!=":
            return not same(a, b)
    return order(node.operator.value, a, b)


def check_against_reference(tree, store):
    expression = parse(write(tree))
    assert repr(expression.tree) == repr(tree)
    try:
        expected = reference(tree, store)
    except FailsError:
        with pytest.raises(ExpressionError):
            expression.evaluate(store.get)
    else:
        assert repr(expression.evaluate(store.get)) == repr(expected)


def check_errors(tree, store):
    expression = parse("${" + write(tree) + "}")
    for use in (expression.evaluate, expression.holds):
        try:
            use(store.get)
        except ExpressionError as error:
            assert len(str(error)) < 1_000


WORDS = [
    *["and", "or", "not", "in", "true", "false", "null", "eq", "empty", "div", "some", "if"],
    *["then", "else", "every", "satisfies", "between", "?", ":", "..", "]", "var:eq(", "a.get("],
    *["getDataObject(", "execution.getVariable("],
    *["==", "=", "!=", "<", "<=", ">", ">=", "+", "-", "*", "/", "(", ")", "[", "]", ",", "."],
    *[
        "&&",
        "||",
        "!",
        "${",
        "#{",
        "}",
        "{",
        "'",
        '"',
        "\\",
        "'x'",
        '"y"',
        "1",
        "2.5",
        "1e9",
        "9" * 30,
    ],
    *["a", "b.c", "größe", " ", "\n", "\ud800", "\x00", "😀", "٣", "@", "__class__", "eval"],
    *FUNCTIONS,
    *FEEL_FUNCTIONS,
]
any_text = st.one_of(
    st.text(st.characters(codec=None), max_size=60),
    st.lists(st.sampled_from(WORDS), max_size=30).map("".join),
    st.lists(st.sampled_from(WORDS), max_size=30).map(" ".join),
)
languages = st.sampled_from([None, "", "m2pem", "juel", "FEEL", "http://www.w3.org/1999/XPath"])


def check_any_text(text, language, store):
    for read in (lambda: parse(text, language), lambda: template(text)):
        try:
            expression = read()
        except ExpressionSyntaxError as error:
            assert 0 <= error.position <= len(text)
            continue
        with contextlib.suppress(ExpressionError):
            expression.evaluate(store.get)


# --- the tests ----------------------------------------------------------------------------------


@settings(max_examples=examples(75, 300), deadline=None)
@given(trees, stores)
def test_random_expressions_have_the_value_of_the_reference(tree, store):
    check_against_reference(tree, store)


@settings(max_examples=examples(50, 200), deadline=None)
@given(trees_with_calls, stores)
def test_evaluation_raises_nothing_but_expression_errors(tree, store):
    check_errors(tree, store)


@settings(max_examples=examples(125, 500), deadline=None)
@given(any_text, languages, stores)
def test_parsing_raises_nothing_but_syntax_errors(text, language, store):
    check_any_text(text, language, store)


@pytest.mark.long
@settings(max_examples=10_000, deadline=None)
@given(trees, stores)
def test_many_random_expressions_have_the_value_of_the_reference(tree, store):
    check_against_reference(tree, store)


@pytest.mark.long
@settings(max_examples=10_000, deadline=None)
@given(trees_with_calls, stores)
def test_evaluation_of_many_raises_nothing_but_expression_errors(tree, store):
    check_errors(tree, store)


@pytest.mark.long
@settings(max_examples=15_000, deadline=None)
@given(any_text, languages, stores)
def test_parsing_many_texts_raises_nothing_but_syntax_errors(text, language, store):
    check_any_text(text, language, store)
