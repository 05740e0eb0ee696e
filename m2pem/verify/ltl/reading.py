"""A place in a formula's text, and what can be read from there on."""

import re
from typing import NoReturn

from m2pem.errors import ExpressionSyntaxError

_SPACE = re.compile(r"\s*")
WORDS = frozenset({"U", "W", "since", "and", "or", "not", "once", "historically", "true", "false"})
"""Words of the language: data of these names cannot be asked for."""

_BREAK = re.compile(r"&&|\|\||<->|->|(?<![\w.])(?:U|W|since|and|or)(?![\w.(])")
_HINTS = {
    "=>": "write '->' for \"implies\"",
    "&": "write '&&' for \"and\"",
    "|": "write '||' for \"or\"",
    "~": "write '!' for \"not\"",
    "=": "write '==' for \"equals\"",
}
_CLOSING = {"(": ")", "[": "]"}
MAX_LENGTH = 10_000


class Reader:
    """Reads forward over one text. Positions are offsets in it."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.position = 0
        if len(text) > MAX_LENGTH:
            raise ExpressionSyntaxError(
                f"the formula is longer than {MAX_LENGTH} characters", text[:60], 0
            )

    def skip(self) -> int:
        """Pass over spaces; where the next thing stands."""
        found = _SPACE.match(self.text, self.position)
        self.position = found.end() if found else self.position
        return self.position

    def at_end(self) -> bool:
        """Whether nothing is left."""
        return self.skip() == len(self.text)

    def match(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        """Read what the pattern matches here, if it does."""
        found = pattern.match(self.text, self.skip())
        if found:
            self.position = found.end()
        return found

    def peek(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        """What the pattern matches here; nothing is read."""
        return pattern.match(self.text, self.skip())

    def take(self, symbol: str) -> bool:
        """Read a symbol if it stands here."""
        if self.text.startswith(symbol, self.skip()):
            self.position += len(symbol)
            return True
        return False

    def expect(self, symbol: str, why: str) -> None:
        """Read a symbol that must stand here."""
        if not self.take(symbol):
            self.fail(f"expected '{symbol}' {why}, found {self.found()}")

    def found(self) -> str:
        """What stands here, for messages."""
        rest = self.text[self.skip() :]
        word = re.match(r"[\w.]+|\S{1,3}", rest)
        return repr(word[0]) if word else "the end"

    def fail(self, message: str, position: int | None = None) -> NoReturn:
        """Refuse the text at a position, by default here."""
        where = self.position if position is None else position
        hint = self.hint(where)
        raise ExpressionSyntaxError(f"{message}; {hint}" if hint else message, self.text, where)

    def hint(self, position: int) -> str:
        """What to write for a symbol of other notations that stands there."""
        rest = self.text[position:]
        found = (hint for symbol, hint in _HINTS.items() if rest.startswith(symbol))
        return "" if rest.startswith(("==", "&&", "||")) else next(found, "")

    def argument(self, what: str) -> tuple[str, int]:
        """A name up to a comma or parenthesis, quoted or not, and where it stands."""
        start = self.skip()
        if start < len(self.text) and self.text[start] in "'\"":
            return self._quoted(start), start
        found = re.compile(r"[^\s,()'\"]+").match(self.text, start)
        if not found:
            self.fail(f"expected {what}, found {self.found()}")
        self.position = found.end()
        return found[0], start

    def _quoted(self, start: int) -> str:
        quote = self.text[start]
        found = re.compile(rf"{quote}((?:[^\\{quote}]|\\.)*){quote}").match(self.text, start)
        if not found:
            self.fail(f"the name is not closed by {quote}", start)
        self.position = found.end()
        return re.sub(r"\\(.)", r"\1", found[1])

    def comparison_end(self, start: int) -> int:
        """Where a condition over data ends that begins at `start`."""
        at = start
        open_: list[str] = []
        while at < len(self.text):
            character = self.text[at]
            if character in "'\"":
                at = self._after_quoted(at)
                continue
            if character in _CLOSING:
                open_.append(_CLOSING[character])
            elif open_ and character == open_[-1]:
                open_.pop()
            elif not open_ and (character in ",)" or _BREAK.match(self.text, at)):
                break
            at += 1
        return len(self.text[:at].rstrip())

    def _after_quoted(self, at: int) -> int:
        quote = self.text[at]
        at += 1
        while at < len(self.text) and self.text[at] != quote:
            at += 2 if self.text[at] == "\\" else 1
        return at + 1

    def after_parenthesis(self, start: int) -> int:
        """Where the text goes on after the parenthesis that opens at `start`; -1 if unclosed."""
        at, depth = start, 0
        while at < len(self.text):
            character = self.text[at]
            if character in "'\"":
                at = self._after_quoted(at)
                continue
            depth += (character == "(") - (character == ")")
            at += 1
            if depth == 0:
                return at
        return -1
