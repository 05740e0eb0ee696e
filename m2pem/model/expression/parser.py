"""Parses tokens of any dialect to the one syntax tree, by precedence climbing.

From weak to strong: `or`, `and`, `not`, comparisons (which do not chain), `+ -`, `* /`, unary `-`.
In the `${...}` dialect `not` (`!`) and `empty` bind like unary `-`, as in JUEL; in FEEL `not(...)`
looks like a call. Where that would change what a bare expression means, it is refused.
"""

import difflib
from typing import NoReturn

from m2pem.errors import ExpressionSyntaxError
from m2pem.model.expression.dialect import Dialect, Span
from m2pem.model.expression.functions import FEEL_NAMES, FUNCTIONS
from m2pem.model.expression.lexer import Kind, Token, tokenize
from m2pem.model.expression.literals import read_number
from m2pem.model.expression.tree import (
    MAX_DEPTH,
    And,
    Arithmetic,
    Call,
    Compare,
    Comparison,
    In,
    ListOf,
    Literal,
    Name,
    Negate,
    Node,
    Not,
    Operation,
    Or,
    walk,
)

MAX_ITEMS = 1_000
"""Items of a list as written, and arguments of a call."""

_LOWEST, _OR, _AND, _NOT, _COMPARISON, _SUM, _PRODUCT, _UNARY = range(8)
_BINARY = {
    "or": _OR,
    "and": _AND,
    "in": _COMPARISON,
    "not": _COMPARISON,
    "+": _SUM,
    "-": _SUM,
    "*": _PRODUCT,
    "/": _PRODUCT,
    **{comparison.value: _COMPARISON for comparison in Comparison},
}
"""How strongly an operator after a value binds; `not` there begins `not in`."""


def parse_span(text: str, span: Span, dialect: Dialect) -> Node:
    """The tree of the expression that stands in `text` at `span`.

    Raises:
        ExpressionSyntaxError: it is none, or is beyond the limits.
    """
    return _Parser(text, tokenize(text, span, dialect), dialect).parse()


