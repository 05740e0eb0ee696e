"""Evaluates a syntax tree over the data store: the tree is walked, nothing is compiled.

Most expressions of a mission are evaluated once or never, so that preparing them costs more than it
saves.
"""

from collections.abc import Callable
from typing import Any

from m2pem.errors import ExpressionError
from m2pem.mission.expression.functions import LISTED
from m2pem.mission.expression.operators import (
    COMPARISONS,
    bounded_list,
    contains,
    describe,
    index,
    join,
    look_at,
)
from m2pem.mission.expression.rules import Rules
from m2pem.mission.expression.temporal import Computed
from m2pem.mission.expression.tree import (
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
    binds,
    walk,
)
from m2pem.mission.values import ReadValue, Value


def bind(variable: str, item: Value, read: ReadValue) -> ReadValue:
    """Return a lookup that reads `variable`, and names below it, from the item."""

    def bound(name: str) -> Value:
        return _part(item, name[len(variable) + 1 :]) if binds(variable, name) else read(name)

    return bound


def _part(value: Value, path: str) -> Value:
    """Return the value at a dotted path in maps; null if there is none."""
    for key in path.split(".") if path else ():
        value = value.get(key) if isinstance(value, dict) else None
    return value


def evaluate(node: Node, read: ReadValue, rules: Rules) -> Computed:
    """The tree's value by the rules of its language; it raises ExpressionError."""
    return _EVALUATE[type(node)](node, read, rules)


def _holds(node: Node, read: ReadValue, rules: Rules, what: str) -> bool:
    value = _EVALUATE[type(node)](node, read, rules)
    return value if value is True or value is False else rules.truth(value, what)


def _literal(node: Literal, read: ReadValue, rules: Rules) -> Computed:
    return node.value


def _name(node: Name, read: ReadValue, rules: Rules) -> Computed:
    return read(node.name)


def _not(node: Not, read: ReadValue, rules: Rules) -> Computed:
    return not _holds(node.operand, read, rules, "'not'")


def _and(node: And, read: ReadValue, rules: Rules) -> Computed:
    for operand in node.operands:  # noqa: SIM110  # a generator costs more than all of it
        if not _holds(operand, read, rules, "'and'"):
            return False
    return True


def _or(node: Or, read: ReadValue, rules: Rules) -> Computed:
    for operand in node.operands:  # noqa: SIM110  # a generator costs more than all of it
        if _holds(operand, read, rules, "'or'"):
            return True
    return False


def _compare(node: Compare, read: ReadValue, rules: Rules) -> Computed:
    operator, right = node.operator, node.right
    value = _EVALUATE[type(node.left)](node.left, read, rules)
    if type(right) is Literal:
        other = right.value
        # What conditions mostly are; for a text or null, Python's `==` is the same.
        if rules.compare is COMPARISONS and (other is None or type(other) is str):
            if operator is Comparison.EQUAL:
                return value == other
            if operator is Comparison.NOT_EQUAL:
                return value != other
        return rules.compare[operator](value, other)
    return rules.compare[operator](value, _EVALUATE[type(right)](right, read, rules))


def _in(node: In, read: ReadValue, rules: Rules) -> Computed:
    container = evaluate(node.container, read, rules)
    return contains(container, evaluate(node.item, read, rules))


def _negate(node: Negate, read: ReadValue, rules: Rules) -> Computed:
    return rules.negate(evaluate(node.operand, read, rules))


def _arithmetic(node: Arithmetic, read: ReadValue, rules: Rules) -> Computed:
    left = _EVALUATE[type(node.left)](node.left, read, rules)
    return rules.arithmetic[node.operator](
        left, _EVALUATE[type(node.right)](node.right, read, rules)
    )


def _index(node: Index, read: ReadValue, rules: Rules) -> Computed:
    container = evaluate(node.container, read, rules)
    return index(container, evaluate(node.key, read, rules))


def _if(node: If, read: ReadValue, rules: Rules) -> Computed:
    chosen = node.then if _holds(node.condition, read, rules, "a condition") else node.otherwise
    return evaluate(chosen, read, rules)


def _some(node: Some, read: ReadValue, rules: Rules) -> Computed:
    items = evaluate(node.collection, read, rules)
    if items is None:
        return False
    if not isinstance(items, list):
        raise ExpressionError(f"'some' and 'every' take a list, not {describe(items)}")
    size = sum(1 for _ in walk(node.condition))
    for item in items:
        look_at(size)
        if _holds(node.condition, bind(node.variable, item, read), rules, "a condition"):
            return True
    return False


def _list(node: ListOf, read: ReadValue, rules: Rules) -> Computed:
    return bounded_list([evaluate(item, read, rules) for item in node.items])  # type: ignore[return-value]


def _call(node: Call, read: ReadValue, rules: Rules) -> Computed:
    return LISTED[node.function].call([evaluate(each, read, rules) for each in node.arguments])


def _join(node: Join, read: ReadValue, rules: Rules) -> Computed:
    return join([evaluate(part, read, rules) for part in node.parts])


_EVALUATE: dict[type[Node], Callable[[Any, ReadValue, Rules], Computed]] = {
    Literal: _literal,
    Name: _name,
    ListOf: _list,
    Not: _not,
    And: _and,
    Or: _or,
    Compare: _compare,
    In: _in,
    Negate: _negate,
    Arithmetic: _arithmetic,
    Call: _call,
    If: _if,
    Index: _index,
    Some: _some,
    Join: _join,
}
