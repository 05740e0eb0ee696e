"""Parses tokens of any dialect but FEEL to the one syntax tree, by precedence climbing.

From weak to strong: `a ? b : c`, `or`, `and`, `not`, comparisons (which do not chain), `+ -`,
`* /`, unary `-`. In JUEL `not` (`!`) and `empty` bind like unary `-`; in it and in XPath
comparisons chain, and `==` binds more weakly than `<`. What people read otherwise is refused.
"""

import re
from collections.abc import Callable

from m2pem.mission.expression import tree as t
from m2pem.mission.expression.calls import CallError, meaning, method_call
from m2pem.mission.expression.descent import MAX_ITEMS, Descent
from m2pem.mission.expression.dialect import Dialect, Span
from m2pem.mission.expression.lexer import tokenize
from m2pem.mission.expression.literals import read_number, unescape
from m2pem.mission.expression.vocabulary import (
    AND,
    COERCING,
    COMPARISON,
    CONSTANTS,
    EQUALITY,
    LOWEST,
    NOT,
    UNARY,
)

_IDENTIFIER = re.compile(r"[^\W\d]\w*")
_COMPARISONS = {each.value: each for each in t.Comparison}
_OPERATIONS = {each.value: each for each in t.Operation}


class Parser(Descent):
    """Reads one expression, which is in `text` at `span`."""

    _before_name = "; a name has no spaces (in FEEL it may: begin with '=')"

    def __init__(self, text: str, span: Span, dialect: Dialect) -> None:
        self._text = text
        self._tokens = tokenize(text, span, dialect)
        self._dialect = dialect
        self._next()

    def _next(self) -> str:
        read = self._token
        self._first += 1
        self._kind, self._token, _, self._strength = self._tokens[self._first]
        return read

    def _place(self, token: int) -> int:
        return self._tokens[token][2]

    def _expression(self, minimum: int = LOWEST) -> t.Node:
        """The longest expression whose operators bind more strongly than `minimum`."""
        self._nest()
        node = self._prefix(minimum)
        while (strength := self._strength) > minimum:
            node = self._binary(node, strength)
        if minimum == LOWEST and self._take("?"):
            then = self._expression(LOWEST)
            self._expect(":", "between the two values after '?'")
            node = t.If(node, then, self._expression(LOWEST))
        self._nesting -= 1
        return node

    def _binary(self, left: t.Node, strength: int) -> t.Node:
        if strength <= AND:
            return self._joined(left, strength, self._expression)
        operator = self._next()
        negated = operator == "not"
        if negated:
            self._expect("in", "after 'not'")
        right = self._expression(strength)
        if strength in (EQUALITY, COMPARISON):
            if self._dialect not in COERCING or operator in ("in", "not"):
                self._refuse_chain()
            if operator in ("in", "not"):
                member = t.In(left, right)
                return t.Not(member) if negated else member
            return t.Compare(_COMPARISONS[operator], left, right)
        return t.Arithmetic(_OPERATIONS[operator], left, right)

    def _refuse_chain(self) -> None:
        if self._strength == COMPARISON:
            self._fail("comparisons do not chain; write 'a < b and b < c', or use parentheses")

    def _prefix(self, minimum: int) -> t.Node:
        kind, first = self._kind, self._first
        if kind == "end":
            self._fail("expected a value, found the end")
        text = self._next()
        match kind:
            case "name":
                return self._inside(self._name(text, first))
            case "number":
                return self._number(text, first)
            case "constant":
                return t.Literal(_constant(text))
            case "(":
                node = self._expression(LOWEST)
                self._expect(")", "to close '('", first)
                return self._inside(node)
            case "[":
                return self._inside(t.ListOf(self._items("]", first)))
            case "-":
                if self._kind == "number":
                    return self._number("-" + self._next(), first + 1)
                return t.Negate(self._expression(UNARY))
            case "not":
                return self._not(first, minimum)
            case "%" if self._kind == "(" and self._text.startswith("mod", self._place(first)):
                return self._inside(self._name("mod", first))
            case "empty":
                return self._unambiguous(t.Call("is_empty", (self._expression(UNARY),)), first)
        self._fail(f"expected a value, found {text!r}", first)

    def _not(self, first: int, minimum: int) -> t.Node:
        if self._dialect is Dialect.BARE:
            if minimum > NOT:
                self._fail("put 'not ...' into parentheses here", first)
            return t.Not(self._expression(NOT))
        return self._unambiguous(t.Not(self._expression(UNARY)), first)

    def _unambiguous(self, node: t.Node, first: int) -> t.Node:
        # JUEL reads '!a == b' as '(!a) == b', most people as '!(a == b)'.
        if self._strength >= EQUALITY:
            operator = self._tokens[first][1]
            self._fail(f"'{operator}' is ambiguous before '{self._token}'; use parentheses", first)
        return node

    def _number(self, written: str, first: int) -> t.Node:
        try:
            return t.Literal(read_number(written))
        except ValueError as error:
            self._fail(str(error), first)

    def _name(self, name: str, first: int) -> t.Node:
        if self._kind != "(":
            return t.Name(name)
        arguments = self._arguments()
        return self._meant(lambda: meaning(name, arguments, self._dialect), first)

    def _meant(self, read: Callable[[], t.Node], first: int) -> t.Node:
        try:
            return read()
        except CallError as error:
            self._fail(str(error), first)

    def _inside(self, node: t.Node) -> t.Node:
        """Parse the accesses after a value: `[0]`, `['key']`, `.key`."""
        while True:
            opening = self._first
            if self._take("["):
                key = self._expression()
                self._expect("]", "to close '['", opening)
                node = _taken(node, key)
            elif self._take("."):
                node = self._member(node)
            else:
                return node

    def _member(self, node: t.Node) -> t.Node:
        first = self._first
        if self._kind != "name":
            self._fail("expected a name after '.'")
        *keys, last = self._next().split(".")
        for key in keys:
            node = _taken(node, t.Literal(key))
        if self._dialect is Dialect.JUEL and self._kind == "(":
            holder, arguments = node, self._arguments()
            return self._meant(lambda: method_call(holder, last, arguments), first)
        return _taken(node, t.Literal(last))

    def _arguments(self) -> tuple[t.Node, ...]:
        opening = self._first
        self._next()
        return self._items(")", opening)

    def _items(self, closing: str, opening: int) -> tuple[t.Node, ...]:
        items: list[t.Node] = []
        if self._take(closing):
            return ()
        while True:
            if len(items) == MAX_ITEMS:
                self._fail(f"more than {MAX_ITEMS} items")
            items.append(self._expression(LOWEST))
            if not self._take(","):
                why = f"to close '{self._tokens[opening][1]}'"
                self._expect(closing, why, opening)
                return tuple(items)


def _constant(written: str) -> bool | str | None:
    return unescape(written[1:-1]) if written[0] in "'\"" else CONSTANTS[written]


def _taken(node: t.Node, key: t.Node) -> t.Node:
    """`a['b']` is `a.b`: a map that was written as a whole is in the store by its keys."""
    match node, key:
        case t.Name(name), t.Literal(str(part)) if _IDENTIFIER.fullmatch(part):
            return t.Name(f"{name}.{part}")
    return t.Index(node, key)
