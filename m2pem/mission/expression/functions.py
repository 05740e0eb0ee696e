"""The functions that expressions may call; docs/conditions.md lists the same ones (a test)."""

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal
from typing import Any

import m2pem.mission.timers as times  # imports this package too: only its name is bound yet
from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.expression import xpath
from m2pem.mission.expression.feel_functions import ALTERNATIVES, FEEL_FUNCTIONS, FeelFunction
from m2pem.mission.expression.feel_library import text_after, text_before
from m2pem.mission.expression.literals import NUMBER, read_number
from m2pem.mission.expression.operators import (
    TEXT_AS_VALUE,
    bounded,
    bounded_text,
    describe,
    equal,
    kind,
    look_at,
    text_of,
)
from m2pem.mission.expression.temporal import Computed

EARTH_RADIUS_M = 6_371_008.8
"""Mean radius of the WGS-84 ellipsoid (2a + b) / 3.

`distance()` of expressions is that of the haversine formula on this sphere, not the one of
`m2pem.geo`: missions and journals that exist must always give the same values.
"""

_ANY = ("null", "boolean", "number", "text", "list", "map")


@dataclass(frozen=True, slots=True)
class Function:
    """A function: what it takes, and what computes it.

    `takes` holds the kinds of each parameter; with `rest` the last one may be repeated, and
    `optional` of the last may be left out. Unless a parameter takes null, a null argument makes the
    result null. `gives`: the kinds of its values, besides null.
    """

    signature: str
    takes: tuple[tuple[str, ...], ...]
    compute: Callable[..., Computed]
    rest: bool = False
    gives: tuple[str, ...] = ("number",)
    optional: int = 0

    @property
    def name(self) -> str:
        """The function's name in expressions."""
        return self.signature.partition("(")[0]

    def accepts(self, count: int) -> bool:
        """Whether it may be called with so many arguments."""
        least = len(self.takes) - self.optional
        return count >= least if self.rest else least <= count <= len(self.takes)

    def call(self, arguments: list[Computed]) -> Computed:
        """Return the function's value; raises ExpressionError."""
        null = False
        for index, argument in enumerate(arguments):
            kinds = self.takes[min(index, len(self.takes) - 1)]
            if argument is None and "null" not in kinds:
                null = True
            elif kind(argument) not in kinds:
                wanted = " or ".join(kinds)
                raise ExpressionError(f"{self.name}() takes a {wanted}, not {describe(argument)}")
            elif isinstance(argument, list):
                look_at(len(argument))
            elif isinstance(argument, str):
                look_at(len(argument) // TEXT_AS_VALUE)
        return None if null else self.compute(*arguments)


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


def _upper(text: str) -> Computed:
    return bounded_text(text.upper(), "upper()")


def _lower(text: str) -> Computed:
    return bounded_text(text.lower(), "lower()")


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


_NUMBER = ("number",)
_TEXT = ("text",)
_BOOLEAN = ("boolean",)

FUNCTIONS: dict[str, Function] = {
    function.name: function
    for function in (
        Function("abs(x)", (_NUMBER,), lambda x: bounded(abs(x), "abs()", x)),
        Function("min(x, ...)", (("number", "list"),), _extreme("min", min), rest=True),
        Function("max(x, ...)", (("number", "list"),), _extreme("max", max), rest=True),
        Function("round(x)", (_NUMBER,), _to_whole("round", _round)),
        Function("floor(x)", (_NUMBER,), _to_whole("floor", math.floor)),
        Function("ceil(x)", (_NUMBER,), _to_whole("ceil", math.ceil)),
        Function("sqrt(x)", (_NUMBER,), _sqrt),
        Function("mod(x, y)", (_NUMBER, _NUMBER), _mod),
        Function("number(x)", (("number", "text"),), _number),
        Function("text(x)", (("boolean", "number", "text"),), text_of, gives=_TEXT),
        Function("length(x)", (("text", "list", "map"),), len),
        Function("contains(x, y)", (("text", "list"), _ANY), _contains, gives=_BOOLEAN),
        Function("starts_with(x, y)", (_TEXT, _TEXT), str.startswith, gives=_BOOLEAN),
        Function("ends_with(x, y)", (_TEXT, _TEXT), str.endswith, gives=_BOOLEAN),
        Function("upper(x)", (_TEXT,), _upper, gives=_TEXT),
        Function("lower(x)", (_TEXT,), _lower, gives=_TEXT),
        Function("exists(x)", (_ANY,), lambda x: x is not None, gives=_BOOLEAN),
        Function("is_empty(x)", (_ANY,), lambda x: x is None or x in ("", [], {}), gives=_BOOLEAN),
        Function("sum(x)", (("list",),), _sum),
        Function("date(x)", (_TEXT,), _date),
        Function("duration(x)", (_TEXT,), _duration),
        Function("distance(a, b)", (("list",), ("list",)), _distance),
    )
}


def _xpath(
    signature: str,
    converts: tuple[Callable[[Computed], Computed], ...],
    compute: Callable[..., Computed],
    gives: tuple[str, ...] = _NUMBER,
    optional: int = 0,
) -> Function:
    """`converts`: what each argument is converted by."""
    takes = (_ANY,) * len(converts)
    made = xpath.converted(compute, *converts)
    return Function(signature, takes, made, gives=gives, optional=optional)


XPATH_FUNCTIONS: dict[str, Function] = {
    function.name: function
    for function in (
        Function("boolean(x)", (_ANY,), lambda x: xpath.truth(x, ""), gives=_BOOLEAN),
        Function("ceiling(x)", (_ANY,), xpath.whole(math.ceil)),
        Function("concat(x, y, ...)", (_ANY, _ANY), xpath.concat, rest=True, gives=_TEXT),
        _xpath("contains(x, y)", (xpath.string,) * 2, operator.contains, _BOOLEAN),
        Function("floor(x)", (_ANY,), xpath.whole(math.floor)),
        _xpath("normalize-space(x)", (xpath.string,), xpath.normalize_space, _TEXT),
        Function("number(x)", (_ANY,), xpath.number),
        Function("round(x)", (_ANY,), xpath.rounded),
        _xpath("starts-with(x, y)", (xpath.string,) * 2, str.startswith, _BOOLEAN),
        Function("string(x)", (_ANY,), xpath.string, gives=_TEXT),
        _xpath("string-length(x)", (xpath.string,), len),
        _xpath("substring(x, start, length)", (xpath.string, *(xpath.rounded,) * 2),
               xpath.substring, _TEXT, optional=1),
        _xpath("substring-after(x, y)", (xpath.string,) * 2, text_after, _TEXT),
        _xpath("substring-before(x, y)", (xpath.string,) * 2, text_before, _TEXT),
        _xpath("translate(x, y, z)", (xpath.string,) * 3, xpath.translate, _TEXT),
    )
}  # fmt: skip
"""XPath's own, which convert what they take (XPath 1.0, clause 4)."""

OWN: dict[str, dict[str, Function]] = {"XPATH": XPATH_FUNCTIONS}
"""Functions that one language has, or has otherwise, by how their names begin in a tree."""

LISTED: dict[str, Function | FeelFunction] = {
    **FUNCTIONS,
    **{f"XPATH {name}": each for name, each in XPATH_FUNCTIONS.items()},
    **{f"FEEL {name}": each for name, each in (FEEL_FUNCTIONS | ALTERNATIVES).items()},
}
"""All functions, by their names in a tree."""
