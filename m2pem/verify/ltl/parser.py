"""Parser of formulas (docs/requirements.md, "The language").

From weak to strong: `<->`, `->` (from right to left), `||`, `&&`, `U W since` (which do not chain),
then prefixes: `! [] <> once historically`. Conditions over data are read by the parser of missions'
conditions, so they have the same meaning.
"""

import re
from collections.abc import Callable, Mapping
from typing import NoReturn

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.expression import Expression
from m2pem.mission.expression.dialect import Dialect
from m2pem.mission.expression.functions import FUNCTIONS
from m2pem.mission.expression.parser import Parser
from m2pem.suggestions import did_you_mean
from m2pem.units import US_PER_S, Dimension, UnitError, quantity
from m2pem.verify.ltl import formula as f

_SPACE = re.compile(r"\s*")
WORDS = frozenset({"U", "W", "since", "and", "or", "not", "once", "historically", "true", "false"})
"""Words of the language: they cannot be names of data."""

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
    """Reads a text from left to right. Positions are offsets in it."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.position = 0
        if len(text) > MAX_LENGTH:
            raise ExpressionSyntaxError(
                f"the formula is longer than {MAX_LENGTH} characters", text[:60], 0
            )

    def skip(self) -> int:
        """Skip spaces, and return the position."""
        found = _SPACE.match(self.text, self.position)
        self.position = found.end() if found else self.position
        return self.position

    def at_end(self) -> bool:
        return self.skip() == len(self.text)

    def match(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        """Read what the pattern matches here, if it does."""
        found = pattern.match(self.text, self.skip())
        if found:
            self.position = found.end()
        return found

    def peek(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        """Return the match of the pattern at this position, without reading it."""
        return pattern.match(self.text, self.skip())

    def take(self, symbol: str) -> bool:
        """Read a symbol if it comes next."""
        if self.text.startswith(symbol, self.skip()):
            self.position += len(symbol)
            return True
        return False

    def expect(self, symbol: str, why: str) -> None:
        """Read a symbol that must come next."""
        if not self.take(symbol):
            self.fail(f"expected '{symbol}' {why}, found {self.found()}")

    def found(self) -> str:
        """Return the next symbol, for messages."""
        rest = self.text[self.skip() :]
        word = re.match(r"[\w.]+|\S{1,3}", rest)
        return repr(word[0]) if word else "the end"

    def fail(self, message: str, position: int | None = None) -> NoReturn:
        """Refuse the text at a position, by default here."""
        where = self.position if position is None else position
        hint = self.hint(where)
        raise ExpressionSyntaxError(f"{message}; {hint}" if hint else message, self.text, where)

    def hint(self, position: int) -> str:
        """Return the replacement for a symbol of other notations."""
        rest = self.text[position:]
        found = (hint for symbol, hint in _HINTS.items() if rest.startswith(symbol))
        return "" if rest.startswith(("==", "&&", "||")) else next(found, "")

    def argument(self, what: str) -> tuple[str, int]:
        """A name up to a comma or parenthesis, quoted or not, and its position."""
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
        """The end of a condition over data that begins at `start`."""
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
        """The position after the parenthesis that opens at `start` is closed; -1 if it is not."""
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


MAX_DEPTH = 100
MAX_COUNT = 1_000
ATOMS = (
    "active(E)",
    "completed(E)",
    "commanded(RESOURCE, BEHAVIOR)",
    "ended",
    "count(...) >= N",
    "distance(A, B) < 5 m",
    "altitude(V) > 10 m",
    "speed(V) > 1 m/s",
    "battery(V) < 20 %",
    "link(V) == lost",
)
"""Propositions, besides comparisons of data."""

_PREFIXES: dict[str, Callable[[f.Formula], f.Formula]] = {
    word: kind for kind, word in f.PREFIXES.items()
}
_OPERATORS: dict[str, Callable[[f.Formula, f.Formula], f.Formula]] = {
    word: kind for kind, word in f.OPERATORS.items()
}
_OPERATOR = re.compile(rf"({'|'.join(_OPERATORS)})(?![\w.])")
_WORD = re.compile(r"[^\W\d][\w.]*")
_CALL = re.compile(r"([^\W\d][\w.]*)\s*\(")
_OF_DATA = re.compile(r"\+|-(?!>)|\*|/|<=|<(?!->|>)|>|==|!=|\?|in\b|not\s+in\b")
_NUMBER = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)"
_BOUNDS = re.compile(rf"\[\s*({_NUMBER}\s*[a-z]+)\s*,\s*({_NUMBER}\s*[a-z]+)\s*\]")
_OPENS_BOUNDS = re.compile(rf"\[\s*{_NUMBER}\s*[a-z]*\s*,")
_COMPARED = re.compile(r"<=|>=|==|!=|<(?!->)|>")
_MEASURED = re.compile(rf"(-?{_NUMBER})\s*(%|[^\W\d][\w/²^]*)?")
_WITH_UNIT = re.compile(rf"\s*(?:{_COMPARED.pattern})\s*-?{_NUMBER}\s*[^\W\d_]")
MAX_BOUND_S = 30 * 24 * 3600.0
QUANTITIES: Mapping[str, Dimension | None] = {
    "distance": Dimension.DISTANCE,
    "altitude": Dimension.DISTANCE,
    "speed": Dimension.SPEED,
    "battery": None,
    "link": None,
}
"""What telemetry says of vehicles. A battery is a fraction or has "%", a link has a state."""
LINK_STATES = ("connected", "degraded", "lost")
_BOUND = re.compile(r"(>=|<=|==|!=|>|<)\s*(\d+)")
_OPERATOR_AND, _OPERATOR_OR = re.compile(r"&&|and(?![\w.])"), re.compile(r"\|\||or(?![\w.])")
_OTHER_NOTATIONS = {
    "G": "write '[]'",
    "F": "write '<>'",
    "X": "no formula can count the steps between two states; see the patterns that can",
    "always": "write '[]'",
    "eventually": "write '<>'",
}


def parse(text: str) -> f.Formula:
    """Parse a formula.

    Raises:
        ExpressionSyntaxError: the text is no formula; says where, and what is allowed there.
    """
    return _Parser(Reader(text)).whole()


class _Parser:
    def __init__(self, reader: Reader) -> None:
        self.reader = reader
        self.depth = 0

    def whole(self) -> f.Formula:
        formula = self._equivalence()
        if not self.reader.at_end():
            self._unexpected("an operator or the end")
        return formula

    def _unexpected(self, expected: str) -> None:
        rest = self.reader.text[self.reader.skip() :]
        hint = ""
        if re.match(r"[RVM](?![\w.])", rest):
            hint = "; of two formulas there are U, W and since"
        self.reader.fail(f"expected {expected}, found {self.reader.found()}{hint}")

    def _equivalence(self) -> f.Formula:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            self.reader.fail(f"nested deeper than {MAX_DEPTH} levels")
        left = self._implication()
        while self.reader.take("<->"):
            left = f.Iff(left, self._implication())
        self.depth -= 1
        return left

    def _implication(self) -> f.Formula:
        left = self._joined(
            f.Or, _OPERATOR_OR, lambda: self._joined(f.And, _OPERATOR_AND, self._until)
        )
        if self.reader.take("->"):
            self.depth += 1
            if self.depth > MAX_DEPTH:
                self.reader.fail(f"nested deeper than {MAX_DEPTH} levels")
            left = f.Implies(left, self._implication())
            self.depth -= 1
        return left

    def _joined(
        self,
        make: type[f.And] | type[f.Or],
        operator: re.Pattern[str],
        operand: Callable[[], f.Formula],
    ) -> f.Formula:
        operands = [operand()]
        while self.reader.match(operator):
            operands.append(operand())
        return operands[0] if len(operands) == 1 else make(tuple(operands))

    def _until(self) -> f.Formula:
        start = self.reader.skip()
        left = self._unary()
        found = self.reader.match(_OPERATOR)
        if not found:
            return left
        bounds = self._bounds() if found[1] == "U" else None
        right = self._unary()
        if self.reader.peek(_OPERATOR):
            self.reader.fail("U, W and since do not chain; use parentheses")
        formula = self._timed(_OPERATORS[found[1]](left, right), bounds, start)
        return self._past(formula, "since", start) if found[1] == "since" else formula

    def _unary(self) -> f.Formula:
        signs: list[tuple[str, tuple[int, int] | None, int]] = []
        while not self.reader.text.startswith("!=", self.reader.skip()):
            sign = next((each for each in _PREFIXES if self.reader.take(each)), None)
            if sign is None and self._next_word() == "not":
                self.reader.match(_WORD)
                sign = "!"
            if sign is None:
                break
            at = self.reader.position
            signs.append((sign, self._bounds() if sign in ("[]", "<>") else None, at))
            if len(signs) > MAX_DEPTH:
                self.reader.fail(f"nested deeper than {MAX_DEPTH} levels")
        formula = self._primary()
        for sign, bounds, at in reversed(signs):
            formula = self._timed(_PREFIXES[sign](formula), bounds, at)
        return formula

    def _bounds(self) -> tuple[int, int] | None:
        """Read the bounds of an operator, in microseconds, if it has any."""
        start = self.reader.skip()
        found = self.reader.match(_BOUNDS)
        if not found:
            if self.reader.peek(_OPENS_BOUNDS):
                self.reader.fail("bounds are two times with their units, as in [0 s, 30 s]")
            return None
        try:
            low, high = (quantity(each, Dimension.DURATION) for each in found.groups())
        except UnitError as error:
            self.reader.fail(str(error), start)
        if low > high:
            self.reader.fail(f"{found[1]} is later than {found[2]}", start)
        if high > MAX_BOUND_S:
            self.reader.fail("bounds go up to 30 days", start)
        return round(low * US_PER_S), round(high * US_PER_S)

    def _timed(
        self, formula: f.Formula, bounds: tuple[int, int] | None, position: int
    ) -> f.Formula:
        if bounds is None:
            return formula
        for each in f.children(formula):
            if misused := f.bounds_misused(each):
                self.reader.fail(misused, position)
        return f.Timed(formula, *bounds)

    def _next_word(self) -> str:
        found = self.reader.peek(_WORD)
        return found[0] if found else ""

    def _primary(self) -> f.Formula:
        start = self.reader.skip()
        text = self.reader.text
        if start == len(text):
            self.reader.fail("expected a formula, found the end; " + _listed())
        if text[start] == "(" and not self._parenthesis_of_data(start):
            self.reader.take("(")
            formula = self._equivalence()
            self.reader.expect(")", f"to close '(' at column {start + 1}")
            return formula
        word = self._next_word()
        if word in ("true", "false") and self._alone(start + len(word)):
            self.reader.match(_WORD)
            return f.Constant(word == "true")
        if word in ("once", "historically"):
            self.reader.match(_WORD)
            operand = self._unary()
            formula = f.Once(operand) if word == "once" else f.Historically(operand)
            return self._past(formula, word, start)
        if word == "ended" and self._alone(start + len(word)):
            return self._ended(start)
        if word in _OTHER_NOTATIONS and self._alone(start + len(word)):
            self.reader.fail(f"there is no operator {word}: {_OTHER_NOTATIONS[word]}")
        if word in WORDS and word not in ("true", "false"):
            self.reader.fail(f"expected a formula, found '{word}'; " + _listed())
        if called := self.reader.peek(_CALL):
            readers: dict[str, Callable[[int], f.Formula]] = {
                "active": self._active,
                "completed": self._completed,
                "commanded": self._commanded,
                "count": self._count,
            }
            if called[1] in QUANTITIES and self._is_measured(called):
                self.reader.match(_CALL)
                return self._measured(called[1], start)
            if called[1] in readers:
                self.reader.match(_CALL)
                return readers[called[1]](start)
            if called[1] not in FUNCTIONS and "." not in called[1]:
                known = [
                    *readers,
                    *QUANTITIES,
                    "ended",
                    "once",
                    "historically",
                    "since",
                    *FUNCTIONS,
                ]
                hint = did_you_mean(called[1], known)
                said = f"there is no '{called[1]}(...)'; {_listed()}"
                self.reader.fail(f"{said}; {hint}" if hint else said, start)
        return self._data(start)

    def _alone(self, end: int) -> bool:
        """Whether a word that ends there does not begin a comparison."""
        rest = self.reader.text[end:].lstrip()
        return not _OF_DATA.match(rest)

    def _parenthesis_of_data(self, start: int) -> bool:
        end = self.reader.after_parenthesis(start)
        return end > 0 and bool(_OF_DATA.match(self.reader.text[end:].lstrip()))

    def _active(self, _start: int) -> f.Formula:
        element, position = self._only("the id of an element")
        return f.Active(element, position)

    def _completed(self, _start: int) -> f.Formula:
        element, position = self._only("the id of an element")
        return f.Completed(element, position)

    def _only(self, what: str) -> tuple[str, int]:
        name, position = self.reader.argument(what)
        self.reader.expect(")", f"after {what}")
        return name, position

    def _commanded(self, _start: int) -> f.Formula:
        resource, position = self.reader.argument("a vehicle, payload or team")
        behavior, there = "", position
        if self.reader.take(","):
            behavior, there = self.reader.argument("the name of a behavior")
        self.reader.expect(")", "after commanded(RESOURCE, BEHAVIOR")
        return f.Commanded(resource, behavior, position, there)

    def _ended(self, start: int) -> f.Formula:
        self.reader.match(_WORD)
        if not self.reader.take("("):
            return f.Ended("", start)
        outcome, position = self._only("how it ended")
        if outcome not in f.OUTCOMES:
            choices = ", ".join(f.OUTCOMES)
            self.reader.fail(f"a run ends as one of {choices}, not '{outcome}'", position)
        return f.Ended(outcome, position)

    def _count(self, start: int) -> f.Formula:
        operands = [self._equivalence()]
        while self.reader.take(","):
            operands.append(self._equivalence())
        self.reader.expect(")", "to close count(")
        bound = self.reader.match(_BOUND)
        if not bound:
            found = self.reader.found()
            self.reader.fail(f"expected a bound such as '>= 2' after count(...), found {found}")
        if int(bound[2]) > MAX_COUNT:
            self.reader.fail(f"counts go up to {MAX_COUNT}", bound.start(2))
        return self._past(f.Count(tuple(operands), bound[1], int(bound[2])), "count", start)

    def _is_measured(self, called: re.Match[str]) -> bool:
        """Whether it is no function of data of the same name: a value with a unit follows."""
        if called[1] not in FUNCTIONS:
            return True
        end = self.reader.after_parenthesis(called.end() - 1)
        return end > 0 and bool(_WITH_UNIT.match(self.reader.text, end))

    def _measured(self, name: str, start: int) -> f.Formula:
        resources = [self.reader.argument("a vehicle")[0]]
        if name == "distance":
            self.reader.expect(",", "between the two vehicles of distance(A, B)")
            resources.append(self.reader.argument("a vehicle")[0])
        self.reader.expect(")", f"to close {name}(")
        operator = self.reader.match(_COMPARED)
        if not operator:
            self.reader.fail(f"expected a comparison after {name}(...), as in '< 5 m'")
        value, text = self._value_of(name, operator[0])
        return f.Measured(name, tuple(resources), operator[0], value, text, start)

    def _value_of(self, name: str, operator: str) -> tuple[float | str, str]:
        at = self.reader.skip()
        if name == "link":
            state, position = self.reader.argument("the state of a link")
            if state not in LINK_STATES or operator not in ("==", "!="):
                states = ", ".join(LINK_STATES)
                self.reader.fail(f"a link is compared by == or != with {states}", position)
            return state, state
        found = self.reader.match(_MEASURED)
        if not found:
            self.reader.fail(f"expected a quantity, found {self.reader.found()}")
        number, unit = found[1], found[2] or ""
        text = f"{number} {unit}".rstrip()
        dimension = QUANTITIES[name]
        if dimension is None:
            if unit not in ("", "%"):
                self.reader.fail("a battery is compared with a fraction, or with %", at)
            fraction = float(number) / (100 if unit else 1)
            if not 0 <= fraction <= 1:
                self.reader.fail(f"{text} is no charge of a battery; write 20 %, or 0.2", at)
            return fraction, text
        try:
            return quantity(text, dimension), text
        except UnitError as error:
            self.reader.fail(str(error), at)

    def _past(self, formula: f.Formula, word: str, start: int) -> f.Formula:
        if any(isinstance(each, f.FUTURE) for each in f.walk(formula)):
            self.reader.fail(f"{word} looks back: no [], <>, U or W can stand in it", start)
        return formula

    def _data(self, start: int) -> f.Formula:
        end = self.reader.comparison_end(start)
        if end == start:
            self._unexpected("a formula")
        span = slice(start, end)
        try:
            tree = Parser(self.reader.text, span, Dialect.BARE).parse()
        except ExpressionSyntaxError as error:
            known = self._looks_like_data(start) or self.reader.hint(error.position)
            hint = "" if known else "; " + _listed()
            self.reader.fail(error.message.partition(";")[0] + hint, error.position)
        self.reader.position = end
        return f.Data(Expression(self.reader.text[span], Dialect.BARE, tree), start)

    def _looks_like_data(self, start: int) -> bool:
        return bool(re.match(r"[^\W\d][\w.]*\s*(?:[=!<>]=|[<>])", self.reader.text[start:]))


def _listed() -> str:
    return "a formula can ask for " + ", ".join(ATOMS) + " and comparisons of data"
