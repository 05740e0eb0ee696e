"""What the functions of FEEL compute (DMN 1.5, clause 10.3.4); `feel_functions` lists them.

Each raises NoValueError, ValueError or ArithmeticError where there is no value.
"""

import re
from calendar import monthrange
from collections.abc import Callable
from datetime import date, datetime, time, timedelta
from decimal import ROUND_FLOOR, Decimal, localcontext
from functools import cmp_to_key, lru_cache
from typing import Any

from m2pem.mission.expression import feel_values as v
from m2pem.mission.expression.feel_values import DIGITS, Closure, FeelValue, Range, number
from m2pem.mission.expression.literals import MAX_INTEGER, MIN_INTEGER
from m2pem.mission.expression.operators import MAX_SIZE, MAX_VALUE_DEPTH, look_at
from m2pem.mission.expression.temporal import (
    Months,
    iso,
    offset_zone,
    read_date,
    read_duration,
    read_moment,
    read_time,
)
from m2pem.mission.expression.tree import Comparison

_SCALES = -6111, 6176
_SIMPLE = frozenset({int, float, str})
_below = v.COMPARISONS[Comparison.LESS]


class NoValueError(Exception):
    """The function has no value for its arguments; the message says why."""


def whole(value: FeelValue) -> int:
    found = number(value)
    if found != found.to_integral_value():
        raise NoValueError(f"{v.describe(value)} is not whole")
    return int(found)


# --- conversion -----------------------------------------------------------------------------------


def as_date(value: FeelValue) -> date:
    if isinstance(value, str):
        return read_date(value)
    return value.date() if isinstance(value, datetime) else value


def date_of(year: FeelValue, month: FeelValue, day: FeelValue) -> date:
    return date(whole(year), whole(month), whole(day))


def as_moment(value: FeelValue) -> datetime:
    if isinstance(value, str):
        return read_moment(value)
    return value if isinstance(value, datetime) else datetime.combine(value, time())


def moment_of(day: FeelValue, clock: time) -> datetime:
    return datetime.combine(as_date(day), clock)


def as_time(value: FeelValue) -> time:
    if isinstance(value, str):
        return read_time(value)
    if isinstance(value, datetime):
        return value.timetz()
    return value if isinstance(value, time) else time(tzinfo=offset_zone(timedelta()))


def time_of(
    hour: FeelValue, minute: FeelValue, second: FeelValue, offset: timedelta | None = None
) -> time:
    seconds, part = divmod(number(second), 1)
    zone = None if offset is None else offset_zone(offset)
    return time(whole(hour), whole(minute), int(seconds), int(part * 1_000_000), zone)


def months_between(begin: FeelValue, end: FeelValue) -> Months:
    first, last = as_moment(begin), as_moment(end)
    if first.tzinfo is None or last.tzinfo is None:
        first, last = first.replace(tzinfo=None), last.replace(tzinfo=None)
    if first > last:
        return Months(-months_between(end, begin).months)
    months = (last.year - first.year) * 12 + last.month - first.month
    return Months(months - (last.day < first.day))


def as_number(text: FeelValue, grouping: FeelValue = None, point: FeelValue = None) -> Decimal:
    if not isinstance(text, str) and grouping is None and point is None:
        return number(text)
    if grouping not in (None, " ", ",", ".") or point not in (None, ",", "."):
        raise NoValueError("separators are ' ', ',' and '.'")
    if grouping is not None and grouping == point:
        raise NoValueError("both separators are the same")
    if not isinstance(text, str):
        raise NoValueError("separators are of a text")
    written = text.replace(grouping, "") if grouping else text
    if point and point != ".":
        written = written.replace(point, ".")
    if not re.fullmatch(r"-?(?:[0-9]+(?:\.[0-9]+)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?", written):
        raise NoValueError(f"{v.describe(text)} is no number")
    return DIGITS.create_decimal(written)


def as_text(value: FeelValue) -> str | None:
    return None if value is None else v.text(value)


def literal(text: str) -> FeelValue:
    """What `@"..."` and the ends of a range are."""
    for read in (read_date, read_moment, read_time, read_duration):
        try:
            return read(text)
        except ValueError:
            continue
    raise NoValueError(f"'{text}' is no date, time or duration")


_END = r'(-?[0-9.]+|"(?:[^"\\]|\\.)*"|@"[^"]*"|[a-z ]+\("[^"]*"\))'
_RANGE = re.compile(rf"\s*([\[\](])\s*{_END}?\s*\.\.\s*{_END}?\s*([\[\])])\s*")


