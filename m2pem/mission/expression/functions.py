"""The functions that expressions may call; docs/conditions.md lists the same ones (a test)."""

import math
import operator
from collections.abc import Callable
from dataclasses import replace
from decimal import ROUND_HALF_UP, Decimal
from typing import Any

import m2pem.mission.timers as times  # imports this package too: only its name is bound yet
from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.expression import xpath
from m2pem.mission.expression.feel_functions import ALTERNATIVES, FEEL_FUNCTIONS
from m2pem.mission.expression.feel_library import text_after, text_before
from m2pem.mission.expression.literals import NUMBER, read_number
from m2pem.mission.expression.operators import (
    bounded,
    bounded_text,
    describe,
    equal,
    kind,
    text_of,
)
from m2pem.mission.expression.signatures import Function
from m2pem.mission.expression.temporal import Computed

EARTH_RADIUS_M = 6_371_008.8
"""Mean radius of the WGS-84 ellipsoid (2a + b) / 3.

`distance()` of expressions is that of the haversine formula on this sphere, not the one of
`m2pem.geo`: missions and journals that exist must always give the same values.
"""


def _to_whole(
    name: str, compute: Callable[[int | float], int]
) -> Callable[[int | float], int | float]:
    what = f"{name}()"

    def whole(x: int | float) -> int | float:
        try:
            result: int | float = compute(x)
        except (OverflowError, ValueError):  # of what is infinite, or not a number
            result = math.inf
        return bounded(result, what, x)

    return whole


def _round(x: int | float) -> int:
    # Python's round() takes halves to the even number, which surprises people.
    return int(Decimal(x).to_integral_value(ROUND_HALF_UP))


def _sqrt(x: int | float) -> float:
    if x < 0:
        raise ExpressionError(f"sqrt() takes a number from 0 on, not {describe(x)}")
    return math.sqrt(bounded(x, "sqrt()", x))


def _mod(x: int | float, y: int | float) -> int | float:
    if y == 0:
        raise ExpressionError(f"mod() divides {describe(x)} by zero")
    try:
        result = x % y
    except OverflowError:
        result = math.inf
    return bounded(result, "mod()", x, y)


def _extreme(name: str, pick: Callable[[Any], Any]) -> Callable[..., Computed]:
    def compute(*arguments: Computed) -> Computed:
        values: list[Computed] = list(arguments)
        if isinstance(arguments[0], list):
            if len(arguments) > 1:
                raise ExpressionError(f"{name}() takes numbers, or one list of numbers")
            values = list(arguments[0])
        if not values or any(value is None for value in values):
            return None
        for value in values:
            if kind(value) != "number":
                raise ExpressionError(f"{name}() takes numbers, not {describe(value)}")
        return bounded(pick(values), f"{name}()")

    return compute


def _contains(container: list[Computed] | str, item: Computed) -> Computed:
    if isinstance(container, list):
        return any(kind(each) == kind(item) and equal(each, item) for each in container)
    if item is None:
        return None
    if not isinstance(item, str):
        raise ExpressionError(f"contains() looks for a text in a text, not {describe(item)}")
    return item in container


def _number(value: int | float | str) -> Computed:
    if not isinstance(value, str):
        return value
    digits = value.strip()
    if not NUMBER.fullmatch(digits.removeprefix("-")):
        raise ExpressionError(f"number() cannot read {describe(value)}")
    try:
        return read_number(digits)
    except ValueError as error:
        raise ExpressionError(f"number() cannot read {describe(value)}: {error}") from None


def _sum(values: list[Computed]) -> Computed:
    total: int | float = 0
    for value in values:
        if value is None:
            return None
        if not isinstance(value, (int, float)) or isinstance(value, bool):
            raise ExpressionError(f"sum() takes numbers, not {describe(value)}")
        total = bounded(total + value, "sum()")
    return total


def _date(text: str) -> Computed:
    return _seconds("date", lambda: times.date_us(text))


def _duration(text: str) -> Computed:
    if any(sign in text.partition("T")[0] for sign in "YM"):
        raise ExpressionError("duration() has no years and months: how long they are is not known")
    return _seconds("duration", lambda: times.duration_us(text, 0))


def _seconds(name: str, read_us: Callable[[], int]) -> Computed:
    try:
        return read_us() / 1_000_000
    except ExpressionSyntaxError as error:
        raise ExpressionError(f"{name}(): {error}") from None


def _degrees(position: list[Computed]) -> tuple[float, float]:
    if len(position) in (2, 3) and all(kind(each) == "number" for each in position[:2]):
        latitude, longitude = position[:2]
        assert isinstance(latitude, (int, float))
        assert isinstance(longitude, (int, float))
        if -90 <= latitude <= 90 and -180 <= longitude <= 180:
            return float(latitude), float(longitude)
    raise ExpressionError(
        "distance() takes positions, [latitude, longitude] or [latitude, longitude, altitude]"
        f" in degrees and metres, not [{', '.join(describe(each) for each in position[:3])}]"
    )


def _distance(a: list[Computed], b: list[Computed]) -> Computed:
    (lat_a, lon_a), (lat_b, lon_b) = _degrees(a), _degrees(b)
    half_north = math.sin(math.radians(lat_b - lat_a) / 2)
    half_east = math.sin(math.radians(lon_b - lon_a) / 2)
    h = half_north**2 + math.cos(math.radians(lat_a)) * math.cos(math.radians(lat_b)) * half_east**2
    return 2 * EARTH_RADIUS_M * math.asin(min(1.0, math.sqrt(h)))


