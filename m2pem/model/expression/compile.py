"""Compiles a syntax tree to closures: a condition is evaluated at every gateway a token meets."""

from collections.abc import Callable
from typing import NamedTuple

from m2pem.errors import ExpressionError
from m2pem.model.expression.binding import some
from m2pem.model.expression.functions import FUNCTIONS
from m2pem.model.expression.operators import (
    ARITHMETIC,
    COMPARISONS,
    bounded_list,
    contains,
    index,
    join,
    negate,
    truth,
)
from m2pem.model.expression.tree import (
    And,
    Arithmetic,
    Call,
    Compare,
    Comparison,
    If,
    In,
    Index,
    Join,
    ListOf,
    Literal,
    Name,
    Negate,
    Node,
    Not,
    Or,
    Some,
    children,
)
from m2pem.model.values import ReadValue, Value

Run = Callable[[ReadValue], Value]
Test = Callable[[ReadValue], bool]


class _Code(NamedTuple):
    """`constant`: reads nothing and cannot fail. `test`: the same as `run` if always a boolean."""

    run: Run
    constant: bool = False
    test: Test | None = None


def compile_tree(node: Node) -> Run:
    """What computes the tree's value; it raises ExpressionError."""
    return _code(node).run


def _code(node: Node) -> _Code:
    parts = [_code(child) for child in children(node)]
    code = _assemble(node, parts)
    if not parts or not all(part.constant for part in parts):
        return code
    try:
        value = code.run(_read_nothing)
    except ExpressionError:
        # It fails whenever it is evaluated, which may be never: `false and 1 / 0 > 2`.
        return code
    return _constant(value)


def _constant(value: Value) -> _Code:
    test: Test | None = None
    if isinstance(value, bool):
        fixed = value
        test = lambda read: fixed  # noqa: E731
    return _Code(lambda read: value, constant=True, test=test)


def _read_nothing(name: str) -> Value:
    return None


def _assemble(node: Node, parts: list[_Code]) -> _Code:
    match node:
        case Literal(value):
            return _constant(value)
        case Name(name):
            return _Code(lambda read: read(name))
        case Not():
            holds = _test(parts[0], "'not'")
            return _boolean(lambda read: not holds(read))
        case And():
            return _boolean(_all([_test(part, "'and'") for part in parts]))
        case Or():
            return _boolean(_any([_test(part, "'or'") for part in parts]))
        case Compare(operator):
            return _boolean(_compare(operator, node, parts))
        case In():
            item, container = parts[0].run, parts[1].run
            return _boolean(lambda read: contains(container(read), item(read)))
        case Negate():
            operand = parts[0].run
            return _Code(lambda read: negate(operand(read)))
        case Arithmetic(operation):
            compute, left, right = ARITHMETIC[operation], parts[0].run, parts[1].run
            return _Code(lambda read: compute(left(read), right(read)))
        case Index():
            container, key = parts[0].run, parts[1].run
            return _Code(lambda read: index(container(read), key(read)))
        case If():
            decide, then, otherwise = _test(parts[0], "a condition"), parts[1].run, parts[2].run
            return _Code(lambda read: then(read) if decide(read) else otherwise(read))
        case Some(variable):
            return _boolean(some(variable, parts[0].run, _test(parts[1], "a condition")))
    return _collect(node, tuple(part.run for part in parts))


def _collect(node: ListOf | Call | Join, runs: tuple[Run, ...]) -> _Code:
    match node:
        case ListOf() if not runs:
            return _Code(lambda read: [], constant=True)
        case ListOf():
            return _Code(lambda read: bounded_list([run(read) for run in runs]))
        case Call(function):
            call = FUNCTIONS[function].call
            return _Code(lambda read: call([run(read) for run in runs]))
        case Join():
            return _Code(lambda read: join([run(read) for run in runs]))


def _boolean(test: Test) -> _Code:
    return _Code(test, test=test)


def _test(code: _Code, what: str) -> Test:
    if code.test is not None:
        return code.test
    run = code.run

    def test(read: ReadValue) -> bool:
        value = run(read)
        return value if value is True or value is False else truth(value, what)

    return test


def _all(tests: list[Test]) -> Test:
    if len(tests) == 2:
        first, second = tests
        return lambda read: first(read) and second(read)
    if len(tests) == 3:
        one, two, three = tests
        return lambda read: one(read) and two(read) and three(read)

    return lambda read: all(test(read) for test in tests)


def _any(tests: list[Test]) -> Test:
    if len(tests) == 2:
        first, second = tests
        return lambda read: first(read) or second(read)

    return lambda read: any(test(read) for test in tests)


def _compare(operator: Comparison, node: Compare, parts: list[_Code]) -> Test:
    compare, left, right = COMPARISONS[operator], parts[0].run, parts[1].run
    if isinstance(node.right, Literal):
        value = node.right.value
        # What conditions mostly are; for a text or null, Python's `==` is already ours.
        if value is None or isinstance(value, str):
            if operator is Comparison.EQUAL:
                return lambda read: left(read) == value
            if operator is Comparison.NOT_EQUAL:
                return lambda read: left(read) != value
        return lambda read: compare(left(read), value)
    return lambda read: compare(left(read), right(read))
