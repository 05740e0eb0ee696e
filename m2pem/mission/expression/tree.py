"""The syntax tree: what all dialects parse to, and what a verifier translates.

Nodes are immutable. A tree is never deeper than `MAX_DEPTH`, so walking it by recursion is safe.
Equality takes `Literal(1)`, `Literal(1.0)` and `Literal(True)` for the same, as Python
does; compare `repr` where the type matters.
"""

from collections.abc import Iterator, Sequence
from enum import StrEnum
from typing import TypeAlias

from msgspec import Struct

MAX_DEPTH = 100


class Comparison(StrEnum):
    """`==` and `!=` compare any two values; the others order two numbers or two texts."""

    EQUAL = "=="
    NOT_EQUAL = "!="
    LESS = "<"
    LESS_EQUAL = "<="
    GREATER = ">"
    GREATER_EQUAL = ">="

    __hash__ = str.__hash__  # an enum's own is slow, and each evaluation asks for it


class Operation(StrEnum):
    """Arithmetic. `+` also joins two texts; `%` is of JUEL and XPath, `**` of FEEL."""

    ADD = "+"
    SUBTRACT = "-"
    MULTIPLY = "*"
    DIVIDE = "/"
    MODULO = "%"
    POWER = "**"

    __hash__ = str.__hash__


class Node(Struct, frozen=True, gc=False):
    """What an expression is made of."""


class Literal(Node, frozen=True, gc=False):
    """A value as written."""

    value: bool | int | float | str | None


class Name(Node, frozen=True, gc=False):
    """The value under a dotted name of the data store; null when it is not there."""

    name: str


class ListOf(Node, frozen=True, gc=False):
    """`[a, b]`."""

    items: tuple[Node, ...]


class Not(Node, frozen=True, gc=False):
    """`not a`; null counts as false."""

    operand: Node


class And(Node, frozen=True, gc=False):
    """`a and b and ...`, from left to right until one is false."""

    operands: tuple[Node, ...]


class Or(Node, frozen=True, gc=False):
    """`a or b or ...`, from left to right until one is true."""

    operands: tuple[Node, ...]


class Compare(Node, frozen=True, gc=False):
    """`left operator right`, always true or false."""

    operator: Comparison
    left: Node
    right: Node


class In(Node, frozen=True, gc=False):
    """`item in container`: whether a list has an item that is equal."""

    item: Node
    container: Node


class Negate(Node, frozen=True, gc=False):
    """`-a`."""

    operand: Node


class Arithmetic(Node, frozen=True, gc=False):
    """`left operator right`; null when either is null."""

    operator: Operation
    left: Node
    right: Node


class Call(Node, frozen=True, gc=False):
    """A listed function; `function` is its name in `functions.LISTED`, whatever the dialect."""

    function: str
    arguments: tuple[Node, ...]


class If(Node, frozen=True, gc=False):
    """`then` where `condition` is true, else `otherwise`; null counts as false."""

    condition: Node
    then: Node
    otherwise: Node


class Index(Node, frozen=True, gc=False):
    """`container[key]`: an item of a list, counted from 0 (from -1 backwards), or of a map."""

    container: Node
    key: Node


class Some(Node, frozen=True, gc=False):
    """Whether the condition is true with `variable` as one of the items; never, of null."""

    variable: str
    collection: Node
    condition: Node


class Every(Node, frozen=True, gc=False):
    """As `Some`: whether the condition is true with each item. FEEL's."""

    variable: str
    collection: Node
    condition: Node


class For(Node, frozen=True, gc=False):
    """The list of `result` for each combination of items; `partial` is what there is so far."""

    iterators: tuple[tuple[str, Node], ...]
    result: Node


class Filter(Node, frozen=True, gc=False):
    """`container[condition]` of FEEL: the item of a number, or the items for which it is true."""

    container: Node
    condition: Node


class Path(Node, frozen=True, gc=False):
    """`container.key` of FEEL: an entry, of lists that of each item, or a property."""

    container: Node
    key: str


class ContextOf(Node, frozen=True, gc=False):
    """`{key: value}`; a value may read the entries before it."""

    entries: tuple[tuple[str, Node], ...]


class RangeOf(Node, frozen=True, gc=False):
    """`[low..high]`; None: without that end. `negated`: all but `low`. `descends`: of an iteration,
    which may go from a higher value to a lower one."""

    low: Node | None
    high: Node | None
    low_included: bool
    high_included: bool
    negated: bool = False
    descends: bool = False


class Lambda(Node, frozen=True, gc=False):
    """`function(a, b) body`."""

    parameters: tuple[str, ...]
    body: Node


class Invoke(Node, frozen=True, gc=False):
    """A call of a function that an expression defines. `names`: of its arguments, or none."""

    function: Node
    arguments: tuple[Node, ...]
    names: tuple[str, ...] = ()


TypeName: TypeAlias = tuple[str, tuple[tuple[str, "TypeName"], ...]]
"""A type of FEEL: its name, and the types of its parts by their names ("" where they have none)."""


class InstanceOf(Node, frozen=True, gc=False):
    """`value instance of type`."""

    value: Node
    type: TypeName


class Join(Node, frozen=True, gc=False):
    """A text with `${...}` parts; each part's value is written into it."""

    parts: tuple[Node, ...]


_BELOW = {
    each: tuple(name for name, of in each.__annotations__.items() if "Node" in str(of))
    for each in Node.__subclasses__()
}
"""The fields of each node that hold nodes: one, several, or several with names."""


def children(node: Node) -> tuple[Node, ...]:
    """The nodes directly below, in the order they are evaluated: that of the fields."""
    found: list[Node] = []
    for name in _BELOW[type(node)]:
        below = getattr(node, name)
        if isinstance(below, tuple):
            found += [each[1] if isinstance(each, tuple) else each for each in below]
        elif below is not None:
            found.append(below)
    return tuple(found)


def walk(node: Node) -> Iterator[tuple[Node, int]]:
    """Every node of the tree with its depth, the root's being 1; parents come first."""
    waiting = [(node, 1)]
    while waiting:
        current, depth = waiting.pop()
        yield current, depth
        below = children(current)
        if below:
            waiting += [(child, depth + 1) for child in reversed(below)]


_NO_NAMES: frozenset[str] = frozenset()


def names(node: Node) -> frozenset[str]:
    """The dotted names that the tree reads from the store."""
    if isinstance(node, Literal):
        return _NO_NAMES
    found: set[str] = set()
    waiting: list[Node] = [node]
    while waiting:
        current = waiting.pop()
        match current:
            case Name(name):
                found.add(name)
            case Literal():
                pass
            case Some() | Every():
                waiting.append(current.collection)
                found |= _names_but(current.condition, (current.variable,))
            case For():
                bound: list[str] = []
                for variable, collection in current.iterators:
                    found |= _names_but(collection, bound)
                    bound.append(variable)
                found |= _names_but(current.result, (*bound, "partial"))
            case Filter():
                waiting.append(current.container)
                found |= _names_but(current.condition, ("item",))
            case ContextOf():
                bound = []
                for key, value in current.entries:
                    found |= _names_but(value, bound)
                    bound.append(key)
            case Lambda():
                found |= _names_but(current.body, current.parameters)
            case _:
                waiting += children(current)
    return frozenset(found)


def _names_but(node: Node, bound: Sequence[str]) -> set[str]:
    return {name for name in names(node) if not any(binds(each, name) for each in bound)}


def binds(variable: str, name: str) -> bool:
    """Whether a name is that of the variable, or of something in it."""
    return name == variable or name.startswith(variable + ".")
