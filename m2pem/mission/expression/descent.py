"""What the parsers of all dialects share: how they go through their tokens, and limits."""

from collections.abc import Callable
from typing import NoReturn

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.expression.tree import MAX_DEPTH, And, Node, Or, walk

MAX_ITEMS = 1_000
"""Items of a list as written, and arguments of a call."""

MAX_PARTS = 20_000
"""Nodes of a tree. A value in a range is there twice, so ranges in each other double it."""


class Descent:
    """Reads one expression by recursive descent, with one token ahead.

    Raises:
        ExpressionSyntaxError: it is none, or is beyond the limits.
    """

    _text: str
    _kind: str
    """The token ahead: a sign or keyword itself, or a "number", "name", "constant", "text" or the
    "end"."""

    _token = ""
    """The text of the token ahead."""

    _first = -1
    """Which token is ahead; the first one of a name of several words."""

    _nesting = 0
    _before_name = ""
    """A hint where a name follows the whole expression."""

    def parse(self) -> Node:
        """Parse the whole text, and return its tree."""
        if self._kind == "end":
            self._fail("an expression is missing")
        node = self._expression()
        if self._kind != "end":
            hint = self._before_name if self._kind == "name" else ""
            self._fail(f"expected an operator or the end, found {self._found}{hint}")
        # Each level takes a character at least, and what doubles the parts takes ten.
        if len(self._text) > MAX_DEPTH:
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

    def _next(self) -> str:
        """Read the token ahead, and return its text."""
        raise NotImplementedError

    def _place(self, token: int) -> int:
        """Return where in the whole text a token begins."""
        raise NotImplementedError

    @property
    def _position(self) -> int:
        return self._place(self._first)

    def _nest(self) -> None:
        self._nesting += 1
        if self._nesting > MAX_DEPTH:
            self._fail(f"nested deeper than {MAX_DEPTH} levels")

    def _joined(self, first: Node, strength: int, read: Callable[[int], Node]) -> Node:
        """`a and b and ...`, or the same with `or`; `read`: by how strongly that binds."""
        word, operands = self._kind, [first]
        while self._take(word):
            operands.append(read(strength))
        return Or(tuple(operands)) if word == "or" else And(tuple(operands))

    @property
    def _found(self) -> str:
        return "the end" if self._kind == "end" else repr(self._token)

    def _take(self, sign: str) -> bool:
        if self._kind != sign:
            return False
        self._next()
        return True

    def _expect(self, sign: str, why: str, opening: int | None = None) -> None:
        if self._kind != sign:
            at = "" if opening is None else f" at column {self._place(opening) + 1}"
            self._fail(f"expected '{sign}' {why}{at}, found {self._found}")
        self._next()

    def _fail(self, message: str, token: int | None = None) -> NoReturn:
        self._refuse(message, self._place(self._first if token is None else token))

    def _refuse(self, message: str, position: int) -> NoReturn:
        raise ExpressionSyntaxError(message, self._text, position)
