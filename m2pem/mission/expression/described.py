"""What each dialect has to write with, for people: functions with what they give, and words."""

from collections.abc import Mapping
from dataclasses import dataclass

from m2pem.mission.expression.dialect import Dialect
from m2pem.mission.expression.feel import KEYWORDS
from m2pem.mission.expression.feel_functions import FEEL_FUNCTIONS
from m2pem.mission.expression.functions import FUNCTIONS, XPATH_FUNCTIONS
from m2pem.mission.expression.signatures import Function
from m2pem.mission.expression.vocabulary import CONSTANTS, SYMBOLS, WORDS

_NOW = "the time of the input that is decided, in UTC"


@dataclass(frozen=True, slots=True)
class FunctionText:
    """A function: the ways to call it, with the names of parameters, and what it gives."""

    name: str
    signatures: tuple[str, ...]
    doc: str


@dataclass(frozen=True, slots=True)
class DialectWords:
    """What a dialect has: functions, words with a meaning, operators."""

    functions: tuple[FunctionText, ...]
    words: tuple[str, ...]
    operators: tuple[str, ...]


def expression_dialects() -> dict[Dialect, DialectWords]:
    """What each dialect has to write with, sorted by name."""
    own = FUNCTIONS | _written(("now()", f"{_NOW}, in seconds since 1970-01-01T00:00:00Z"))
    of_xpath = XPATH_FUNCTIONS | _written(
        ("getDataObject(name)", "the value of a name of the data store"),
        ("count(x)", "how many items a list has"),
        ("not(x)", "whether x is false"),
        ("true()", "the boolean true"),
        ("false()", "the boolean false"),
    )
    feel = FEEL_FUNCTIONS | _written(
        ("now()", _NOW),
        ("today()", "the date of the input that is decided, in UTC"),
        ("not(negand)", "whether the value is false; null if it is no boolean"),
    )
    operators = ("=", "!=", "<", "<=", ">", ">=", "and", "or", "in", "+", "-", "*", "/", "**")
    return {
        Dialect.BARE: _words(own, Dialect.BARE),
        Dialect.JUEL: _words(own, Dialect.JUEL),
        Dialect.XPATH: _words(own | of_xpath, Dialect.XPATH),
        Dialect.FEEL: DialectWords(_texts(own | feel), tuple(sorted(KEYWORDS)), operators),
    }


def _written(*rows: tuple[str, str]) -> dict[str, Function]:
    """Functions that no table has: their signatures and texts."""
    return Function.table((signature, str, doc) for signature, doc in rows)


def _texts(functions: Mapping[str, Function]) -> tuple[FunctionText, ...]:
    return tuple(
        FunctionText(name, tuple(way.signature for way in each.ways), each.doc)
        for name, each in sorted(functions.items())
        if name != "@"
    )


def _words(functions: Mapping[str, Function], dialect: Dialect) -> DialectWords:
    symbols = [each for each in SYMBOLS[dialect] if each not in set("()[],.?:!")]
    operators = [*symbols, *(each for each in WORDS[dialect] if each not in ("not", "empty"))]
    constants = () if dialect is Dialect.XPATH else CONSTANTS
    words = tuple(sorted({*constants, *WORDS[dialect]}))
    return DialectWords(_texts(functions), words, tuple(dict.fromkeys(operators)))
