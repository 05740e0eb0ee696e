"""Parses tokens of any dialect but FEEL to the one syntax tree, by precedence climbing.

From weak to strong: `a ? b : c`, `or`, `and`, `not`, comparisons (which do not chain), `+ -`,
`* /`, unary `-`. In JUEL `not` (`!`) and `empty` bind like unary `-`; in it and in XPath
comparisons chain, and `==` binds more weakly than `<`. What people read otherwise is refused.
"""

import re
from collections.abc import Callable

from m2pem.mission.expression.calls import CallError, meaning, method_call
from m2pem.mission.expression.descent import MAX_ITEMS, Descent, Token
from m2pem.mission.expression.dialect import Dialect, Span
from m2pem.mission.expression.lexer import tokenize
from m2pem.mission.expression.literals import read_number, unescape
from m2pem.mission.expression.tree import (
    Arithmetic,
    Call,
    Compare,
    Comparison,
    If,
    In,
    Index,
    ListOf,
    Literal,
    Name,
    Negate,
    Node,
    Not,
    Operation,
)
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
_COMPARISONS = {each.value: each for each in Comparison}
_OPERATIONS = {each.value: each for each in Operation}


class Parser(Descent):
    """Reads one expression, which is in `text` at `span`."""

    _before_name = "; a name has no spaces (in FEEL it may: begin with '=')"

    def __init__(self, text: str, span: Span, dialect: Dialect) -> None:
        self._text = text
        self._coming = iter(tokenize(text, span, dialect))
        self._token = next(self._coming)
        self._dialect = dialect

    def _expression(self, minimum: int = LOWEST) -> Node:
        """The longest expression whose operators bind more strongly than `minimum`."""
        self._nest()
        node = self._prefix(minimum)
        while (strength := self._token.strength) > minimum:
            node = self._binary(node, strength)
        if minimum == LOWEST and self._take("?"):
            then = self._expression(LOWEST)
            self._expect(":", "between the two values after '?'")
            node = If(node, then, self._expression(LOWEST))
        self._nesting -= 1
        return node

    def _binary(self, left: Node, strength: int) -> Node:
        if strength <= AND:
            return self._joined(left, self._expression)
        operator = self._next().text
        negated = operator == "not"
        if negated:
            self._expect("in", "after 'not'")
        right = self._expression(strength)
        if strength in (EQUALITY, COMPARISON):
            if self._dialect not in COERCING or operator in ("in", "not"):
                self._refuse_chain()
            if operator in ("in", "not"):
                member = In(left, right)
                return Not(member) if negated else member
            return Compare(_COMPARISONS[operator], left, right)
        return Arithmetic(_OPERATIONS[operator], left, right)

    def _refuse_chain(self) -> None:
        if self._token.strength == COMPARISON:
            self._fail("comparisons do not chain; write 'a < b and b < c', or use parentheses")

    def _prefix(self, minimum: int) -> Node:
        token = self._next()
        match token.kind:
            case "name":
                return self._inside(self._name(token))
            case "number":
                return self._number(token, "")
            case "constant":
                return Literal(_constant(token.text))
            case "end":
                self._fail("expected a value, found the end", token)
        match token.text:
            case "(":
                node = self._expression(LOWEST)
                self._expect(")", "to close '('", token)
                return self._inside(node)
            case "[":
                return self._inside(ListOf(self._items("]", token)))
            case "-":
                number = self._token
                if number.kind == "number":
                    return self._number(self._next(), "-")
                return Negate(self._expression(UNARY))
            case "not":
                return self._not(token, minimum)
            case "%" if self._token.text == "(" and self._text.startswith("mod", token.position):
                return self._inside(self._name(token._replace(text="mod")))
            case "empty":
                return self._unambiguous(Call("is_empty", (self._expression(UNARY),)), token)
        self._fail(f"expected a value, found {token.text!r}", token)

    def _not(self, token: Token, minimum: int) -> Node:
        if self._dialect is Dialect.BARE:
            if minimum > NOT:
                self._fail("put 'not ...' into parentheses here", token)
            return Not(self._expression(NOT))
        return self._unambiguous(Not(self._expression(UNARY)), token)

    def _unambiguous(self, node: Node, token: Token) -> Node:
        # JUEL reads '!a == b' as '(!a) == b', most people as '!(a == b)'.
        if self._token.strength >= EQUALITY:
            self._fail(
                f"'{token.text}' is ambiguous before '{self._token.text}'; use parentheses", token
            )
        return node

    def _number(self, token: Token, sign: str) -> Node:
        try:
            return Literal(read_number(sign + token.text))
        except ValueError as error:
            self._fail(str(error), token)

    def _name(self, token: Token) -> Node:
        name = token.text
        if opening := self._take("("):
            arguments = self._items(")", opening)
            return self._meant(lambda: meaning(name, arguments, self._dialect), token)
        return Name(name)

    def _meant(self, read: Callable[[], Node], token: Token) -> Node:
        try:
            return read()
        except CallError as error:
            self._fail(str(error), token)

    def _inside(self, node: Node) -> Node:
        """Parse the accesses after a value: `[0]`, `['key']`, `.key`."""
        while self._token.text in ("[", "."):
            opening = self._next()
            if opening.text == "[":
                key = self._expression()
                self._expect("]", "to close '['", opening)
                node = _taken(node, key)
            else:
                node = self._member(node)
        return node

    def _member(self, node: Node) -> Node:
        token = self._next()
        if token.kind != "name":
            self._fail("expected a name after '.'", token)
        *keys, last = token.text.split(".")
        for key in keys:
            node = _taken(node, Literal(key))
        if self._dialect is Dialect.JUEL and (opening := self._take("(")):
            holder, arguments = node, self._items(")", opening)
            return self._meant(lambda: method_call(holder, last, arguments), token)
        return _taken(node, Literal(last))

    def _items(self, closing: str, opening: Token) -> tuple[Node, ...]:
        items: list[Node] = []
        if self._take(closing):
            return ()
        while True:
            if len(items) == MAX_ITEMS:
                self._fail(f"more than {MAX_ITEMS} items")
            items.append(self._expression(LOWEST))
            if not self._take(","):
                self._expect(closing, f"to close '{opening.text}'", opening)
                return tuple(items)

    def _next(self) -> Token:
        token = self._token
        self._token = next(self._coming, token)
        return token


def _constant(written: str) -> bool | str | None:
    return unescape(written[1:-1]) if written[0] in "'\"" else CONSTANTS[written]


def _taken(node: Node, key: Node) -> Node:
    """`a['b']` is `a.b`: a map that was written as a whole is in the store by its keys."""
    match node, key:
        case Name(name), Literal(str(part)) if _IDENTIFIER.fullmatch(part):
            return Name(f"{name}.{part}")
    return Index(node, key)
