"""Evaluates a syntax tree over the data store: the tree is walked, nothing is compiled.

Most expressions of a mission are evaluated once or never, so that preparing them costs more than it
saves.
"""

from collections.abc import Callable, Iterable, Sequence
from contextvars import ContextVar
from datetime import date, timedelta
from typing import Any

from m2pem.errors import ExpressionError
from m2pem.mission.expression import feel_values as feel
from m2pem.mission.expression.functions import LISTED
from m2pem.mission.expression.operators import (
    COMPARISONS,
    bounded_list,
    contains,
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
    ContextOf,
    Every,
    Filter,
    For,
    If,
    In,
    Index,
    InstanceOf,
    Invoke,
    Join,
    Lambda,
    ListOf,
    Literal,
    Name,
    Negate,
    Node,
    Not,
    Or,
    Path,
    RangeOf,
    Some,
    TypeName,
    binds,
    walk,
)
from m2pem.mission.values import ReadValue, Value

MAX_CALLS = 50
"""How deep functions may call each other."""

_calls = ContextVar("_calls", default=0)
_TYPES = {"string": "text"}


def bind(variable: str, item: Value, read: ReadValue) -> ReadValue:
    """Return a lookup that reads `variable`, and names below it, from the item."""

    def bound(name: str) -> Value:
        return _part(item, name[len(variable) + 1 :]) if binds(variable, name) else read(name)

    return bound


def _part(value: Value, path: str) -> Value:
    """Return the value at a dotted path; null if there is none."""
    for key in path.split(".") if path else ():
        value = value.get(key) if isinstance(value, dict) else feel.path(value, key)
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
    value = read(node.name)
    if value is None and rules.ternary and "." in node.name:
        head, _, rest = node.name.rpartition(".")
        return feel.path(_name(Name(head), read, rules), rest)
    return value


def _truth(node: Node, read: ReadValue, rules: Rules) -> bool | None:
    """The truth of a node in FEEL; null: it has none."""
    value = _EVALUATE[type(node)](node, read, rules)
    return value if value is True or value is False else feel.truth(value)


def _not(node: Not, read: ReadValue, rules: Rules) -> Computed:
    if rules.ternary:
        found = _truth(node.operand, read, rules)
        return None if found is None else not found
    return not _holds(node.operand, read, rules, "'not'")


def _and(node: And, read: ReadValue, rules: Rules) -> Computed:
    if rules.ternary:
        return _decided(False, node.operands, read, rules)
    for operand in node.operands:  # noqa: SIM110  # a generator costs more than all of it
        if not _holds(operand, read, rules, "'and'"):
            return False
    return True


def _or(node: Or, read: ReadValue, rules: Rules) -> Computed:
    if rules.ternary:
        return _decided(True, node.operands, read, rules)
    for operand in node.operands:  # noqa: SIM110  # a generator costs more than all of it
        if _holds(operand, read, rules, "'or'"):
            return True
    return False


def _decided(by: bool, nodes: Iterable[Node], read: ReadValue, rules: Rules) -> bool | None:
    """`by` if one of them is; else null if one of them is; else the other one."""
    found: bool | None = not by
    for each in nodes:
        value = _EVALUATE[type(each)](each, read, rules)
        if value is by:
            return by is True
        if value is not True and value is not False:
            feel.truth(value)
            found = None
    return found


def _compare(node: Compare, read: ReadValue, rules: Rules) -> Computed:
    operator, right = node.operator, node.right
    value = _EVALUATE[type(node.left)](node.left, read, rules)
    if type(right) is Literal:
        other = right.value
        # What conditions mostly are; Python's `==` is the same.
        if rules.compare is COMPARISONS and (other is None or type(other) is type(value) is str):
            if operator is Comparison.EQUAL:
                return value == other
            if operator is Comparison.NOT_EQUAL:
                return value != other
        return rules.compare[operator](value, other)
    return rules.compare[operator](value, _EVALUATE[type(right)](right, read, rules))


