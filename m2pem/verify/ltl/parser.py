"""Reads formulas (docs/requirements.md, "The language").

From weak to strong: `<->`, `->` (from right to left), `||`, `&&`, `U W since` (which do not chain),
then what stands in front: `! [] <> once historically`. Conditions over data are read by the
parser of missions' conditions, so they mean what they mean there.
"""

import re
from collections.abc import Callable

from m2pem.errors import ExpressionSyntaxError
from m2pem.fleet.nearmiss import did_you_mean
from m2pem.mission.expression import Expression
from m2pem.mission.expression.dialect import Dialect
from m2pem.mission.expression.functions import FUNCTIONS
from m2pem.mission.expression.parser import Parser
from m2pem.verify.ltl import formula as f
from m2pem.verify.ltl.reading import WORDS, Reader

MAX_DEPTH = 100
MAX_COUNT = 1_000
ATOMS = ("active(E)", "completed(E)", "commanded(RESOURCE, BEHAVIOR)", "ended", "count(...) >= N")
"""What a formula can ask of a moment, beside comparisons of data."""

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
_BOUND = re.compile(r"(>=|<=|==|!=|>|<)\s*(\d+)")
_OPERATOR_AND, _OPERATOR_OR = re.compile(r"&&|and(?![\w.])"), re.compile(r"\|\||or(?![\w.])")
_OTHER_NOTATIONS = {
    "G": "write '[]'",
    "F": "write '<>'",
    "X": "no formula can tell how many steps pass between two; see the patterns that can",
    "always": "write '[]'",
    "eventually": "write '<>'",
}


def parse(text: str) -> f.Formula:
    """The formula that a text says.

    Raises:
        ExpressionSyntaxError: it is none; says where reading stopped, and what can stand there.
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
        right = self._unary()
        if self.reader.peek(_OPERATOR):
            self.reader.fail("U, W and since do not chain; use parentheses")
        formula = _OPERATORS[found[1]](left, right)
        return self._past(formula, "since", start) if found[1] == "since" else formula

    def _unary(self) -> f.Formula:
        signs: list[str] = []
        while not self.reader.text.startswith("!=", self.reader.skip()):
            sign = next((each for each in _PREFIXES if self.reader.take(each)), None)
            if sign is None and self._next_word() == "not":
                self.reader.match(_WORD)
                sign = "!"
            if sign is None:
                break
            signs.append(sign)
            if len(signs) > MAX_DEPTH:
                self.reader.fail(f"nested deeper than {MAX_DEPTH} levels")
        formula = self._primary()
        for sign in reversed(signs):
            formula = _PREFIXES[sign](formula)
        return formula

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
            if called[1] in readers:
                self.reader.match(_CALL)
                return readers[called[1]](start)
            if called[1] not in FUNCTIONS and "." not in called[1]:
                known = [*readers, "ended", "once", "historically", "since", *FUNCTIONS]
                hint = did_you_mean(called[1], known)
                said = f"there is no '{called[1]}(...)'; {_listed()}"
                self.reader.fail(f"{said}; {hint}" if hint else said, start)
        return self._data(start)

    def _alone(self, end: int) -> bool:
        """Whether a word that ends there is not the beginning of a comparison."""
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
