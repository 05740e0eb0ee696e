"""Whether the conditions of a gateway's flows leave a case in which none of them is true.

Each comparison is tried with values on both sides of its literal. What is no comparison with a
literal, such as a function, may have any value. Null is tried only where a condition names it.
"""

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import pairwise, product
from math import prod
from typing import TypeAlias

from m2pem.bpmn.data_names import written_by
from m2pem.mission.behavior import Assignment
from m2pem.mission.elements import BoundaryEvent, FlowNode, ScriptTask, SubProcess, UserTask
from m2pem.mission.expression import Expression
from m2pem.mission.expression import tree as t
from m2pem.mission.expression.operators import ORDERS

Scalar: TypeAlias = bool | int | float | str | None
_Values: TypeAlias = dict[tuple[type, Scalar], Scalar]
"""Values by their type, as 1 and True are the same key."""
_Case: TypeAlias = Mapping[t.Node, Scalar]

MAX_CASES = 20_000
"""Conditions with more combinations of values are not looked at."""


def uncovered(node: FlowNode, written: "WrittenValues") -> str | None:
    """Describe a case in which no condition of a node's flows is true, "" if no name tells it.

    None: there is none, or the file does not say which values there are.
    """
    conditions = [flow.condition for flow in node.outgoing if flow.condition is not None]
    names = {name for each in conditions for name in each.names}
    try:
        values = {name: written.at(node, name) for name in names}
    except UnclearError:
        return None
    return uncovered_case(
        conditions, {name: each for name, each in values.items() if each is not None}
    )


def uncovered_case(
    conditions: Sequence[Expression], possible: Mapping[str, Collection[Scalar]]
) -> str | None:
    """As `uncovered`. `possible`: all values of those names of which they are known."""
    trees = [each.tree for each in conditions]
    compared: dict[t.Node, _Values] = defaultdict(dict)
    for tree in trees:
        _note(tree, compared)
    tried = {term: _tried(term, values, possible) for term, values in compared.items()}
    if prod(map(len, tried.values())) > MAX_CASES:
        return None
    for chosen in product(*tried.values()):
        case = dict(zip(tried, chosen, strict=True))
        if not any(_holds(tree, case) for tree in trees):
            return " and ".join(_clauses(case, compared))
    return None


class UnclearError(Exception):
    """It is not clear from the file which values a name may have."""


class WrittenValues:
    """The values that names may have at a node, by what the nodes on the way to it write.

    `outside`: names that are written from outside of the file, or by services and behaviors.
    """

    def __init__(self, nodes: Sequence[FlowNode], outside: Collection[str]) -> None:
        self._outside = outside
        self._constants = {node: dict(_constants(node)) for node in nodes}
        self._writes = {node: written_by(node) for node in nodes}
        self._within: dict[FlowNode, set[str]] = defaultdict(set)
        for node in nodes:
            around = node.container
            while isinstance(around, SubProcess):
                self._within[around] |= self._writes[node]
                around = around.container
        self._written = {name for names in self._writes.values() for name in names}

    def at(self, node: FlowNode, name: str) -> tuple[Scalar, ...] | None:
        """All values that a name may have where a node begins; None: any value.

        Raises:
            UnclearError: some may come from elsewhere.
        """
        if name in self._outside:
            return None
        values: _Values = {}
        any_value = False
        seen: set[FlowNode] = {node}
        waiting = [node]
        while waiting:
            current = waiting.pop()
            before = _before(current)
            if not before and name in self._written:
                raise UnclearError
            any_value = any_value or not before
            for each in before - seen:
                seen.add(each)
                if name in self._constants[each]:
                    _add(values, *self._constants[each][name])
                elif name in self._writes[each]:
                    any_value = True
                elif name in self._within[each]:
                    raise UnclearError
                else:
                    waiting.append(each)
        return None if any_value else tuple(values.values())


def _before(node: FlowNode) -> set[FlowNode]:
    """The nodes from which tokens come to a node; empty where a process or event begins."""
    if isinstance(node, BoundaryEvent):
        return _before(node.attached_to)  # which has not ended, and has written nothing
    if not node.incoming and isinstance(node.container, SubProcess):
        return set() if node.container.triggered_by_event else _before(node.container)
    return {flow.source for flow in node.incoming}


def _constants(node: FlowNode) -> Iterator[tuple[str, list[Scalar]]]:
    if isinstance(node, UserTask) and node.prompt is not None:
        yield node.prompt.store, [each.value for each in node.prompt.decisions]
    elif isinstance(node, ScriptTask) and node.script is not None:
        assigned: dict[str, list[t.Node]] = defaultdict(list)
        for each in node.script.statements:
            if isinstance(each, Assignment):
                assigned[each.key].append(each.expression.tree)
        for key, trees in assigned.items():
            values = [tree.value for tree in trees if isinstance(tree, t.Literal)]
            if len(values) == len(trees):
                yield key, values


