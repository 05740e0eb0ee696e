"""Splits an expression into tokens."""

import re
from typing import NoReturn, TypeAlias

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.expression.dialect import Dialect, Span
from m2pem.mission.expression.literals import NUMBER, unescape
from m2pem.mission.expression.vocabulary import LOWEST, MEANINGS, SYMBOLS

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
    Dialect.JUEL: r"(?:var|vars|variables):\w+(?=\s*\()",
    Dialect.XPATH: r"(?!(?:and|or|div|mod)\s*+\()(?:[^\W\d][\w.-]*+:)?[^\W\d][\w-]*+(?=\s*+\()",
}
"""Names of functions that are no names of the store."""

# No group is repeated possessively: before Python 3.11.5, one that fails keeps what it took.
_ASCII_NAME = re.compile(r"(?a:[A-Za-z_]\w*+(?:\.\w++)*)")
_QUOTED = r"""'[^'\\]*+(?:\\[nt'"\\][^'\\]*+)*'|"[^"\\]*+(?:\\[nt'"\\][^"\\]*+)*\""""
_NOTHING = "(?!)"
_ALONE = r"(?![\w.]|[^\x00-\x7f])"


Token: TypeAlias = tuple[str, str, int, int]
"""Its kind, text, place in the whole text, and how strongly it binds as an operator after a value.

The kind of an operator, bracket or comma is its name in the bare dialect; others are a "number",
"name", "constant" or the "end".
"""


def _pattern(dialect: Dialect) -> re.Pattern[str]:
    """Space and the token after it, whose kind is the group's name.

    It does not match what is left to `_Closely`: a name or number right before a point or a
    character beyond ASCII, a wrong text, and what is no token.
    """
    called = _CALLED.get(dialect, _NOTHING)
    symbols = sorted(map(re.escape, SYMBOLS[dialect]), key=len, reverse=True)
    return re.compile(
        rf"\s*+(?:(?P<called>{called})"
        rf"|(?P<name>{_ASCII_NAME.pattern}){_ALONE}"
        rf"|(?P<number>{NUMBER.pattern}){_ALONE}"
        rf"|(?P<constant>{_QUOTED})"
        rf"|(?!\.[0-9])(?P<operator>{'|'.join(symbols)}))"
    )


_PATTERNS = {dialect: _pattern(dialect) for dialect in SYMBOLS}


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
    """The tokens of `text` within `span`, closed by the end.

    Raises:
        ExpressionSyntaxError: something that is no token.
    """
    match, meanings = _PATTERNS[dialect].match, MEANINGS[dialect]
    tokens: list[Token] = []
    position = span.start
    end = len(text[: span.stop].rstrip())
    while position < end:
        found = match(text, position, end)
        if found is None:
            kind, start, position = _Closely(text, end).read(position)
        else:
            kind = found.lastgroup or ""
            start, position = found.span(kind)
        written = text[start:position]
        strength = LOWEST
        if kind == "called":
            kind = "name"
        elif written in meanings:
            kind, written, strength = meanings[written]
        tokens.append((kind, written, start, strength))
    tokens.append(("end", "the end", span.stop, LOWEST))
    return tokens


class _Closely:
    """Read a token that resembles a mistake, or raise with what the mistake is."""

    def __init__(self, text: str, end: int) -> None:
        self._text = text
        self._end = end

    def read(self, start: int) -> tuple[str, int, int]:
        """The kind of the token after the space at `start`, its start and its end."""
        while self._text[start].isspace():
            start += 1
        name_end = scan_name(self._text, start, self._end)
        if name_end > start:
            if self._text.startswith(".", name_end) and name_end < self._end:
                self._fail("a part of the name is missing after '.'", name_end)
            return "name", start, name_end
        if number := NUMBER.match(self._text, start, self._end):
            following = self._text[number.end() : self._end][:1]
            if following and (_continues_name(following) or following == "."):
                self._fail(f"a number cannot be followed by {following!r}", number.end())
            return "number", start, number.end()
        character = self._text[start]
        if character in "'\"":
            self._quoted(start)
        hint = _HINTS.get(character)
        self._fail(f"unexpected {character!r}" + (f": {hint}" if hint else ""), start)

    def _quoted(self, start: int) -> None:
        """Says what is wrong with a text."""
        quote = self._text[start]
        end = start + 1
        while end < self._end and self._text[end] != quote:
            end += 2 if self._text[end] == "\\" else 1
        if end >= self._end:
            self._fail(f"the text is not closed by {quote}", start)
        try:
            unescape(self._text[start + 1 : end])
        except ValueError as error:
            self._fail(str(error), start)

    def _fail(self, message: str, position: int) -> NoReturn:
        raise ExpressionSyntaxError(message, self._text, position)
