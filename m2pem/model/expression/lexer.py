"""Splits an expression into tokens. The operators of all dialects get one name each here."""

import re
from enum import Enum, auto
from typing import NamedTuple, NoReturn

from m2pem.errors import ExpressionSyntaxError
from m2pem.model.expression.dialect import Dialect, Span
from m2pem.model.expression.literals import NUMBER, unescape


class Kind(Enum):
    """What a token is. OPERATOR also stands for brackets, commas and the words `and or not in`."""

    NUMBER = auto()
    CONSTANT = auto()
    NAME = auto()
    OPERATOR = auto()
    END = auto()


class Token(NamedTuple):
    """`text` is the operator's name in the bare dialect, a name, or what was written.

    `value` is that of a CONSTANT; the parser reads a NUMBER, whose sign counts. `position` is the
    offset in the whole text.
    """

    kind: Kind
    text: str
    position: int
    value: bool | str | None = None


_CONSTANTS = {"true": True, "false": False, "null": None}
_SYMBOLS = {
    s: s for s in ("!=", "<=", ">=", "<", ">", "+", "-", "*", "/", "(", ")", "[", "]", ",", ".")
}
_TERNARY = {"?": "?", ":": ":"}
_WORDS = {"and": "and", "or": "or", "not": "not", "in": "in"}

SYMBOLS = {
    Dialect.BARE: {**_SYMBOLS, **_TERNARY, "==": "=="},
    Dialect.JUEL: {**_SYMBOLS, **_TERNARY, "==": "==", "&&": "and", "||": "or", "!": "not"},
    Dialect.FEEL: {**_SYMBOLS, "=": "==", "..": ".."},
    Dialect.XPATH: {s: s for s in _SYMBOLS if s not in "/[]."} | {"=": "=="},
}
WORDS = {
    Dialect.BARE: _WORDS,
    Dialect.JUEL: {
        **_WORDS,
        "eq": "==",
        "ne": "!=",
        "lt": "<",
        "le": "<=",
        "gt": ">",
        "ge": ">=",
        "div": "/",
        "empty": "empty",
    },
    Dialect.FEEL: {
        **_WORDS,
        **{word: word for word in ("between", "else", "every", "if", "satisfies", "some", "then")},
    },
    Dialect.XPATH: {"and": "and", "or": "or", "div": "/"},
}
_ASCII_NAME = re.compile(r"[A-Za-z_]\w*(?:\.\w+)*", re.ASCII)
_FEEL_UNSUPPORTED = frozenset({"for", "function", "instance"})
_HINTS = {
    "=": "'=' compares nothing here; write '==' (or a leading '=' for FEEL)",
    "&": "write 'and'",
    "|": "write 'or'",
    "!": "write 'not'",
    "%": "write mod(x, y) for the remainder",
    "^": "there is no power operator",
    "?": "write 'if a then b else c'",
    "/": "paths into XML are not read; a division is written 'div'",
    "@": "paths into XML are not read",
    "{": "maps cannot be written",
    "$": "put the whole expression into one '${...}', or write it without '${' and '}'",
    "#": "put the whole expression into one '${...}', or write it without '#{' and '}'",
    "\N{LEFT DOUBLE QUOTATION MARK}": "write straight quotes",
    "\N{RIGHT DOUBLE QUOTATION MARK}": "write straight quotes",
    "\N{LEFT SINGLE QUOTATION MARK}": "write straight quotes",
    "\N{RIGHT SINGLE QUOTATION MARK}": "write straight quotes",
}


_CALLED = {
    Dialect.FEEL: re.compile(r"date and time(?=\s*\()"),
    Dialect.JUEL: re.compile(r"(?:var|vars|variables):\w+(?=\s*\()"),
    Dialect.XPATH: re.compile(r"(?:[^\W\d][\w.-]*+:)?+[^\W\d][\w-]*+(?=\s*+\()"),
}
"""Names of functions that are no names of the store."""


def is_reserved(name: str, dialect: Dialect) -> bool:
    """Whether a name can never be read because the dialect gives it a meaning."""
    return name in _CONSTANTS or name in WORDS[dialect]


