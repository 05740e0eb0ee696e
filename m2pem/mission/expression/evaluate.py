"""Makes what evaluates a syntax tree over the data store: a function for each node, once.

What the rules of a language decide is decided then, not at each evaluation.
"""

from collections.abc import Callable, Container, Iterable, Sequence
from contextvars import ContextVar
from datetime import date, timedelta
from functools import partial
from typing import Any, TypeAlias

from m2pem.errors import ExpressionError
from m2pem.mission.expression import feel_values as feel
from m2pem.mission.expression import tree as t
from m2pem.mission.expression.functions import LISTED
from m2pem.mission.expression.operators import (
    ORDERS,
    SAME,
    bounded_list,
    contains,
    index,
    join,
    look_at,
)
from m2pem.mission.expression.rules import Rules
from m2pem.mission.expression.temporal import Computed
from m2pem.mission.values import ReadValue, Value

Evaluate: TypeAlias = Callable[[ReadValue], Computed]
"""Gives a node's value over the data store; raises ExpressionError."""

MAX_CALLS = 50
"""How deep functions may call each other."""

tracing = ContextVar[Callable[[t.Node, Evaluate], Evaluate] | None]("tracing", default=None)
"""Wraps what evaluates each node, to see what fails."""

_calls = ContextVar("_calls", default=0)
_TYPES = {"string": "text"}

_NUMBERS = frozenset({int, float})
_EXACT = 2**53
"""Whole numbers below are doubles, too, so that all languages compare others with them alike."""


def bind(variable: str, item: Value, read: ReadValue) -> ReadValue:
    """Return a lookup that reads `variable`, and names below it, from the item."""

    def bound(name: str) -> Value:
        return _part(item, name[len(variable) + 1 :]) if t.binds(variable, name) else read(name)

    return bound


def _part(value: Value, path: str) -> Value:
    """Return the value at a dotted path; null if there is none."""
    for key in path.split(".") if path else ():
        value = value.get(key) if isinstance(value, dict) else feel.path(value, key)
    return value


def evaluate(node: t.Node, read: ReadValue, rules: Rules) -> Computed:
    """The tree's value by the rules of its language; it raises ExpressionError."""
    return evaluator(node, rules)(read)


def evaluator(node: t.Node, rules: Rules) -> Evaluate:
    """Return what evaluates a tree by the rules of its language."""
    run, traced = _MAKE[type(node)](node, rules), tracing.get()
    return run if traced is None else traced(node, run)


def _all(nodes: Iterable[t.Node], rules: Rules) -> list[Evaluate]:
    return [evaluator(each, rules) for each in nodes]


def _size(node: t.Node) -> int:
    return sum(1 for _ in t.walk(node))


def _literal(node: t.Literal, rules: Rules) -> Evaluate:
    value = node.value
    return lambda read: value


def _name(node: t.Name, rules: Rules) -> Evaluate:
    name = node.name
    if not rules.ternary or "." not in name:
        return lambda read: read(name)
    head, _, rest = name.rpartition(".")
    container = _name(t.Name(head), rules)

    def path(read: ReadValue) -> Computed:
        value = read(name)
        return feel.path(container(read), rest) if value is None else value

    return path


def _truth(run: Evaluate) -> Callable[[ReadValue], bool | None]:
    """The truth of a node in FEEL; null: it has none."""

    def truth(read: ReadValue) -> bool | None:
        value = run(read)
        return value if value is True or value is False else feel.truth(value)

    return truth


def _not(node: t.Not, rules: Rules) -> Evaluate:
    run = evaluator(node.operand, rules)

    def negated(read: ReadValue) -> Computed:
        value = run(read)
        if value is not True and value is not False:
            value = feel.truth(value) if rules.ternary else rules.truth(value, "'not'")
        return None if value is None else not value

    return negated


def _decided(by: bool, node: t.And | t.Or, rules: Rules) -> Evaluate:
    """`by` if one of them is, the rest is not evaluated; in FEEL null if one has no truth."""
    runs, truth = _all(node.operands, rules), rules.truth
    what = "'or'" if by else "'and'"

    def ternary(read: ReadValue) -> Computed:
        found: bool | None = not by
        for run in runs:
            value = run(read)
            if value is by:
                return by
            if value is not True and value is not False:
                feel.truth(value)
                found = None
        return found

    def binary(read: ReadValue) -> Computed:
        for run in runs:
            value = run(read)
            if value is not True and value is not False:
                value = truth(value, what)
            if value is by:
                return by
        return not by

    return ternary if rules.ternary else binary


