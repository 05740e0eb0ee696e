"""Which dialect a text is written in, and where in it the expressions stand."""

import re
from enum import StrEnum
from functools import lru_cache
from typing import TypeAlias

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.expression.literals import shorten


class Dialect(StrEnum):
    """The ways to write an expression. TEMPLATE: text with `${...}` parts. TEXT: only itself."""

    BARE = "m2pem"
    JUEL = "juel"
    FEEL = "feel"
    XPATH = "xpath"
    TEMPLATE = "template"
    TEXT = "text"

    __hash__ = str.__hash__  # an enum's own is slow


Span: TypeAlias = "slice[int, int, None]"
"""Where an expression stands in its text, without its marks."""


MAX_LENGTH = 10_000
"""Characters of a text that holds an expression."""

_ACCEPTED = "supported are m2pem (bare), juel ('${...}'), FEEL (a leading '=') and XPath"
_MARK = re.compile(r"\\[$#]\{|[$#]\{")
_XPATH_MARK = re.compile(r"\bget(?:DataInput|DataObject|DataOutput|ProcessProperty)\s*\(")


def locate(text: str, language: str | None) -> tuple[Dialect, Span]:
    """The dialect of a text that is one expression, by its marks, else by its `language`.

    Raises:
        ExpressionSyntaxError: the language is not supported; the text is too long, or goes on
            outside its `${...}`.
    """
    _limit(text)
    spoken = _spoken(language)
    stripped = text.strip()
    start = len(text) - len(text.lstrip())
    whole = slice(start, start + len(stripped))
    if language and spoken is None:
        raise ExpressionSyntaxError(
            f"the expression language {shorten(language)!r} is not supported; {_ACCEPTED}",
            text,
            0,
        )
    if spoken is Dialect.BARE:
        return Dialect.BARE, whole
    if stripped.startswith(("${", "#{")):
        span = _close(text, start)
        if span.stop + 1 != whole.stop:
            raise ExpressionSyntaxError(
                "an expression is one '${...}': put all of it between the braces",
                text,
                span.stop + 1,
            )
        return Dialect.JUEL, span
    if stripped.startswith("="):
        return Dialect.FEEL, slice(start + 1, whole.stop)
    if spoken is None and _XPATH_MARK.search(stripped):
        return Dialect.XPATH, whole
    return spoken or Dialect.BARE, whole


def split(text: str) -> "list[str | Span]":
    """The literal parts of a text (`\\${` stands for `${`) and its `${...}` parts, in order.

    Raises:
        ExpressionSyntaxError: a `${` without its `}`, or a text with a `${` that is too long.
    """
    parts: list[str | Span] = []
    literal = ""
    position = 0
    while mark := _MARK.search(text, position):
        literal += text[position : mark.start()]
        if mark[0].startswith("\\"):
            literal += mark[0][1:]
            position = mark.end()
            continue
        _limit(text)
        if literal:
            parts.append(literal)
            literal = ""
        span = _close(text, mark.start())
        parts.append(span)
        position = span.stop + 1
    literal += text[position:]
    return [*parts, literal] if literal else parts


def _limit(text: str) -> None:
    if len(text) > MAX_LENGTH:
        message = f"the expression is longer than {MAX_LENGTH} characters"
        raise ExpressionSyntaxError(message, shorten(text), 0)


def outside_quotes(text: str, wanted: str, position: int = 0) -> int | None:
    """Return where a character is first that is not inside a quoted text; None: nowhere."""
    quote = ""
    while position < len(text):
        character = text[position]
        if quote:
            if character == "\\":
                position += 1
            elif character == quote:
                quote = ""
        elif character in "'\"":
            quote = character
        elif character == wanted:
            return position
        position += 1
    return None


def _close(text: str, mark: int) -> Span:
    """The inside of the `${` at `mark`; a brace inside quotes does not close it."""
    end = outside_quotes(text, "}", mark + 2)
    if end is None:
        raise ExpressionSyntaxError(f"'{text[mark : mark + 2]}' is not closed by '}}'", text, mark)
    return slice(mark + 2, end)


@lru_cache(maxsize=16)
def _spoken(language: str | None) -> Dialect | None:
    if not language:
        return None
    parts = [part for part in re.split(r"[/:#]", language.strip().lower()) if part]
    if "feel" in parts:
        return Dialect.FEEL
    if parts == ["m2pem"]:
        return Dialect.BARE
    if parts and parts[-1] == "juel":
        return Dialect.JUEL
    if "xpath" in language.lower():
        return Dialect.XPATH
    return None