def _in(node: In, read: ReadValue, rules: Rules) -> Computed:
    container = evaluate(node.container, read, rules)
    item = evaluate(node.item, read, rules)
    return feel.contains(container, item) if rules.ternary else contains(container, item)


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
    if rules.ternary:
        holds = _truth(node.condition, read, rules) is True
    else:
        holds = _holds(node.condition, read, rules, "a condition")
    return evaluate(node.then if holds else node.otherwise, read, rules)


def _some(node: Some, read: ReadValue, rules: Rules) -> Computed:
    return _quantified(node, True, read, rules)


def _every(node: Every, read: ReadValue, rules: Rules) -> Computed:
    return _quantified(node, False, read, rules)


def _quantified(node: Some | Every, by: bool, read: ReadValue, rules: Rules) -> Computed:
    items = _items(evaluate(node.collection, read, rules))
    if items is None:
        return None
    size = sum(1 for _ in walk(node.condition))

    found: bool | None = not by
    for item in items:
        look_at(size)
        truth = _truth(node.condition, bind(node.variable, item, read), rules)
        if truth is by:
            return by
        found = None if truth is None else found
    return found


def _items(value: Computed) -> list[Computed] | None:
    """What an iteration goes through: a list, whole numbers or days of a range, or one value."""
    if value is None:
        return None
    if not isinstance(value, feel.Range):
        return value if isinstance(value, list) else [value]
    low, high = value.low, value.high
    days = type(low) is type(high) is date
    if not days and not (feel.is_number(low) and feel.is_number(high)):
        feel.without_value(f"a range of {feel.describe(low)} has no items")
        return None
    if low > high and not value.descends:
        feel.without_value("a range from a higher value to a lower one has no items")
        return None
    step: Any = timedelta(days=1) if days else 1
    count = int(abs(high - low) // step) + 1
    look_at(count)
    found = [low + (each if low <= high else -each) * step for each in range(count)]
    return [each for each in found if value.descends or feel.in_range(each, value)]


def _for(node: For, read: ReadValue, rules: Rules) -> Computed:
    found: list[Computed] = []
    size = sum(1 for _ in walk(node.result))

    def through(iterators: Sequence[tuple[str, Node]], read: ReadValue) -> bool:
        if not iterators:
            look_at(size)
            found.append(evaluate(node.result, bind("partial", found, read), rules))
            return True
        (variable, collection), *rest = iterators
        items = _items(evaluate(collection, read, rules))
        if items is None:
            return False
        return all(through(rest, bind(variable, each, read)) for each in items)

    return bounded_list([*found]) if through(node.iterators, read) else None


def _filter(node: Filter, read: ReadValue, rules: Rules) -> Computed:
    container = evaluate(node.container, read, rules)
    if container is None:
        return None
    items = container if isinstance(container, list) else [container]
    if isinstance(node.condition, Literal | Negate | Name | Arithmetic | Call):
        place = evaluate(node.condition, read, rules)
        if feel.is_number(place):
            whole = int(place)
            if not whole or abs(whole) > len(items):
                feel.without_value(f"there is no item {place} of {len(items)}")
                return None
            return items[whole - 1 if whole > 0 else whole]
    size = sum(1 for _ in walk(node.condition))
    chosen = []
    for each in items:
        look_at(size)
        if _truth(node.condition, bind_item(each, read), rules) is True:
            chosen.append(each)
    return chosen


def bind_item(item: Computed, read: ReadValue) -> ReadValue:
    """Return a lookup that reads `item`, and the entries of an item that is a context."""
    entries = item if isinstance(item, dict) else {}

    def bound(name: str) -> Value:
        head, _, rest = name.partition(".")
        if head in entries:
            return _part(entries[head], rest)
        return _part(item, rest) if head == "item" else read(name)

    return bound


def _path(node: Path, read: ReadValue, rules: Rules) -> Computed:
    return feel.path(evaluate(node.container, read, rules), node.key)


def _context(node: ContextOf, read: ReadValue, rules: Rules) -> Computed:
    found: dict[str, Computed] = {}

    def around(name: str) -> Computed:
        head, _, rest = name.partition(".")
        if name in found:
            return found[name]
        return _part(found[head], rest) if head in found else read(name)

    for key, value in node.entries:
        found[key] = evaluate(value, around, rules)
    return bounded_list([found])[0]


def _range(node: RangeOf, read: ReadValue, rules: Rules) -> Computed:
    low, high = (
        None if each is None else evaluate(each, read, rules) for each in (node.low, node.high)
    )
    ends = [each for each in (low, high) if each is not None]
    if len({feel.kind(each) for each in ends}) > 1 or not all(map(feel.is_ordered, ends)):
        feel.without_value(f"a range from {feel.describe(low)} to {feel.describe(high)}")
        return None
    included, unbounded = (
        (node.low_included, node.high_included),
        (node.low is None, node.high is None),
    )
    return feel.Range(low, high, *included, node.negated, node.descends, *unbounded)


def _lambda(node: Lambda, read: ReadValue, rules: Rules) -> Computed:
    def call(closure: feel.Closure, arguments: list[Computed]) -> Computed:
        inner = closure.read
        for name, value in zip(closure.parameters, arguments, strict=True):
            inner = bind(name, value, inner)
        look_at(sum(1 for _ in walk(closure.body)))
        depth = _calls.get()
        if depth >= MAX_CALLS:
            raise ExpressionError(f"functions call each other deeper than {MAX_CALLS} levels")
        token = _calls.set(depth + 1)
        try:
            return evaluate(closure.body, inner, rules)
        finally:
            _calls.reset(token)

    return feel.Closure(node.parameters, node.body, read, call)


def _invoke(node: Invoke, read: ReadValue, rules: Rules) -> Computed:
    function = evaluate(node.function, read, rules)
    if not isinstance(function, feel.Closure):
        feel.without_value(f"{feel.describe(function)} is no function")
        return None
    arguments = [evaluate(each, read, rules) for each in node.arguments]
    if node.names:
        given = dict(zip(node.names, arguments, strict=True))
        if {*given} != {*function.parameters}:
            feel.without_value("a function is called with other arguments than it has")
            return None
        arguments = [given[each] for each in function.parameters]
    if len(arguments) != len(function.parameters):
        feel.without_value(
            f"a function of {len(function.parameters)} arguments got {len(arguments)}"
        )
        return None
    return function.call(function, arguments)


def _instance_of(node: InstanceOf, read: ReadValue, rules: Rules) -> Computed:
    return _is_a(evaluate(node.value, read, rules), node.type)


def _is_a(value: Computed, wanted: TypeName) -> bool:
    name, parts = wanted
    if value is None:
        return name == "Null"
    if name == "Any":
        return True
    if feel.kind(value) != _TYPES.get(name, name):
        return False
    if name == "list" and parts:
        return all(each is None or _is_a(each, parts[0][1]) for each in value)
    if name == "context":
        return all(
            key in value and (value[key] is None or _is_a(value[key], each)) for key, each in parts
        )
    if name == "range" and parts:
        ends = [each for each in (value.low, value.high) if each is not None]
        return all(_is_a(each, parts[0][1]) for each in ends)
    return True


def _list(node: ListOf, read: ReadValue, rules: Rules) -> Computed:
    return bounded_list([evaluate(item, read, rules) for item in node.items])


def _call(node: Call, read: ReadValue, rules: Rules) -> Computed:
    arguments = [evaluate(each, read, rules) for each in node.arguments]
    if rules.ternary and not node.function.startswith("FEEL "):
        arguments = [feel.to_data(each) for each in arguments]
    return LISTED[node.function].call(arguments)


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
    Every: _every,
    For: _for,
    Filter: _filter,
    Path: _path,
    ContextOf: _context,
    RangeOf: _range,
    Lambda: _lambda,
    Invoke: _invoke,
    InstanceOf: _instance_of,
    Join: _join,
}
