"""Why an expression fails or is null: its smallest part that does, where that is, what it reads.

Evaluating keeps no positions. What fails is parsed again with them, and evaluated again with a
trace, which finds the part: nothing is kept of expressions that do not fail.
"""

from collections.abc import Callable
from contextvars import copy_context
from dataclasses import dataclass
from typing import Any

from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.expression import feel_values as feel
from m2pem.mission.expression.descent import Descent
from m2pem.mission.expression.dialect import Dialect, Span, locate, split
from m2pem.mission.expression.evaluate import Evaluate, evaluator, tracing
from m2pem.mission.expression.feel import FeelParser
from m2pem.mission.expression.literals import shorten
from m2pem.mission.expression.operators import begin_work
from m2pem.mission.expression.parser import Parser
from m2pem.mission.expression.rules import Rules
from m2pem.mission.expression.temporal import NOW, Computed
from m2pem.mission.expression.tree import Join, Literal, Name, Node, names, walk
from m2pem.mission.values import ReadValue

MAX_VALUES = 5
"""So many of the values that were read are named."""

_READING = ("_expression", "_operators", "_binary", "_prefix", "_value", "_primary")
"""The methods of parsers that read a node and return it."""

Spans = dict[int, tuple[Node, int, int, int]]
"""By the identity of a node: it, its start and end, and the start with parentheses around it."""


@dataclass(slots=True)
class Part:
    """A part that fails or is null: what it reads, why, and its place, or that of what is around
    it."""

    node: Node
    read: ReadValue
    why: str = ""
    span: "Span | None" = None


def why_failed(
    text: str, dialect: Dialect, tree: Node, rules: Rules, read: ReadValue, error: str
) -> str:
    """Say which part of an expression failed: its error, its place, and the values that it reads.

    `error`: that of the whole, for what only the whole does: to be no truth, or to be no data.
    """
    placed, spans = place(text, dialect, tree)
    part, value = trace(placed, rules, read, spans)
    if part is None or value is not None:
        part = Part(placed, read, span=_span(spans, placed))
    why = part.why if part.node is not placed else error
    written = text[part.span] if part.span else text.strip()
    column = (part.span.start if part.span else 0) - text.index(text.lstrip()) + 1
    of = f" of {shorten(text.strip())!r}" if written != text.strip() else ""
    where = f"in {shorten(written)!r} at column {max(column, 1)}{of}"
    return f"{why}, {where}{_values(part, rules)}"


def why_null(tree: Node, rules: Rules, read: ReadValue) -> str:
    """Say which name is not set, so that an expression that does not fail is null; "": none."""
    part, _ = trace(tree, rules, read, {}, nulls=True)
    return f"{part.node.name} is not set" if part and isinstance(part.node, Name) else ""


def trace(
    tree: Node, rules: Rules, read: ReadValue, spans: Spans, *, nulls: bool = False
) -> tuple[Part | None, Computed]:
    """The innermost part that fails, the first that is evaluated, and the value of the whole.

    It is that which raises; else, in FEEL, the first that has no value by a wrong operation; with
    `nulls` the first that is null, and all that is around it. What is looked at counts apart.
    """
    found: Part | None = None
    raised = False

    def traced(node: Node, run: Evaluate) -> Evaluate:
        def call(read: ReadValue) -> Computed:
            nonlocal found, raised
            before, found, noted = found, None, feel.cause()
            try:
                value = run(read)
            except ExpressionError as error:
                if found is None or not raised:
                    found, raised = Part(node, read, str(error)), True
                found.span = found.span or _span(spans, node)
                raise
            fails = value is None if nulls else feel.cause() != noted
            if before or not fails:
                found = before
                return value
            found = found or Part(node, read, f"it has no value: {feel.cause()}")
            found.span = found.span or _span(spans, node)
            return value

        return call

    def evaluate() -> Computed:
        tracing.set(traced)
        begin_work()
        feel.begin()
        try:
            return evaluator(tree, rules)(read)
        except ExpressionError:
            return None

    value = copy_context().run(evaluate)
    return found, value


def _values(part: Part, rules: Rules) -> str:
    """The values that a part reads, in the order in which it names them."""
    read = names(part.node) - {NOW}
    named = [each for each, _ in walk(part.node) if isinstance(each, Name) and each.name in read]
    found = {each.name: evaluator(each, rules)(part.read) for each in named}
    shown = [
        f"{name} is {'not set' if value is None else feel.describe(value)}"
        for name, value in list(found.items())[:MAX_VALUES]
    ]
    return f", where {', '.join(shown)}" if shown else ""


# --- places ---------------------------------------------------------------------------------------


def place(text: str, dialect: Dialect, tree: Node) -> tuple[Node, Spans]:
    """The tree of an expression that has been parsed before, and where its nodes are: nowhere, if
    the text alone does not give the tree (as in a formula that it is a part of)."""
    spans: Spans = {}
    try:
        if dialect is Dialect.TEMPLATE:
            parts = [
                Literal(each) if isinstance(each, str) else _parse(text, each, Dialect.JUEL, spans)
                for each in split(text)
            ]
            placed: Node = Join(tuple(parts))
        else:
            placed = _parse(text, locate(text, dialect.value)[1], dialect, spans)
    except ExpressionSyntaxError:
        return tree, {}
    return (placed, spans) if placed == tree else (tree, {})


def _parse(text: str, span: Span, dialect: Dialect, spans: Spans) -> Node:
    """Parse, and note where nodes are. They are kept: the identity of one that is gone could be
    that of another."""
    parser: Any = parser_of(text, span, dialect)

    def noting(method: Callable[..., Node]) -> Callable[..., Node]:
        def read(*given: Any) -> Node:
            left = spans.get(id(given[0])) if given else None
            start = left[3] if left else parser._position
            node = method(*given)
            stop = start + len(text[start : parser._position].rstrip())
            known = spans.get(id(node), (node, start, stop))
            spans[id(node)] = (*known[:3], start)
            return node

        return read

    for name in _READING:
        if method := getattr(parser, name, None):
            setattr(parser, name, noting(method))
    tree: Node = parser.parse()
    return tree


def parser_of(text: str, span: Span, dialect: Dialect) -> Descent:
    """The parser of an expression, which is in `text` at `span`."""
    return FeelParser(text, span) if dialect is Dialect.FEEL else Parser(text, span, dialect)


def _span(spans: Spans, node: Node) -> "Span | None":
    found = spans.get(id(node))
    return slice(found[1], found[2]) if found else None