def as_range(text: str) -> Range:
    found = _RANGE.fullmatch(text)
    if found is None:
        raise NoValueError(f"{v.describe(text)} is no range")
    low, high = (None if each is None else _end(each) for each in (found[2], found[3]))
    included = found[1] == "[", found[4] == "]"
    if (low is None and (high is None or included[0])) or (high is None and included[1]):
        raise NoValueError("a range without an end does not include it")
    both = low is not None and high is not None
    if both and not (
        v.kind(low) == v.kind(high) and v.COMPARISONS[Comparison.LESS_EQUAL](low, high)
    ):
        raise NoValueError("its ends are in no order")
    return Range(low, high, *included, open_low=low is None, open_high=high is None)


_CALLED: dict[str, Callable[[str], FeelValue]] = {
    "date": read_date,
    "time": read_time,
    "date and time": read_moment,
    "duration": read_duration,
}


def _end(text: str) -> FeelValue:
    if text.startswith('"'):
        return text[1:-1]
    if text.startswith("@"):
        return literal(text[2:-1])
    if "(" in text:
        name, _, value = text.partition("(")
        return _CALLED[name.strip()](value[1:-2])
    return as_number(text)


# --- texts ----------------------------------------------------------------------------------------


def substring(text: str, start: FeelValue, length: FeelValue = None) -> str | None:
    first = whole(start)
    if first == 0 or abs(first) > len(text):
        raise NoValueError(f"there is no character {first}")
    begin = first - 1 if first > 0 else len(text) + first
    if length is None:
        return text[begin:]
    size = int(number(length))
    if size < 1:
        raise NoValueError("a length is 1 at least")
    return text[begin : begin + size]


def text_before(text: str, mark: str) -> str:
    return text.partition(mark)[0] if mark and mark in text else ""


def text_after(text: str, mark: str) -> str:
    return text.partition(mark)[2] if mark else text


_FLAGS = frozenset("smixq")


@lru_cache(maxsize=256)
def _pattern(pattern: str, flags: str | None) -> Any:
    """A pattern of XPath as RE2 has it: it takes time in proportion to the text."""
    import re2  # noqa: PLC0415  # most missions need none

    given = flags or ""
    if not _FLAGS.issuperset(given):
        raise NoValueError(f"there is no flag in '{given}' but s, m, i, x and q")
    if "q" in given:
        return re2.compile(re2.escape(pattern))
    if re.search(r"(?<!\\)(?:\\\\)*\\[0-9]", pattern):
        raise NoValueError(f"the pattern '{pattern[:40]}' refers to a group, which RE2 cannot")
    if "s" not in given:
        pattern = re.sub(r"((?<!\\)(?:\\\\)*)\.(?![^\[]*\])", r"\1[^\\n\\r]", pattern)
    if "x" in given:
        pattern = re.sub(r"\s+(?![^\[]*\])", "", pattern)
    pattern = re.sub(r"\[([^\[\]]*)-\[([^\[\]]*)\]\]", _without, pattern)
    pattern = pattern.replace(r"\p{IsBasicLatin}", r"[\x00-\x7f]").replace(r"\i", "[A-Za-z_:]")
    options = "".join(each for each in "smi" if each in given)
    silent = re2.Options()
    silent.log_errors = False
    try:
        return re2.compile(f"(?{options}){pattern}" if options else pattern, silent)
    except re2.error as error:
        raise NoValueError(f"the pattern '{pattern[:40]}': {error}") from None


def _without(found: re.Match[str]) -> str:
    """A class of characters without some: those of ASCII that are left."""
    kept, removed = (re.compile(f"[{each}]") for each in (found[1], found[2]))
    chosen = (chr(each) for each in range(128))
    return (
        "["
        + "".join(map(re.escape, (c for c in chosen if kept.match(c) and not removed.match(c))))
        + "]"
    )


def matches(text: str, pattern: str, flags: str | None = None) -> bool:
    return _pattern(pattern, flags).search(text) is not None


