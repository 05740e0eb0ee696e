"""What the parsers of all dialects share: their tokens, how they go through them, and limits."""

from collections.abc import Callable
from typing import NamedTuple, NoReturn

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.expression.tree import MAX_DEPTH, And, Node, Or, walk

MAX_ITEMS = 1_000
"""Items of a list as written, and arguments of a call."""

MAX_PARTS = 20_000
"""Nodes of a tree. A value in a range is there twice, so ranges in each other double it."""

_SPELLED = ("operator", "sign", "word")


class Token(NamedTuple):
    """A "number", "name" or the "end".

    In FEEL also a "text", a "sign" or a "word" (a keyword). In other dialects a "constant", or an
    "operator", which may also be a bracket, a comma or one of the words `and or not in`; `text` is
    its name in the bare dialect, and of others what was written. `position` and `stop` are offsets
    in the whole text. `strength`: how strongly it binds as an operator after a value.
    """

    kind: str
    text: str
    position: int
    stop: int
    strength: int


class Descent:
    """Reads one expression by recursive descent, with one token ahead.

    Raises:
        ExpressionSyntaxError: it is none, or is beyond the limits.
    """

    _text: str
    _token: Token
    _nesting = 0
    _before_name = ""
    """A hint where a name follows the whole expression."""

    def parse(self) -> Node:
        """Parse the whole text, and return its tree."""
        start = self._token.position
        if self._token.kind == "end":
            self._fail("an expression is missing")
        node = self._expression()
        if self._token.kind != "end":
            hint = self._before_name if self._token.kind == "name" else ""
            self._fail(f"expected an operator or the end, found {self._found}{hint}")
        # Each level takes a character at least, and what doubles the parts takes ten.
        if self._token.position - start > MAX_DEPTH:
            self._limit(node)
        return node

    def _limit(self, node: Node) -> None:
        for parts, (_, depth) in enumerate(walk(node)):
            if depth > MAX_DEPTH:
                self._fail(
                    f"nested deeper than {MAX_DEPTH} levels; use parentheses or fewer operators"
                )
            if parts > MAX_PARTS:
                self._fail("too large, written out; use fewer ranges in each other")

    def _expression(self) -> Node:
        raise NotImplementedError

    def _next(self) -> Token:
        raise NotImplementedError

    def _nest(self) -> None:
        self._nesting += 1
        if self._nesting > MAX_DEPTH:
            self._fail(f"nested deeper than {MAX_DEPTH} levels")

    def _joined(self, first: Node, read: Callable[[int], Node]) -> Node:
        """`a and b and ...`, or the same with `or`; `read`: by how strongly that binds."""
        _, word, _, _, strength = self._token
        operands = [first]
        while self._take(word):
            operands.append(read(strength))
        return Or(tuple(operands)) if word == "or" else And(tuple(operands))

    @property
    def _found(self) -> str:
        return self._token.text if self._token.kind == "end" else repr(self._token.text)

    def _take(self, *texts: str) -> Token | None:
        token = self._token
        return self._next() if token.text in texts and token.kind in _SPELLED else None

    def _expect(self, text: str, why: str, opening: Token | None = None) -> Token:
        if token := self._take(text):
            return token
        at = f" at column {opening.position + 1}" if opening else ""
        self._fail(f"expected '{text}' {why}{at}, found {self._found}")

    def _fail(self, message: str, at: Token | int | None = None) -> NoReturn:
        position = at if isinstance(at, int) else (at or self._token).position
        raise ExpressionSyntaxError(message, self._text, position)