class _Parser:
    def __init__(self, text: str, tokens: list[Token], dialect: Dialect) -> None:
        self._text = text
        self._tokens = tokens
        self._dialect = dialect
        self._index = 0
        self._nesting = 0

    def parse(self) -> Node:
        if self._ended:
            self._fail("an expression is missing")
        node = self._expression(_LOWEST)
        if not self._ended:
            self._fail(f"expected an operator or the end, found {self._found}")
        if any(depth > MAX_DEPTH for _, depth in walk(node)):
            self._fail(f"nested deeper than {MAX_DEPTH} levels; use parentheses or fewer operators")
        return node

    @property
    def _token(self) -> Token:
        return self._tokens[self._index]

    @property
    def _ended(self) -> bool:
        return self._token.kind is Kind.END

    @property
    def _found(self) -> str:
        token = self._token
        return token.text if token.kind is Kind.END else repr(token.text)

    def _expression(self, minimum: int) -> Node:
        """The longest expression whose operators bind more strongly than `minimum`."""
        self._nesting += 1
        if self._nesting > MAX_DEPTH:
            self._fail(f"nested deeper than {MAX_DEPTH} levels")
        node = self._prefix(minimum)
        while (strength := self._strength()) > minimum:
            node = self._binary(node, strength)
        self._nesting -= 1
        return node

    def _strength(self) -> int:
        token = self._token
        return _BINARY.get(token.text, _LOWEST) if token.kind is Kind.OPERATOR else _LOWEST

    def _binary(self, left: Node, strength: int) -> Node:
        if strength in (_OR, _AND):
            word = self._token.text
            operands = [left]
            while self._take(word):
                operands.append(self._expression(strength))
            return Or(tuple(operands)) if word == "or" else And(tuple(operands))
        operator = self._next().text
        negated = operator == "not"
        if negated:
            self._expect("in", "after 'not'")
        right = self._expression(strength)
        if strength == _COMPARISON:
            if self._strength() == _COMPARISON:
                self._fail("comparisons do not chain; write 'a < b and b < c', or use parentheses")
            if operator in ("in", "not"):
                member = In(left, right)
                return Not(member) if negated else member
            return Compare(Comparison(operator), left, right)
        return Arithmetic(Operation(operator), left, right)

    def _prefix(self, minimum: int) -> Node:
        token = self._next()
        match token.kind:
            case Kind.NUMBER:
                return self._number(token, "")
            case Kind.CONSTANT:
                return Literal(token.value)
            case Kind.NAME:
                return self._name(token)
            case Kind.END:
                self._fail("expected a value, found the end", token)
        match token.text:
            case "(":
                node = self._expression(_LOWEST)
                self._expect(")", "to close '('", token)
                return node
            case "[":
                return ListOf(self._items("]", token))
            case "-":
                number = self._token
                if number.kind is Kind.NUMBER:
                    return self._number(self._next(), "-")
                return Negate(self._expression(_UNARY))
            case "not":
                return self._not(token, minimum)
            case "empty":
                node = Call("is_empty", (self._expression(_UNARY),))
                return self._unambiguous(node, token)
        self._fail(f"expected a value, found {token.text!r}", token)

    def _not(self, token: Token, minimum: int) -> Node:
        if self._dialect is Dialect.BARE:
            if minimum > _NOT:
                self._fail("put 'not ...' into parentheses here", token)
            return Not(self._expression(_NOT))
        if self._dialect is Dialect.JUEL:
            return self._unambiguous(Not(self._expression(_UNARY)), token)
        opening = self._expect("(", "after FEEL's 'not'")
        node = self._expression(_LOWEST)
        self._expect(")", "to close 'not('", opening)
        return Not(node)

    def _unambiguous(self, node: Node, token: Token) -> Node:
        # JUEL reads '!a == b' as '(!a) == b', most people as '!(a == b)'.
        if self._strength() >= _COMPARISON:
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
        if self._dialect is Dialect.FEEL:
            # FEEL's names may hold spaces: two names in a row can only be one.
            while self._token.kind is Kind.NAME:
                name += " " + self._next().text
        if opening := self._take("("):
            return self._call(name, token, opening)
        return Name(name)

    def _call(self, name: str, token: Token, opening: Token) -> Node:
        key = FEEL_NAMES.get(name, name) if self._dialect is Dialect.FEEL else name
        function = FUNCTIONS.get(key)
        if function is None:
            near = difflib.get_close_matches(name, FUNCTIONS, n=1)
            hint = f"did you mean {near[0]}?" if near else "there are " + ", ".join(FUNCTIONS)
            self._fail(f"there is no function {name[:40]!r}; {hint}", token)
        arguments = self._items(")", opening)
        if not function.accepts(len(arguments)):
            self._fail(f"expected {function.signature}, found {len(arguments)} arguments", token)
        return Call(function.name, arguments)

    def _items(self, closing: str, opening: Token) -> tuple[Node, ...]:
        items: list[Node] = []
        if self._take(closing):
            return ()
        while True:
            if len(items) == MAX_ITEMS:
                self._fail(f"more than {MAX_ITEMS} items")
            items.append(self._expression(_LOWEST))
            if not self._take(","):
                self._expect(closing, f"to close '{opening.text}'", opening)
                return tuple(items)

    def _next(self) -> Token:
        token = self._token
        if token.kind is not Kind.END:
            self._index += 1
        return token

    def _take(self, operator: str) -> Token | None:
        token = self._token
        if token.kind is Kind.OPERATOR and token.text == operator:
            self._index += 1
            return token
        return None

    def _expect(self, operator: str, why: str, opening: Token | None = None) -> Token:
        if token := self._take(operator):
            return token
        at = f" at column {opening.position + 1}" if opening else ""
        self._fail(f"expected '{operator}' {why}{at}, found {self._found}")

    def _fail(self, message: str, token: Token | None = None) -> NoReturn:
        raise ExpressionSyntaxError(message, self._text, (token or self._token).position)