FUNCTIONS = Function.table([
    ("abs(x: number) -> number", lambda x: bounded(abs(x), "abs()", x),
     "the number without its sign"),
    ("min(x: number|list, ...) -> number", _extreme("min", min),
     "the least of some numbers, or of one list of numbers"),
    ("max(x: number|list, ...) -> number", _extreme("max", max),
     "the greatest of some numbers, or of one list of numbers"),
    ("round(x: number) -> number", _to_whole("round", _round),
     "the nearest integer; a half goes away from zero"),
    ("floor(x: number) -> number", _to_whole("floor", math.floor),
     "the greatest integer that is not above x"),
    ("ceil(x: number) -> number", _to_whole("ceil", math.ceil),
     "the least integer that is not below x"),
    ("sqrt(x: number) -> number", _sqrt, "the square root; x must not be negative"),
    ("mod(x: number, y: number) -> number", _mod,
     "the remainder of x / y, with the sign of y; y must not be 0"),
    ("number(x: number|text) -> number", _number, "the number that a text writes"),
    ("text(x: boolean|number|text) -> text", text_of, "a number, boolean or text as a text"),
    ("length(x: text|list|map) -> number", len,
     "how many characters a text, items a list, or keys a map has"),
    ("contains(x: text|list, y) -> boolean", _contains,
     "whether the text x has the text y in it, or the list x an item equal to y"),
    ("starts_with(x: text, y: text) -> boolean", str.startswith,
     "whether the text x begins with the text y"),
    ("ends_with(x: text, y: text) -> boolean", str.endswith,
     "whether the text x ends with the text y"),
    ("upper(x: text) -> text", lambda x: bounded_text(x.upper(), "upper()"),
     "the text in capital letters"),
    ("lower(x: text) -> text", lambda x: bounded_text(x.lower(), "lower()"),
     "the text in small letters"),
    ("exists(x) -> boolean", lambda x: x is not None, "whether x is not null"),
    ("is_empty(x) -> boolean", lambda x: x is None or x in ("", [], {}),
     "whether x is null, an empty text, list or map"),
    ("sum(x: list) -> number", _sum, "the sum of a list of numbers"),
    ("date(x: text) -> number", _date,
     "the time that a date is, in seconds since 1970-01-01T00:00:00Z"),
    ("duration(x: text) -> number", _duration, "how many seconds a duration has"),
    ("distance(a: list, b: list) -> number", _distance,
     "horizontal distance in metres between two positions [latitude, longitude]"),
])  # fmt: skip


def _converting(function: Function) -> Function:
    """A function that converts its arguments to the kinds it takes, and so takes all."""
    to = [_CONVERSIONS[kind] for each in function.parameters for kind in each.kinds]
    parameters = tuple(replace(each, kinds=()) for each in function.parameters)
    compute = xpath.converted(function.compute, *to) if to else function.compute
    return replace(function, parameters=parameters, compute=compute)


_CONVERSIONS: dict[str, Callable[[Computed], Computed]] = {
    "text": xpath.string,
    "number": xpath.rounded,
}

XPATH_FUNCTIONS = {
    name: _converting(each)
    for name, each in Function.table([
        ("boolean(x) -> boolean", lambda x: xpath.truth(x, ""),
         "x as a boolean: of a number, whether it is not 0; of a text, whether it has any"),
        ("ceiling(x) -> number", xpath.whole(math.ceil), "the least integer that is not below x"),
        ("concat(x, y, ...) -> text", xpath.concat, "the texts, one after the other"),
        ("contains(x: text, y: text) -> boolean", operator.contains,
         "whether the text x has the text y in it"),
        ("floor(x) -> number", xpath.whole(math.floor), "the greatest integer that is not above x"),
        ("normalize-space(x: text) -> text", xpath.normalize_space,
         "the text without spaces at its ends, and with single ones in it"),
        ("number(x) -> number", xpath.number, "x as a number"),
        ("round(x) -> number", xpath.rounded, "the nearest integer; a half goes up"),
        ("starts-with(x: text, y: text) -> boolean", str.startswith,
         "whether the text x begins with the text y"),
        ("string(x) -> text", xpath.string, "x as a text"),
        ("string-length(x: text) -> number", len, "how many characters the text has"),
        ("substring(x: text, start: number, length?: number) -> text", xpath.substring,
         "the text from the character start on, which counts from 1"),
        ("substring-after(x: text, y: text) -> text", text_after,
         "what follows the first y in the text x"),
        ("substring-before(x: text, y: text) -> text", text_before,
         "what is before the first y in the text x"),
        ("translate(x: text, y: text, z: text) -> text", xpath.translate,
         "the text x, with the characters of z for those of y"),
    ]).items()
}  # fmt: skip
"""XPath's own, which convert what they take (XPath 1.0, clause 4)."""

LISTED: dict[str, Function] = {
    **FUNCTIONS,
    **{f"XPATH {name}": each for name, each in XPATH_FUNCTIONS.items()},
    **{f"FEEL {name}": each for name, each in (FEEL_FUNCTIONS | ALTERNATIVES).items()},
}
"""All functions, by their names in a tree."""
