"""What each dialect has to write with, for people: functions with what they give, and words."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from m2pem.mission.expression.dialect import Dialect
from m2pem.mission.expression.feel import KEYWORDS
from m2pem.mission.expression.feel_functions import FEEL_FUNCTIONS, FeelFunction
from m2pem.mission.expression.feel_library import RELATIONS
from m2pem.mission.expression.functions import FUNCTIONS, XPATH_FUNCTIONS
from m2pem.mission.expression.vocabulary import CONSTANTS, SYMBOLS, WORDS

_OWN = {
    "abs": "the number without its sign",
    "min": "the least of some numbers, or of one list of numbers",
    "max": "the greatest of some numbers, or of one list of numbers",
    "round": "the nearest integer; a half goes away from zero",
    "floor": "the greatest integer that is not above x",
    "ceil": "the least integer that is not below x",
    "sqrt": "the square root; x must not be negative",
    "mod": "the remainder of x / y, with the sign of y; y must not be 0",
    "number": "the number that a text writes",
    "text": "a number, boolean or text as a text",
    "length": "how many characters a text, items a list, or keys a map has",
    "contains": "whether the text x has the text y in it, or the list x an item equal to y",
    "starts_with": "whether the text x begins with the text y",
    "ends_with": "whether the text x ends with the text y",
    "upper": "the text in capital letters",
    "lower": "the text in small letters",
    "exists": "whether x is not null",
    "is_empty": "whether x is null, an empty text, list or map",
    "sum": "the sum of a list of numbers",
    "date": "the time that a date is, in seconds since 1970-01-01T00:00:00Z",
    "duration": "how many seconds a duration has",
    "distance": "horizontal distance in metres between two positions [latitude, longitude]",
}
_XPATH = {
    "boolean": "x as a boolean: of a number, whether it is not 0; of a text, whether it has any",
    "ceiling": "the least integer that is not below x",
    "concat": "the texts, one after the other",
    "contains": "whether the text x has the text y in it",
    "floor": "the greatest integer that is not above x",
    "normalize-space": "the text without spaces at its ends, and with single ones in it",
    "number": "x as a number",
    "round": "the nearest integer; a half goes up",
    "starts-with": "whether the text x begins with the text y",
    "string": "x as a text",
    "string-length": "how many characters the text has",
    "substring": "the text from the character start on, which counts from 1",
    "substring-after": "what follows the first y in the text x",
    "substring-before": "what is before the first y in the text x",
    "translate": "the text x, with the characters of z for those of y",
}
_FEEL = {
    "date": "a date, of its text or parts",
    "date and time": "a date with a time, of its text or parts",
    "time": "a time of day, of its text or parts",
    "duration": "a duration, of its text in ISO 8601",
    "years and months duration": "the whole months between two dates",
    "number": "the number that a text writes",
    "string": "the value as a text",
    "range": "a range, of its text: [1..5]",
    "substring": "the text from a position on; the first is 1, the last -1",
    "string length": "how many characters the text has",
    "upper case": "the text in capital letters",
    "lower case": "the text in small letters",
    "substring before": "what is before the first match",
    "substring after": "what follows the first match",
    "contains": "whether the text has the match in it",
    "starts with": "whether the text begins with the match",
    "ends with": "whether the text ends with the match",
    "matches": "whether the regular expression fits a part of the text",
    "replace": "the text, with what the regular expression fits replaced",
    "split": "the parts of the text between what the regular expression fits",
    "string join": "the texts of the list as one, with the delimiter between them",
    "trim": "the text without spaces at its ends",
    "is blank": "whether the text has only spaces",
    "decimal": "the number with so many decimals; a half goes to the even digit",
    "floor": "the greatest number with so many decimals that is not above n",
    "ceiling": "the least number with so many decimals that is not below n",
    "round up": "the number with so many decimals, away from zero",
    "round down": "the number with so many decimals, towards zero",
    "round half up": "the nearest number with so many decimals; a half goes away from zero",
    "round half down": "the nearest number with so many decimals; a half goes towards zero",
    "abs": "the number or duration without its sign",
    "modulo": "the remainder, with the sign of the divisor",
    "sqrt": "the square root",
    "log": "the natural logarithm",
    "exp": "e to the power of the number",
    "odd": "whether the integer is odd",
    "even": "whether the integer is even",
    "list contains": "whether an item equals the element",
    "count": "how many items the list has",
    "min": "the least item",
    "max": "the greatest item",
    "sum": "the sum of the numbers",
    "product": "the product of the numbers",
    "mean": "the arithmetic mean of the numbers",
    "median": "the middle one of the numbers",
    "stddev": "the sample standard deviation of the numbers",
    "mode": "the numbers that are most frequent",
    "all": "whether all items are true",
    "any": "whether an item is true",
    "sublist": "the items from a position on; the first is 1, the last -1",
    "append": "the list with the items at its end",
    "concatenate": "the items of all lists",
    "insert before": "the list with an item before the position",
    "remove": "the list without the item at the position",
    "list replace": "the list with another item at the position, or where the function is true",
    "reverse": "the list from its end",
    "index of": "the positions of the items that equal the match",
    "union": "the items of all lists, each once",
    "distinct values": "the items, each once",
    "duplicate values": "the items that are there several times",
    "flatten": "the items, with those of inner lists in place of these",
    "sort": "the items in order; precedes: whether one is before another",
    "partition": "the items in lists of so many",
    "is empty": "whether the list has no items",
    "get value": "the value of a key of the context",
    "get entries": "a list of the context's keys and values",
    "context": "a context, of a list of keys and values",
    "context put": "the context with another value of a key, or of a path of keys",
    "context merge": "the entries of all contexts; of equal keys, the last",
    "day of week": "the name of the weekday",
    "day of year": "the number of the day in its year",
    "week of year": "the number of the week, by ISO 8601",
    "month of year": "the name of the month",
    "last day of month": "the last day of the date's month",
    "is": "whether both are the same, and of the same kind",
    "is defined": "whether the value is not null",
    "get or else": "the value, or the default if it is null",
    "assert": "the value; an error if the condition is not true",
    "cycle": "a timer's cycle, in ISO 8601",
    **{name: f"whether range1 {name} range2 (points, or ranges)" for name in RELATIONS},
}
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
    own = {each.name: ((each.signature,), _OWN[each.name]) for each in FUNCTIONS.values()}
    own["now"] = (("now()",), f"{_NOW}, in seconds since 1970-01-01T00:00:00Z")
    xpath = {each.name: ((each.signature,), _XPATH[each.name]) for each in XPATH_FUNCTIONS.values()}
    xpath |= {
        "getDataObject": (("getDataObject(name)",), "the value of a name of the data store"),
        "count": (("count(x)",), "how many items a list has"),
        "not": (("not(x)",), "whether x is false"),
        "true": (("true()",), "the boolean true"),
        "false": (("false()",), "the boolean false"),
    }
    feel = {each.name: (tuple(_signatures(each)), _FEEL.get(each.name, ""))
            for each in FEEL_FUNCTIONS.values() if each.name != "@"}  # fmt: skip
    feel |= {
        "now": (("now()",), _NOW),
        "today": (("today()",), "the date of the input that is decided, in UTC"),
        "not": (("not(negand)",), "whether the value is false; null if it is no boolean"),
    }
    found = {each: _words(own, each) for each in (Dialect.BARE, Dialect.JUEL)}
    found[Dialect.XPATH] = _words(own | xpath, Dialect.XPATH)
    operators = ("=", "!=", "<", "<=", ">", ">=", "and", "or", "in", "+", "-", "*", "/", "**")
    words = tuple(sorted(KEYWORDS))
    found[Dialect.FEEL] = DialectWords(_functions(own | feel), words, operators)
    return found


_Described = Mapping[str, tuple[tuple[str, ...], str]]


def _functions(described: _Described) -> tuple[FunctionText, ...]:
    return tuple(FunctionText(name, *described[name]) for name in sorted(described))


def _words(described: _Described, dialect: Dialect) -> DialectWords:
    symbols = [each for each in SYMBOLS[dialect] if each not in set("()[],.?:!")]
    operators = [*symbols, *(each for each in WORDS[dialect] if each not in ("not", "empty"))]
    constants = () if dialect is Dialect.XPATH else CONSTANTS
    words = tuple(sorted({*constants, *WORDS[dialect]}))
    return DialectWords(_functions(described), words, tuple(dict.fromkeys(operators)))


def _signatures(function: FeelFunction) -> Iterator[str]:
    for each in (function, *function.others):
        names = [f"{one.name}?" if one.optional else one.name for one in each.parameters]
        yield f"{each.name}({', '.join([*names, '...'] if each.more or each.rest else names)})"
