"""Finite domains: which values the names that conditions read can have.

A name is *followed* when the mission states all that is ever written to it, or what its conditions
compare it with. A value is then either exact, or represents all values that those comparisons
cannot distinguish from it. A name that is not followed is unknown: every condition on it may be
true and may be false.
"""

import itertools
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from m2pem.errors import ExpressionError
from m2pem.mission.expression import Expression
from m2pem.mission.expression import tree as t
from m2pem.mission.values import Value

MOST_VALUES = 40
"""Most values of one name; a name with more is not followed value by value."""
MOST_COMBINATIONS = 512


class Unknown:
    """A variable that may have any value."""

    __slots__ = ()


UNKNOWN = Unknown()


@dataclass(slots=True)
class Domain:
    """The values of one name; `exact` says which represent only themselves."""

    values: list[Value] = field(default_factory=list)
    exact: list[bool] = field(default_factory=list)
    _index: dict[tuple[str, str, bool], int] = field(default_factory=dict)

    def add(self, value: Value, exact: bool = True) -> int:
        """The number of a value, which is new or known."""
        key = (type(value).__name__, repr(value), exact)
        known = self._index.get(key)
        if known is None:
            known = self._index[key] = len(self.values)
            self.values.append(value)
            self.exact.append(exact)
        return known

    def find(self, value: Value, exact: bool = True) -> int | None:
        """The number of a value, if it has one."""
        return self._index.get((type(value).__name__, repr(value), exact))

    def like(self, value: Value) -> list[int]:
        """The numbers of all values that may represent a value, which may have none of its own."""
        known = self.find(value)
        if known is not None:
            return [known]
        return [
            number
            for number, (each, exact) in enumerate(zip(self.values, self.exact, strict=True))
            if not exact or (each == value and isinstance(each, bool) == isinstance(value, bool))
        ]

    @property
    def closed(self) -> bool:
        """Whether its values are all that are ever written."""
        return all(self.exact)


@dataclass(frozen=True, slots=True)
class Write:
    """A write to a name: the value of an expression over other names, or anything (None)."""

    key: str
    source: Expression | None
    hidden: frozenset[str] = frozenset()


def constants(expression: Expression) -> dict[str, set[tuple[str, Value]]]:
    """By name, the constants that an expression compares it with, each as (type, value)."""
    found: dict[str, set[tuple[str, Value]]] = {}
    for node, _ in t.walk(expression.tree):
        if isinstance(node, t.Compare):
            for one, other in ((node.left, node.right), (node.right, node.left)):
                if isinstance(one, t.Name) and isinstance(other, t.Literal):
                    kind = type(other.value).__name__
                    found.setdefault(one.name, set()).add((kind, other.value))
        elif (
            isinstance(node, t.In)
            and isinstance(node.item, t.Name)
            and isinstance(node.container, t.ListOf)
        ):
            for item in node.container.items:
                if isinstance(item, t.Literal):
                    kind = type(item.value).__name__
                    found.setdefault(node.item.name, set()).add((kind, item.value))
    return found


def tells_apart(node: t.Node) -> bool:
    """Whether the truth of an expression depends only on how values compare with its constants."""
    match node:
        case t.And(operands=operands) | t.Or(operands=operands):
            return all(tells_apart(each) for each in operands)
        case t.Not(operand=operand):
            return tells_apart(operand)
        case t.Literal():
            return True
        case t.Compare(left=left, right=right):
            names = isinstance(left, t.Name) + isinstance(right, t.Name)
            literals = isinstance(left, t.Literal) + isinstance(right, t.Literal)
            return names + literals == 2 and literals >= 1
        case t.In(item=item, container=container):
            return (
                isinstance(item, t.Name | t.Literal)
                and isinstance(container, t.ListOf)
                and all(isinstance(each, t.Literal) for each in container.items)
            )
        case _:
            return False


