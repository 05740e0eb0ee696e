"""The syntax tree: what all dialects parse to, and what a verifier translates.

Nodes are immutable. A tree is never deeper than `MAX_DEPTH`, so walking it by recursion is safe.
Dataclass equality takes `Literal(1)`, `Literal(1.0)` and `Literal(True)` for the same, as Python
does; compare `repr` where the type matters.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias, Union

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
    """Arithmetic. `+` also joins two texts; `%` is of JUEL and XPath, with the dividend's sign."""

    ADD = "+"
    SUBTRACT = "-"
    MULTIPLY = "*"
    DIVIDE = "/"
    MODULO = "%"

    __hash__ = str.__hash__


@dataclass(frozen=True, slots=True)
class Literal:
    """A value as written."""

    value: bool | int | float | str | None


@dataclass(frozen=True, slots=True)
class Name:
    """The value under a dotted name of the data store; null when it is not there."""

    name: str


@dataclass(frozen=True, slots=True)
class ListOf:
    """`[a, b]`."""

    items: "tuple[Node, ...]"


@dataclass(frozen=True, slots=True)
class Not:
    """`not a`; null counts as false."""

    operand: "Node"


@dataclass(frozen=True, slots=True)
class And:
    """`a and b and ...`, from left to right until one is false."""

    operands: "tuple[Node, ...]"


@dataclass(frozen=True, slots=True)
class Or:
    """`a or b or ...`, from left to right until one is true."""

    operands: "tuple[Node, ...]"


@dataclass(frozen=True, slots=True)
class Compare:
    """`left operator right`, always true or false."""

    operator: Comparison
    left: "Node"
    right: "Node"


@dataclass(frozen=True, slots=True)
class In:
    """`item in container`: whether a list has an item that is equal."""

    item: "Node"
    container: "Node"


@dataclass(frozen=True, slots=True)
class Negate:
    """`-a`."""

    operand: "Node"


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """`left operator right`; null when either is null."""

    operator: Operation
    left: "Node"
    right: "Node"


@dataclass(frozen=True, slots=True)
class Call:
    """A listed function; `function` is its name in `functions.LISTED`, whatever the dialect."""

    function: str
    arguments: "tuple[Node, ...]"


@dataclass(frozen=True, slots=True)
class If:
    """`then` where `condition` is true, else `otherwise`; null counts as false."""

    condition: "Node"
    then: "Node"
    otherwise: "Node"


@dataclass(frozen=True, slots=True)
class Index:
    """`container[key]`: an item of a list, counted from 0 (from -1 backwards), or of a map."""

    container: "Node"
    key: "Node"


@dataclass(frozen=True, slots=True)
class Some:
    """Whether the condition is true with `variable` as one of the items; never, of null."""

    variable: str
    collection: "Node"
    condition: "Node"


@dataclass(frozen=True, slots=True)
class Join:
    """A text with `${...}` parts; each part's value is written into it."""

    parts: "tuple[Node, ...]"


Node: TypeAlias = Union[
    Literal,
    Name,
    ListOf,
    Not,
    And,
    Or,
    Compare,
    In,
    Negate,
    Arithmetic,
    Call,
    If,
    Index,
    Some,
    Join,
]


def children(node: Node) -> tuple[Node, ...]:
    """The nodes directly below, in the order they are evaluated."""
    match node:
        case Compare() | Arithmetic():
            return (node.left, node.right)
        case Literal() | Name():
            return ()
        case Call():
            return node.arguments
        case And() | Or():
            return node.operands
        case Not() | Negate():
            return (node.operand,)
        case In():
            return (node.item, node.container)
        case Index():
            return (node.container, node.key)
        case ListOf():
            return node.items
        case If():
            return (node.condition, node.then, node.otherwise)
        case Some():
            return (node.collection, node.condition)
        case Join():
            return node.parts


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
        if isinstance(current, Name):
            found.add(current.name)
        elif isinstance(current, Some):
            waiting.append(current.collection)
            inside = names(current.condition)
            found.update(name for name in inside if not binds(current.variable, name))
        elif not isinstance(current, Literal):
            waiting += children(current)
    return frozenset(found)


def binds(variable: str, name: str) -> bool:
    """Whether a name is that of the variable, or of something in it."""
    return name == variable or name.startswith(variable + ".")