def _add(values: _Values, *more: Scalar) -> None:
    values.update({(type(each), each): each for each in more})


def _note(node: t.Node, compared: dict[t.Node, _Values]) -> None:
    """Note what a condition depends on, each with the values that it is compared with."""
    match node:
        case t.And() | t.Or() | t.Not():
            for each in t.children(node):
                _note(each, compared)
        case t.Compare(left=left, right=right):
            _note_pair(left, right, compared)
        case t.In(item=item, container=t.ListOf(items=items)):
            for each in items:
                _note_pair(item, each, compared)
        case t.Literal():
            pass
        case _:
            _add(compared[node], True, False)


def _note_pair(left: t.Node, right: t.Node, compared: dict[t.Node, _Values]) -> None:
    for term, other in ((left, right), (right, left)):
        if _is_literal(term):
            continue
        if _is_literal(other):
            _add(compared[term], _literal(other))
        else:
            _add(compared[term], 0, 1)


def _is_literal(node: t.Node) -> bool:
    return isinstance(node.operand if isinstance(node, t.Negate) else node, t.Literal)


def _literal(node: t.Node) -> Scalar:
    if isinstance(node, t.Negate):
        value = _literal(node.operand)
        return -value if isinstance(value, int | float) else value
    assert isinstance(node, t.Literal)
    return node.value


def _tried(
    term: t.Node, compared: _Values, possible: Mapping[str, Collection[Scalar]]
) -> list[Scalar]:
    """The values to try: those that are compared, and others between and around them."""
    if isinstance(term, t.Name) and term.name in possible:
        return list(possible[term.name])
    values = dict(compared)
    given = list(compared.values())
    if any(isinstance(each, bool) for each in given):
        _add(values, True, False)
    numbers = sorted(
        each for each in given if isinstance(each, int | float) and not isinstance(each, bool)
    )
    if numbers:
        _add(values, numbers[0] - 1, numbers[-1] + 1)
        between = ((low + high) / 2 for low, high in pairwise(numbers))
        _add(values, *(each for each in between if not _is_between_neighbours(each, given)))
    texts = [each for each in given if isinstance(each, str)]
    if texts or given == [None]:
        _add(values, _another(texts))
    return list(values.values())


def _is_between_neighbours(number: float, given: Collection[Scalar]) -> bool:
    """Whether only a fraction is between two whole numbers: `n <= 3` and `n >= 4` count."""
    low, high = number - 0.5, number + 0.5
    return low.is_integer() and low in given and high in given


def _another(texts: Collection[str]) -> str:
    other = "another text"
    while other in texts:
        other += "_"
    return other


def _holds(node: t.Node, case: _Case) -> bool:
    match node:
        case t.And(operands):
            return all(_holds(each, case) for each in operands)
        case t.Or(operands):
            return any(_holds(each, case) for each in operands)
        case t.Not(operand):
            return not _holds(operand, case)
        case t.Compare(how, left, right):
            return _compared(how, _value(left, case), _value(right, case))
        case t.In(item=item, container=t.ListOf(items=items)):
            return any(_equal(_value(item, case), _value(each, case)) for each in items)
    return _value(node, case) is True


def _value(node: t.Node, case: _Case) -> Scalar:
    return _literal(node) if _is_literal(node) else case[node]


def _compared(how: t.Comparison, left: Scalar, right: Scalar) -> bool:
    match how:
        case t.Comparison.EQUAL:
            return _equal(left, right)
        case t.Comparison.NOT_EQUAL:
            return not _equal(left, right)
    for kind in (str, int | float):
        if isinstance(left, kind) and isinstance(right, kind):
            return ORDERS[how](left, right)
    return True  # it cannot be evaluated, which is another error than the one looked for


def _equal(left: Scalar, right: Scalar) -> bool:
    return left == right and isinstance(left, bool) == isinstance(right, bool)


def _clauses(case: _Case, compared: Mapping[t.Node, _Values]) -> Iterator[str]:
    """The case in words, as far as names tell it: "mode is none of 'a', 'b'"."""
    shown = {True: "true", False: "false", None: "null"}
    for term, value in case.items():
        if not isinstance(term, t.Name):
            continue
        texts = sorted(each for each in compared[term].values() if isinstance(each, str))
        if isinstance(value, str) and value == _another(texts):
            yield f"{term.name} is {'not' if len(texts) == 1 else 'none of'} " + ", ".join(
                map(repr, texts)
            )
        elif value is None or isinstance(value, bool):
            yield f"{term.name} is {shown[value]}"
        else:
            yield f"{term.name} is {value!r}"