def replaced_text(text: str, pattern: str, replacement: str, flags: str | None = None) -> str:
    if re.search(r"\\(?![\\$])", replacement) or re.search(r"(?<!\\)\$(?![0-9])", replacement):
        raise NoValueError(f"the replacement {v.describe(replacement)} has a $ or \\ by itself")
    found = _pattern(pattern, flags)
    if found.search("") is not None and "q" not in (flags or ""):
        raise NoValueError("the pattern matches an empty text")
    groups = found.groups

    def replaced(match: Any) -> str:
        def group(reference: re.Match[str]) -> str:
            if reference[0].startswith("\\"):
                return reference[0][1]
            digits = reference[1]
            while len(digits) > 1 and int(digits) > groups:
                digits = digits[:-1]
            rest = reference[1][len(digits) :]
            return ((match.group(int(digits)) or "") if int(digits) <= groups else "") + rest

        return re.sub(r"\\.|\$([0-9]+)", group, replacement)

    parts, last, size = list[str](), 0, 0
    for match in found.finditer(text):
        parts += [text[last : match.start()], replaced(match)]
        last, size = match.end(), size + len(parts[-1])
        if size > MAX_SIZE:
            raise NoValueError(f"the result is longer than {MAX_SIZE} characters")
    return "".join([*parts, text[last:]])


def split_text(text: str, delimiter: str) -> list[FeelValue]:
    found, last = list[FeelValue](), 0
    for match in _pattern(delimiter, None).finditer(text):
        if match.end() > match.start():
            found.append(text[last : match.start()])
            last = match.end()
    return [*found, text[last:]]


def joined(
    values: list[FeelValue], delimiter: str | None = None, prefix: str | None = None,
    suffix: str | None = None,
) -> str:  # fmt: skip
    texts = [each for each in values if each is not None]
    if not all(isinstance(each, str) for each in texts):
        raise NoValueError("not all items are texts")
    return (prefix or "") + (delimiter or "").join(texts) + (suffix or "")


# --- numbers --------------------------------------------------------------------------------------


def rounded(how: str) -> Callable[..., Decimal | None]:
    def compute(value: FeelValue, scale: FeelValue = 0) -> Decimal | None:
        if scale is None:
            return None
        places = scale if type(scale) is int else int(number(scale))
        if not _SCALES[0] <= places <= _SCALES[1]:
            raise NoValueError(f"a scale is {_SCALES[0]} to {_SCALES[1]}")
        found = number(value)
        if not places:
            return found.to_integral_value(how)
        if -found.as_tuple().exponent <= places:  # type: ignore[operator]
            return found
        with localcontext(DIGITS) as context:
            context.prec = 7000
            return +found.quantize(Decimal(1).scaleb(-places), rounding=how)

    return compute


def modulo(value: FeelValue, by: FeelValue) -> Decimal:
    one, other = number(value), number(by)
    return one - other * (one / other).to_integral_value(ROUND_FLOOR)


def parity(rest: int) -> Callable[[FeelValue], bool]:
    return lambda value: number(value) % 2 in (rest, -rest)


def logarithm(value: FeelValue) -> Decimal:
    if number(value) <= 0:
        raise NoValueError("a logarithm is of a number above 0")
    return number(value).ln()


def root(value: FeelValue) -> Decimal:
    if number(value) < 0:
        raise NoValueError("a root is of a number from 0 on")
    return number(value).sqrt()


# --- lists ----------------------------------------------------------------------------------------


def numbers(values: list[FeelValue]) -> list[Decimal]:
    if not v.NUMBERS.issuperset(map(type, values)):
        raise NoValueError("not all items are numbers")
    return [number(each) for each in values]


def extreme(sign: int) -> Callable[[list[FeelValue]], FeelValue]:
    def compute(values: list[FeelValue]) -> FeelValue:
        if not values:
            return None
        best = values[0]
        if type(best) in _SIMPLE and all(type(each) is type(best) for each in values):
            return min(values) if sign < 0 else max(values)
        for each in values:
            lower = _below(*((each, best) if sign < 0 else (best, each)))
            if lower is None:
                raise NoValueError("not all items can be compared")
            best = each if lower else best
        return best

    return compute


def of_numbers(compute: Callable[[list[Decimal]], FeelValue]) -> Callable[..., FeelValue]:
    def of(values: list[FeelValue]) -> FeelValue:
        found = numbers(values)
        return compute(found) if found else None

    return of


def total(values: list[FeelValue]) -> int | Decimal | None:
    if {*map(type, values)} == {int} and MIN_INTEGER <= (found := sum(values)) <= MAX_INTEGER:
        return found
    return sum(numbers(values), Decimal()) if values else None