def scan_name(text: str, position: int, end: int) -> int:
    """The end of the dotted name that starts at `position`; `position` when none does.

    Parts are letters, digits and `_` of any script; the first part begins with no digit.
    """
    if text.isascii():
        name = _ASCII_NAME.match(text, position, end)
        return name.end() if name else position
    if position >= end or not text[position].isidentifier():
        return position
    while True:
        while position < end and _continues_name(text[position]):
            position += 1
        if position + 1 < end and text[position] == "." and _continues_name(text[position + 1]):
            position += 1
        else:
            return position


def _continues_name(character: str) -> bool:
    return ("_" + character).isidentifier()


def tokenize(text: str, span: Span, dialect: Dialect) -> list[Token]:
    """The tokens of `text` within `span`, closed by one END.

    Raises:
        ExpressionSyntaxError: something that is no token.
    """
    return _Lexer(text, span, dialect).tokens()


class _Lexer:
    def __init__(self, text: str, span: Span, dialect: Dialect) -> None:
        self._text = text
        self._position = span.start
        self._end = span.end
        self._dialect = dialect
        self._symbols = SYMBOLS[dialect]
        self._words = WORDS[dialect]
        self._called = _CALLED.get(dialect)

    def tokens(self) -> list[Token]:
        tokens: list[Token] = []
        while True:
            while self._position < self._end and self._text[self._position].isspace():
                self._position += 1
            if self._position >= self._end:
                return [*tokens, Token(Kind.END, "the end", self._position)]
            tokens.append(self._token())

    def _token(self) -> Token:
        start = self._position
        character = self._text[start]
        name = self._called.match(self._text, start, self._end) if self._called else None
        if name and name[0] not in self._words:
            self._position = name.end()
            return Token(Kind.NAME, name[0], start)
        name_end = scan_name(self._text, start, self._end)
        if name_end > start:
            return self._word(name_end)
        if number := NUMBER.match(self._text, start, self._end):
            return self._number(number.end())
        if character in "'\"":
            return self._quoted(character)
        for symbol in (self._text[start : min(start + 2, self._end)], character):
            if symbol in self._symbols:
                self._position += len(symbol)
                return Token(Kind.OPERATOR, self._symbols[symbol], start)
        hint = _HINTS.get(character)
        self._fail(f"unexpected {character!r}" + (f": {hint}" if hint else ""), start)

    def _word(self, end: int) -> Token:
        start = self._position
        word = self._text[start:end]
        if self._text.startswith(".", end) and end < self._end and not self._is_range(end):
            self._fail("a part of the name is missing after '.'", end)
        if self._dialect is Dialect.FEEL and word in _FEEL_UNSUPPORTED:
            self._fail(f"FEEL's '{word}' is not supported", start)
        self._position = end
        if word in _CONSTANTS:
            return Token(Kind.CONSTANT, word, start, _CONSTANTS[word])
        if word in self._words:
            return Token(Kind.OPERATOR, self._words[word], start)
        return Token(Kind.NAME, word, start)

    def _number(self, end: int) -> Token:
        start = self._position
        following = self._text[end] if end < self._end and not self._is_range(end) else ""
        if following and (_continues_name(following) or following == "."):
            self._fail(f"a number cannot be followed by {following!r}", end)
        digits = self._text[start:end]
        self._position = end
        return Token(Kind.NUMBER, digits, start)

    def _is_range(self, position: int) -> bool:
        """Whether the `..` between two ends of a range stands there."""
        return ".." in self._symbols and self._text.startswith("..", position)

    def _quoted(self, quote: str) -> Token:
        start = self._position
        end = start + 1
        while end < self._end and self._text[end] != quote:
            end += 2 if self._text[end] == "\\" else 1
        if end >= self._end:
            self._fail(f"the text is not closed by {quote}", start)
        self._position = end + 1
        try:
            value = unescape(self._text[start + 1 : end])
        except ValueError as error:
            self._fail(str(error), start)
        return Token(Kind.CONSTANT, self._text[start : end + 1], start, value)

    def _fail(self, message: str, position: int) -> NoReturn:
        raise ExpressionSyntaxError(message, self._text, position)