def _compare(node: t.Compare, rules: Rules) -> Evaluate:
    left, test, sign = evaluator(node.left, rules), rules.compare[node.operator], node.operator
    if not isinstance(node.right, t.Literal):
        right = evaluator(node.right, rules)
        return lambda read: test(left(read), right(read))
    other = node.right.value
    # What conditions mostly are: all languages compare them alike, and so does Python.
    alike: Container[type] = ()
    if type(other) is str and sign in SAME:
        alike = (str,)
    elif (type(other) is int or type(other) is float) and abs(other) < _EXACT:
        # JUEL orders -0.0 before 0.0.
        alike = _NUMBERS if other or rules.ternary else (int,) if type(other) is int else ()
    direct = {**ORDERS, **SAME}[sign]

    def compared(read: ReadValue) -> Computed:
        value = left(read)
        if type(value) in alike and value == value:  # noqa: PLR0124 as what is not a number is not
            return direct(value, other)
        return test(value, other)

    return compared if alike else lambda read: test(left(read), other)


def _in(node: t.In, rules: Rules) -> Evaluate:
    container, item = _all((node.container, node.item), rules)
    held = feel.contains if rules.ternary else contains
    return lambda read: held(container(read), item(read))


def _negate(node: t.Negate, rules: Rules) -> Evaluate:
    run, negate = evaluator(node.operand, rules), rules.negate
    return lambda read: negate(run(read))


def _arithmetic(node: t.Arithmetic, rules: Rules) -> Evaluate:
    left, compute = evaluator(node.left, rules), rules.arithmetic[node.operator]
    if isinstance(node.right, t.Literal):
        other = node.right.value
        return lambda read: compute(left(read), other)
    right = evaluator(node.right, rules)
    return lambda read: compute(left(read), right(read))


def _index(node: t.Index, rules: Rules) -> Evaluate:
    container, key = _all((node.container, node.key), rules)
    return lambda read: index(container(read), key(read))


def _if(node: t.If, rules: Rules) -> Evaluate:
    run, then, otherwise = _all((node.condition, node.then, node.otherwise), rules)

    def chosen(read: ReadValue) -> Computed:
        holds = run(read)
        if holds is not True and holds is not False:
            holds = feel.truth(holds) if rules.ternary else rules.truth(holds, "a condition")
        return then(read) if holds else otherwise(read)

    return chosen


def _quantified(by: bool, node: t.Some | t.Every, rules: Rules) -> Evaluate:
    collection, condition = _all((node.collection, node.condition), rules)
    holds, variable, size = _truth(condition), node.variable, _size(node.condition)

    def quantified(read: ReadValue) -> Computed:
        items = _items(collection(read))
        if items is None:
            return None
        found: bool | None = not by
        for item in items:
            look_at(size)
            truth = holds(bind(variable, item, read))
            if truth is by:
                return by
            found = None if truth is None else found
        return found

    return quantified


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


def _for(node: t.For, rules: Rules) -> Evaluate:
    iterators = [(name, evaluator(each, rules)) for name, each in node.iterators]
    result, size = evaluator(node.result, rules), _size(node.result)

    def through(
        iterators: Sequence[tuple[str, Evaluate]], read: ReadValue, found: list[Computed]
    ) -> bool:
        if not iterators:
            look_at(size)
            found.append(result(bind("partial", found, read)))
            return True
        (variable, collection), *rest = iterators
        items = _items(collection(read))
        if items is None:
            return False
        return all(through(rest, bind(variable, each, read), found) for each in items)

    def iterated(read: ReadValue) -> Computed:
        found: list[Computed] = []
        return bounded_list([*found]) if through(iterators, read, found) else None

    return iterated


def _filter(node: t.Filter, rules: Rules) -> Evaluate:
    container, condition = _all((node.container, node.condition), rules)
    holds, size = _truth(condition), _size(node.condition)
    may_be_place = isinstance(node.condition, t.Literal | t.Negate | t.Name | t.Arithmetic | t.Call)

    def filtered(read: ReadValue) -> Computed:
        value = container(read)
        if value is None:
            return None
        items = value if isinstance(value, list) else [value]
        if may_be_place and feel.is_number(at := condition(read)):
            whole = int(at)
            if not whole or abs(whole) > len(items):
                feel.without_value(f"there is no item {at} of {len(items)}")
                return None
            return items[whole - 1 if whole > 0 else whole]
        chosen = []
        for each in items:
            look_at(size)
            if holds(bind_item(each, read)) is True:
                chosen.append(each)
        return chosen

    return filtered


def bind_item(item: Computed, read: ReadValue) -> ReadValue:
    """Return a lookup that reads `item`, and the entries of an item that is a context."""
    entries = item if isinstance(item, dict) else {}

    def bound(name: str) -> Value:
        head, _, rest = name.partition(".")
        if head in entries:
            return _part(entries[head], rest)
        return _part(item, rest) if head == "item" else read(name)

    return bound