def truths(decisive: bool) -> Callable[[list[FeelValue]], bool | None]:
    def compute(values: list[FeelValue]) -> bool | None:
        if decisive in [each for each in values if isinstance(each, bool)]:
            return decisive
        if not all(each is None or isinstance(each, bool) for each in values):
            raise NoValueError("not all items are true or false")
        return None if None in values else not decisive

    return compute


def _place(values: list[FeelValue], position: FeelValue, most: int) -> int:
    place = whole(position)
    if place == 0 or place > most or -place > len(values):
        raise NoValueError(f"there is no item {place}")
    return place - 1 if place > 0 else len(values) + place


def sublist(values: list[FeelValue], start: FeelValue, length: FeelValue = None) -> list[FeelValue]:
    first = _place(values, start, len(values))
    if length is None:
        return values[first:]
    size = whole(length)
    if size < 1 or first + size > len(values):
        raise NoValueError(f"there are no {size} items from there")
    return values[first : first + size]


def inserted(values: list[FeelValue], position: FeelValue, item: FeelValue) -> list[FeelValue]:
    place = _place(values, position, len(values) + 1)
    return [*values[:place], item, *values[place:]]


def removed(values: list[FeelValue], position: FeelValue) -> list[FeelValue]:
    place = _place(values, position, len(values))
    return [*values[:place], *values[place + 1 :]]


def replaced(values: list[FeelValue], position: FeelValue, item: FeelValue) -> list[FeelValue]:
    if isinstance(position, Closure):
        if len(position.parameters) != 2:
            raise NoValueError("match takes a function of an item and the new one")
        chosen = [position.call(position, [each, item]) for each in values]
        if not all(isinstance(each, bool) for each in chosen):
            raise NoValueError("match does not give true or false")
        return [item if is_new else each for each, is_new in zip(values, chosen, strict=True)]
    place = _place(values, Decimal(int(number(position))), len(values))
    return [*values[:place], item, *values[place + 1 :]]


