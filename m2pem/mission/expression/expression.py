"""A parsed expression, and the ways to get one from text."""

import math
import re
from contextlib import suppress
from functools import lru_cache
from typing import NoReturn

from msgspec import Struct
from msgspec.structs import force_setattr

from m2pem.errors import ExpressionError
from m2pem.mission.expression import cause, feel_values, operators
from m2pem.mission.expression.dialect import Dialect, locate, split
from m2pem.mission.expression.evaluate import Evaluate, evaluator
from m2pem.mission.expression.literals import shorten, show_scalar
from m2pem.mission.expression.operators import MAX_WORK, begin_work, work_left
from m2pem.mission.expression.parser import Parser
from m2pem.mission.expression.rules import RULES, Rules
from m2pem.mission.expression.tree import Join, Literal, Node, names
from m2pem.mission.values import ReadValue, Value

EXPRESSION_RULES = 1
"""Which rules expressions are evaluated by: another number since some have other values than
before, so that operators of a run that was begun by others can know. 0: not numbered yet."""

_BARE = (None, Dialect.BARE.value)
_set_work_left = work_left.set
_PLAIN = frozenset({bool, int, str})
_INTEGER = re.compile(r"-?[0-9]{1,18}")


class Expression(Struct, frozen=True, eq=False):
    """A parsed expression; never changes. Equal to another of the same text and dialect.

    `text` is what was written, `tree` what it means. What evaluates it and the names that it reads
    are found when they are first asked for.
    """

    text: str
    dialect: Dialect
    tree: Node
    _run: Evaluate | None = None
    _names: frozenset[str] | None = None

    def __reduce__(self) -> tuple[type["Expression"], tuple[str, Dialect, Node]]:
        return Expression, (self.text, self.dialect, self.tree)

    @property
    def names(self) -> frozenset[str]:
        """The dotted names that it reads."""
        if self._names is None:
            force_setattr(self, "_names", names(self.tree))
        return self._names or frozenset()

    @property
    def rules(self) -> Rules:
        """What its operators do."""
        return RULES[self.dialect]

    @property
    def constant(self) -> bool:
        """Whether it reads nothing, so that its value is always the same."""
        return not self.names

    def evaluate(self, read: ReadValue, *, new_limit: bool = True) -> Value:
        """Its value over the data store; dates and durations of FEEL are ISO 8601 texts.

        `new_limit`: what it looks at is counted from 0; else it shares that with what was evaluated
        before.

        Raises:
            ExpressionError: a wrong type, a division by zero, or something beyond the limits.
        """
        if new_limit:
            _set_work_left(MAX_WORK)
        if feel_values.cause():
            feel_values.begin()
        try:
            value = (self._run or self._prepare())(read)
            kind = type(value)
            if kind in _PLAIN or (kind is float and math.isfinite(value)):
                return value  # type: ignore[no-any-return]
            if value is None:
                feel_values.refuse_null()
            result = RULES[self.dialect].result
            return result(value) if result else value
        except ExpressionError as error:
            self._explain(error, read)
        except RecursionError:
            self._explain(ExpressionError("functions and values are nested too deep"))

    def holds(self, read: ReadValue) -> bool:
        """Its truth: null is false; JUEL and XPath coerce other values.

        Raises:
            ExpressionError: as `evaluate`, and when the value is not true or false.
        """
        return self.truth(read) is True

    def truth(self, read: ReadValue) -> bool | None:
        """As `holds`; None: the value is null, for the reason that `why_null` gives."""
        _set_work_left(MAX_WORK)
        if feel_values.cause():
            feel_values.begin()
        try:
            value = (self._run or self._prepare())(read)
            if value is True or value is False:
                return value
            if value is None:
                feel_values.refuse_null()
                return None
            result = self.rules.result
            return self.rules.truth(result(value) if result else value, "a condition")
        except ExpressionError as error:
            self._explain(error, read)
        except RecursionError:
            self._explain(ExpressionError("functions and values are nested too deep"))

    def _prepare(self) -> Evaluate:
        """Make what evaluates it: most expressions of a mission are never evaluated."""
        run = evaluator(self.tree, self.rules)
        force_setattr(self, "_run", run)
        return run

    def kind(self, read: ReadValue) -> str:
        """The kind of the value in its language, where `evaluate` has one: in FEEL also a date or
        a duration, which data has as a text.

        Raises:
            ExpressionError: as `evaluate`.
        """
        if self.rules.ternary:
            begin_work()
            return feel_values.kind(evaluator(self.tree, self.rules)(read))
        return operators.kind(self.evaluate(read))

    def why_null(self, read: ReadValue) -> str:
        """Why the value is null: `armed is not set`; "": no name alone is the reason."""
        return cause.why_null(self.tree, self.rules, read)

    def _explain(self, error: ExpressionError, read: ReadValue | None = None) -> NoReturn:
        if read is not None:
            with suppress(RecursionError):
                why = cause.why_failed(
                    self.text, self.dialect, self.tree, self.rules, read, str(error)
                )
                raise ExpressionError(why) from error
        raise ExpressionError(f"{error}, in {shorten(self.text.strip())!r}") from error

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Expression):
            return NotImplemented
        return self.text == other.text and self.dialect is other.dialect

    def __hash__(self) -> int:
        return hash((self.text, self.dialect))

    def __repr__(self) -> str:
        return f"<Expression {self.text!r}>"

    def __str__(self) -> str:
        return self.text


@lru_cache(maxsize=1024)  # missions repeat their conditions, and an expression never changes
def parse(text: str, language: str | None = None) -> Expression:
    """Parse one expression: `${...}` (Camunda 7), a leading `=` (FEEL), else bare.

    `language` is the XML's `language` or `expressionLanguage`: none, "juel", "FEEL" or a URI that
    ends in it, or "m2pem", which admits the bare dialect alone.

    Raises:
        ExpressionSyntaxError: it is none, is beyond the limits, or is in another language.
    """
    if language in _BARE and _INTEGER.fullmatch(text):  # what scripts assign most
        return Expression(text, Dialect.BARE, Literal(int(text)))
    dialect, span = locate(text, language)
    return Expression(text, dialect, cause.parser_of(text, span, dialect).parse())


def template(text: str) -> Expression:
    """Parse a parameter's value: a whole `${...}` or a leading `=` is that expression; other text
    with `${...}` parts is a text that they are written into; anything else is itself.

    Raises:
        ExpressionSyntaxError: an expression in it cannot be parsed.
    """
    stripped = text.strip()
    if stripped.startswith("="):
        return parse(text)
    parts = split(text)
    spans = [part for part in parts if isinstance(part, slice)]
    if not spans:
        return Expression(text, Dialect.TEXT, Literal("".join(map(str, parts))))
    if len(spans) == 1 and text[spans[0].start - 2 : spans[0].stop + 1] == stripped:
        return parse(text)
    nodes = tuple(
        Literal(each) if isinstance(each, str) else Parser(text, each, Dialect.JUEL).parse()
        for each in parts
    )
    return Expression(text, Dialect.TEMPLATE, Join(nodes))


def literal(value: bool | int | float | str | None) -> Expression:
    """The expression that is always `value`."""
    if value is None:
        return Expression("null", Dialect.BARE, Literal(None))
    if isinstance(value, str):
        return Expression(value, Dialect.TEXT, Literal(value))
    text = repr(value) if isinstance(value, float) else show_scalar(value)
    return Expression(text, Dialect.BARE, Literal(value))