def _path(node: t.Path, rules: Rules) -> Evaluate:
    container, key = evaluator(node.container, rules), node.key
    return lambda read: feel.path(container(read), key)


def _context(node: t.ContextOf, rules: Rules) -> Evaluate:
    entries = [(key, evaluator(each, rules)) for key, each in node.entries]

    def context(read: ReadValue) -> Computed:
        found: dict[str, Computed] = {}

        def around(name: str) -> Computed:
            head, _, rest = name.partition(".")
            if name in found:
                return found[name]
            return _part(found[head], rest) if head in found else read(name)

        for key, run in entries:
            found[key] = run(around)
        return bounded_list([found])[0]

    return context


def _range(node: t.RangeOf, rules: Rules) -> Evaluate:
    low_run, high_run = (
        (lambda read: None) if each is None else evaluator(each, rules)
        for each in (node.low, node.high)
    )
    included, negated = (node.low_included, node.high_included), node.negated
    opens = node.low is None, node.high is None

    def ranged(read: ReadValue) -> Computed:
        low, high = low_run(read), high_run(read)
        ends = [each for each in (low, high) if each is not None]
        if len({feel.kind(each) for each in ends}) > 1 or not all(map(feel.is_ordered, ends)):
            feel.without_value(f"a range from {feel.describe(low)} to {feel.describe(high)}")
            return None
        return feel.Range(low, high, *included, negated, node.descends, *opens)

    return ranged


def _lambda(node: t.Lambda, rules: Rules) -> Evaluate:
    body, size = evaluator(node.body, rules), _size(node.body)

    def call(closure: feel.Closure, arguments: list[Computed]) -> Computed:
        inner = closure.read
        for name, value in zip(closure.parameters, arguments, strict=True):
            inner = bind(name, value, inner)
        look_at(size)
        depth = _calls.get()
        if depth >= MAX_CALLS:
            raise ExpressionError(f"functions call each other deeper than {MAX_CALLS} levels")
        token = _calls.set(depth + 1)
        try:
            return body(inner)
        finally:
            _calls.reset(token)

    return lambda read: feel.Closure(node.parameters, node.body, read, call)


def _invoke(node: t.Invoke, rules: Rules) -> Evaluate:
    called, runs = evaluator(node.function, rules), _all(node.arguments, rules)

    def invoked(read: ReadValue) -> Computed:
        function = called(read)
        if not isinstance(function, feel.Closure):
            feel.without_value(f"{feel.describe(function)} is no function")
            return None
        arguments = [run(read) for run in runs]
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

    return invoked


def _instance_of(node: t.InstanceOf, rules: Rules) -> Evaluate:
    run, wanted = evaluator(node.value, rules), node.type
    return lambda read: _is_a(run(read), wanted)


def _is_a(value: Computed, wanted: t.TypeName) -> bool:
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


def _list(node: t.ListOf, rules: Rules) -> Evaluate:
    if all(isinstance(each, t.Literal) for each in node.items):
        values = [each.value for each in node.items if isinstance(each, t.Literal)]
        size = 1 + sum(1 + len(each) if isinstance(each, str) else 1 for each in values)

        def listed(read: ReadValue) -> Computed:
            look_at(size)
            return [*values]

        return listed
    runs = _all(node.items, rules)
    return lambda read: bounded_list([run(read) for run in runs])


def _call(node: t.Call, rules: Rules) -> Evaluate:
    call, runs = LISTED[node.function].of(len(node.arguments)), _all(node.arguments, rules)
    if rules.ternary and not node.function.startswith("FEEL "):
        return lambda read: call([feel.to_data(run(read)) for run in runs])
    return lambda read: call([run(read) for run in runs])


def _join(node: t.Join, rules: Rules) -> Evaluate:
    runs = _all(node.parts, rules)
    return lambda read: join([run(read) for run in runs])


_MAKE: dict[type[t.Node], Callable[[Any, Rules], Evaluate]] = {
    t.Literal: _literal,
    t.Name: _name,
    t.ListOf: _list,
    t.Not: _not,
    t.And: partial(_decided, False),
    t.Or: partial(_decided, True),
    t.Compare: _compare,
    t.In: _in,
    t.Negate: _negate,
    t.Arithmetic: _arithmetic,
    t.Call: _call,
    t.If: _if,
    t.Index: _index,
    t.Some: partial(_quantified, True),
    t.Every: partial(_quantified, False),
    t.For: _for,
    t.Filter: _filter,
    t.Path: _path,
    t.ContextOf: _context,
    t.RangeOf: _range,
    t.Lambda: _lambda,
    t.Invoke: _invoke,
    t.InstanceOf: _instance_of,
    t.Join: _join,
}