def indices(values: list[FeelValue], wanted: FeelValue) -> list[FeelValue]:
    look_at(len(values) // 10)
    return [Decimal(n) for n, each in enumerate(values, 1) if v.equal(each, wanted)]


def distinct(values: list[FeelValue]) -> list[FeelValue]:
    found = list[FeelValue]()
    for each in values:
        look_at(len(found) // 10)
        if not any(v.kind(each) == v.kind(known) and v.equal(each, known) for known in found):
            found.append(each)
    return found


def doubled(values: list[FeelValue]) -> list[FeelValue]:
    return [each for each in distinct(values) if len(indices(values, each)) > 1]


def concatenated(*lists: FeelValue) -> list[FeelValue]:
    parts = (each if isinstance(each, list) else [each] for each in lists)
    return [item for part in parts for item in part]


def flat(values: list[FeelValue]) -> list[FeelValue]:
    found = list[FeelValue]()
    for each in values:
        found += flat(each) if isinstance(each, list) else [each]
    return found


def in_order(values: list[FeelValue], precedes: FeelValue = None) -> list[FeelValue]:
    def compare(a: FeelValue, b: FeelValue) -> int:
        look_at(1)
        given = isinstance(precedes, Closure)
        first = precedes.call(precedes, [a, b]) if given else _below(a, b)
        if first is None:
            raise NoValueError("not all items can be compared")
        return -1 if first else 1

    return sorted(values, key=cmp_to_key(compare))


def partition(values: list[FeelValue], size: FeelValue) -> list[FeelValue]:
    count = whole(size)
    if count < 1:
        raise NoValueError("a size is 1 at least")
    return [values[n : n + count] for n in range(0, len(values), count)]


def is_empty(value: FeelValue) -> bool:
    return value is None or value in ([], {}, "")


# --- contexts -------------------------------------------------------------------------------------


def get_value(context: dict[str, FeelValue], key: FeelValue) -> FeelValue:
    for each in key if isinstance(key, list) else [key]:
        context = context.get(each) if isinstance(context, dict) else None  # type: ignore[assignment]
    return context


def entries_of(context: dict[str, FeelValue]) -> list[FeelValue]:
    return [{"key": key, "value": value} for key, value in context.items()]


def context_of(entries: list[FeelValue]) -> dict[str, FeelValue]:
    found = dict[str, FeelValue]()
    for each in entries:
        if not isinstance(each, dict) or not {"key", "value"} <= each.keys():
            raise NoValueError("an entry has a key and a value")
        if not isinstance(each["key"], str) or each["key"] in found:
            raise NoValueError("a key is a text, and there once")
        found[each["key"]] = each["value"]
    return found


def put(context: dict[str, FeelValue], key: FeelValue, value: FeelValue) -> dict[str, FeelValue]:
    keys = key if isinstance(key, list) else [key]
    if not 0 < len(keys) <= MAX_VALUE_DEPTH or not all(isinstance(each, str) for each in keys):
        raise NoValueError(f"keys are texts, {MAX_VALUE_DEPTH} at most")
    head, *rest = keys
    inner = context.get(head)
    if rest and inner is not None and not isinstance(inner, dict):
        raise NoValueError(f"'{head}' is no context")
    return {**context, head: put(inner or {}, rest, value) if rest else value}


def merged(contexts: list[FeelValue]) -> dict[str, FeelValue]:
    if not all(isinstance(each, dict) for each in contexts):
        raise NoValueError("not all items are contexts")
    return {key: value for each in contexts for key, value in each.items()}


# --- dates and ranges -----------------------------------------------------------------------------

WEEKDAYS = ("Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday", "Sunday")
MONTHS = ("January", "February", "March", "April", "May", "June", "July", "August", "September",
           "October", "November", "December")  # fmt: skip


def is_same(one: FeelValue, other: FeelValue = None) -> bool:
    if v.kind(one) != v.kind(other):
        return False
    if isinstance(one, datetime | time):
        return iso(one) == iso(other)
    return bool(v.equal(one, other))


def last_day(value: date) -> date:
    return value.replace(day=monthrange(value.year, value.month)[1])


def _as_span(value: FeelValue) -> Range:
    return value if isinstance(value, Range) else Range(value, value, True, True)


def _order(a: FeelValue, b: FeelValue) -> int:
    """-1, 0 or 1: which of two values is the smaller one."""
    below, same = _below(a, b), v.equal(a, b)
    if below is None or same is None:
        raise NoValueError("the values cannot be compared")
    return 0 if same else -1 if below else 1


def relation(compute: Callable[[Range, Range], bool]) -> Callable[..., bool]:
    return lambda one, other: compute(_as_span(one), _as_span(other))


def _starts_after(a: Range, b: Range) -> bool:
    """Whether all of `a` is above all of `b`."""
    order = _order(a.low, b.high)
    return order > 0 or (order == 0 and not (a.low_included and b.high_included))


def _low(a: Range, b: Range) -> int:
    """Which one begins first."""
    return _order(a.low, b.low) or (b.low_included - a.low_included)


def _high(a: Range, b: Range) -> int:
    """Which one ends first."""
    return _order(a.high, b.high) or (a.high_included - b.high_included)


def _meets(a: Range, b: Range) -> bool:
    return a.high_included and b.low_included and _order(a.high, b.low) == 0


def _overlaps(a: Range, b: Range) -> bool:
    return not _starts_after(a, b) and not _starts_after(b, a)


def _includes(a: Range, b: Range) -> bool:
    return _low(a, b) <= 0 <= _high(a, b)


RELATIONS: dict[str, Callable[[Range, Range], bool]] = {
    "before": lambda a, b: _starts_after(b, a),
    "after": _starts_after,
    "meets": _meets,
    "met by": lambda a, b: _meets(b, a),
    "overlaps": _overlaps,
    "overlaps before": lambda a, b: _overlaps(a, b) and _low(a, b) < 0 and _high(a, b) <= 0,
    "overlaps after": lambda a, b: _overlaps(a, b) and _low(a, b) >= 0 and _high(a, b) > 0,
    "finishes": lambda a, b: _high(a, b) == 0 and _low(a, b) >= 0,
    "finished by": lambda a, b: _high(a, b) == 0 and _low(a, b) <= 0,
    "includes": _includes,
    "during": lambda a, b: _includes(b, a),
    "starts": lambda a, b: _low(a, b) == 0 and _high(a, b) <= 0,
    "started by": lambda a, b: _low(a, b) == 0 and _high(a, b) >= 0,
    "coincides": lambda a, b: _low(a, b) == 0 == _high(a, b),
}


def asserted(value: FeelValue, condition: bool, why: str | None = None) -> FeelValue:
    if condition:
        return value
    raise NoValueError(why or "the condition is not fulfilled")