def representatives(compared: Iterable[tuple[str, Value]]) -> list[tuple[Value, bool]]:
    """Return a value of each kind that comparisons can distinguish; and whether it is exact.

    One that is not exact represents all that are neither equal to, nor between, those compared.
    """
    compared = list(compared)
    texts = {v for k, v in compared if k == "str"}
    numbers = sorted({v for k, v in compared if k in ("int", "float")})  # type: ignore[type-var]
    found: list[tuple[Value, bool]] = []
    for kind, value in sorted(compared, key=str):
        if kind in ("NoneType", "bool"):
            found.append((value, True))
    if not texts and not numbers:
        found = [(None, True), (True, True), (False, True)]
    found += [(text, True) for text in sorted(texts, key=str)]
    other = "something else"
    while other in texts:
        other += "!"
    if texts or not numbers:  # a text beside a number is an error
        found.append((other, False))
    for place, number in enumerate(numbers):
        assert isinstance(number, int | float)
        found.append((number, True))
        if place + 1 < len(numbers):
            following = numbers[place + 1]
            assert isinstance(following, int | float)
            found.append(((number + following) / 2, False))
    if numbers:
        first, last = numbers[0], numbers[-1]
        assert isinstance(first, int | float)
        assert isinstance(last, int | float)
        found += [(first - 1, False), (last + 1, False)]
    return found


class Domains:
    """The domains of all followed names, by key; found by evaluating what writes them."""

    def __init__(
        self,
        conditions: Iterable[tuple[Expression, frozenset[str]]],
        writes: Iterable[Write],
        initial: Mapping[str, Value],
        not_followed: Collection[str] = (),
    ) -> None:
        """`conditions`: with the names that are hidden where each is evaluated. `not_followed`:
        names that may have any value at any time."""
        self.of: dict[str, Domain] = {}
        self.unknown: set[str] = set()
        conditions = list(conditions)
        by_key: dict[str, list[Write]] = {}
        for write in writes:
            by_key.setdefault(write.key, []).append(write)
        compared: dict[str, set[tuple[str, Value]]] = {}
        wanted: list[str] = []
        for expression, hidden in conditions:
            wanted += [name for name in expression.names if name not in hidden]
            for name, values in constants(expression).items():
                compared.setdefault(name, set()).update(values)
        relevant: set[str] = set()
        while wanted:
            name = wanted.pop()
            if name in relevant:
                continue
            relevant.add(name)
            for write in by_key.get(name, ()):
                if write.source is not None:
                    wanted += [n for n in write.source.names if n not in write.hidden]
        for name in sorted(relevant):
            if name not in not_followed and (name in by_key or name in initial):
                self.of[name] = Domain()
                self.of[name].add(initial.get(name))
                self.of[name].add(None)  # what a called process begins with
            else:
                self.unknown.add(name)
        self._compared = compared
        self._open: set[str] = set()
        self._close([w for name in self.of for w in by_key.get(name, ())])

    def _close(self, writes: list[Write]) -> None:
        changed = True
        while changed:
            changed = False
            for write in writes:
                if write.key in self._open:
                    continue
                domain = self.of[write.key]
                before = len(domain.values)
                if any(isinstance(value, Unknown) for value in self._results(write)):
                    self.open(write.key)
                    changed = True
                    continue
                for value in self._results(write):
                    domain.add(value)  # type: ignore[arg-type]
                if len(domain.values) > MOST_VALUES:
                    self.of[write.key] = Domain()
                    self.of[write.key].add(domain.values[0])
                    self.open(write.key)
                    changed = True
                    continue
                changed = changed or len(domain.values) > before

    def open(self, key: str) -> None:
        """Anything may be written to a name: it gets a value of each kind."""
        self._open.add(key)
        for value, exact in representatives(self._compared.get(key, ())):
            self.of[key].add(value, exact)

    def _results(self, write: Write) -> list[Value | Unknown]:
        if write.source is None:
            return [UNKNOWN]
        names = list(write.source.names)
        if any(name in write.hidden or name not in self.of for name in names):
            return [UNKNOWN]
        results: list[Value | Unknown] = []
        for values, exact in self.combinations(names):
            if not exact:
                results.append(UNKNOWN)
                continue
            try:
                results.append(write.source.evaluate(values.get))
            except ExpressionError:
                continue
        return results

    def combinations(self, names: Iterable[str]) -> Iterator[tuple[dict[str, Value], bool]]:
        """Every combination of values of some names, and whether all of it is exact."""
        names = list(names)
        ranges = [range(len(self.of[name].values)) for name in names]
        for choice in itertools.islice(itertools.product(*ranges), MOST_COMBINATIONS):
            pairs = list(zip(names, choice, strict=True))
            values = {name: self.of[name].values[number] for name, number in pairs}
            yield values, all(self.of[name].exact[number] for name, number in pairs)
