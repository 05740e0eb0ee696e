"""The functions of FEEL (DMN 1.5, clause 10.3.4), and those that Camunda adds.

An argument of a wrong kind has no value: the call is null. A list of one item is taken for the
item, and a value for a list of it, where the other is wanted (clause 10.3.2.9.4).
"""

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal, InvalidOperation, getcontext, setcontext

from m2pem.mission.expression import feel_library as lib
from m2pem.mission.expression import feel_values as v
from m2pem.mission.expression.feel_library import NoValueError
from m2pem.mission.expression.feel_values import DIGITS, FeelValue, number
from m2pem.mission.expression.operators import bounded_list, bounded_text, look_at
from m2pem.mission.expression.signatures import Function, Parameter
from m2pem.mission.expression.temporal import iso, read_duration


@dataclass(frozen=True, slots=True)
class FeelFunction(Function):
    """A function of FEEL. One that takes a list alone, which is `repeated`, takes its items as
    arguments as well."""

    _of_items: bool = field(init=False)
    _decimals: bool = field(init=False)

    def __post_init__(self) -> None:
        Function.__post_init__(self)
        taken = [each.kinds for each in self.parameters]
        of_items = self.repeated and taken == [("list",)]
        object.__setattr__(self, "_of_items", of_items)
        decimals = of_items or any("number" in each for each in taken)
        object.__setattr__(self, "_decimals", decimals)

    def fits(self, given: Sequence[frozenset[str]]) -> bool:
        """Whether arguments of some kinds can give a value, in one of the ways to call it."""
        return any(
            each._of_items
            or (each.accepts(len(given)) and all(map(_takes, each.parameters, given)))
            for each in self.ways
        )

    def call(self, arguments: Sequence[FeelValue]) -> FeelValue:
        """Return the value; null where there is none."""
        for each in self.ways:
            if each._fits(arguments):
                return each._call(arguments)
        v.without_value(f"{self.name}() of {len(arguments)} arguments")
        return None

    def _fits(self, arguments: Sequence[FeelValue]) -> bool:
        if not self.accepts(len(arguments)):
            return False
        if not self.others:
            return True
        return all(
            value is None or not each.kinds or v.kind(value) in each.kinds
            for each, value in zip(self.parameters, arguments, strict=False)
        )

    def of(self, count: int) -> Callable[[Sequence[FeelValue]], FeelValue]:
        """What calls it with so many arguments."""
        return self._call if self.accepts(count) and not self.others else self.call

    def _call(self, arguments: Sequence[FeelValue]) -> FeelValue:
        if self._of_items and (len(arguments) > 1 or type(arguments[0]) is not list):
            arguments = [[*arguments]]
        taken: list[FeelValue] = []
        parameters = self.parameters
        if self.repeated:
            parameters += parameters[-1:] * len(arguments)
        for each, value in zip(parameters, arguments, strict=False):
            kinds = each.kinds
            if value is None and kinds and not each.optional:
                return None
            fits = value is None or not kinds or v.kind(value) in kinds
            found = value if fits else _as_kind(value, kinds)
            if found is _WRONG:
                wanted = " or a ".join(kinds)
                v.without_value(f"{self.name}() takes a {wanted}, not {v.describe(value)}")
                return None
            if type(found) is list:
                look_at(len(found))
            taken.append(found)
        try:
            if not self._decimals:
                return _bounded(self.compute(*taken), self.name)
            outer = getcontext()
            setcontext(DIGITS)
            try:
                return _bounded(self.compute(*taken), self.name)
            finally:
                setcontext(outer)
        except NoValueError as error:
            v.without_value(f"{self.name}(): {error}")
        except (ArithmeticError, InvalidOperation, ValueError):
            shown = ", ".join(map(v.describe, arguments[:3]))
            v.without_value(f"{self.name}() of {shown}")
        return None


_WRONG = object()


def _bounded(value: FeelValue, name: str) -> FeelValue:
    """The value that a function made, when it is not too large."""
    if type(value) is str:
        return bounded_text(value, f"{name}()")
    return bounded_list([value])[0] if isinstance(value, list | dict) else value


def _as_kind(value: FeelValue, kinds: tuple[str, ...]) -> FeelValue:
    if "list" in kinds:
        return [value]
    if isinstance(value, list) and len(value) == 1 and v.kind(value[0]) in kinds:
        return value[0]
    return _WRONG


def _takes(parameter: Parameter, given: frozenset[str]) -> bool:
    known = {"context" if each == "map" else each for each in given}
    anything = not parameter.kinds or not given or "list" in {*parameter.kinds, *given}
    return anything or not known.isdisjoint(parameter.kinds)


# --- the table ------------------------------------------------------------------------------------

FEEL_FUNCTIONS = FeelFunction.table([
    ("@(text: text) -> date|date and time|time|duration", lib.literal, ""),
    ("date(from: text|date|date and time) -> date", lib.as_date, "a date, of its text or parts"),
    ("date(year: number, month: number, day: number)", lib.date_of, ""),
    ("date and time(from: text|date|date and time) -> date and time", lib.as_moment,
     "a date with a time, of its text or parts"),
    ("date and time(date: date|date and time, time: time)", lib.moment_of, ""),
    ("time(from: text|time|date|date and time) -> time", lib.as_time,
     "a time of day, of its text or parts"),
    ("time(hour: number, minute: number, second: number, offset?: days and time duration)",
     lib.time_of, ""),
    ("duration(from: text|duration) -> duration",
     lambda value: read_duration(value) if isinstance(value, str) else value,
     "a duration, of its text in ISO 8601"),
    ("years and months duration(from: date|date and time, to: date|date and time)"
     " -> years and months duration", lib.months_between, "the whole months between two dates"),
    ("number(from: text|number, grouping separator?: text, decimal separator?: text) -> number",
     lib.as_number, "the number that a text writes"),
    ("string(from) -> text", lib.as_text, "the value as a text"),
    ("range(from: text) -> range", lib.as_range, "a range, of its text: [1..5]"),
    ("substring(string: text, start position: number, length?: number) -> text", lib.substring,
     "the text from a position on; the first is 1, the last -1"),
    ("string length(string: text) -> number", len,
     "how many characters the text has"),
    ("upper case(string: text) -> text", str.upper, "the text in capital letters"),
    ("lower case(string: text) -> text", str.lower, "the text in small letters"),
    ("substring before(string: text, match: text) -> text", lib.text_before,
     "what is before the first match"),
    ("substring after(string: text, match: text) -> text", lib.text_after,
     "what follows the first match"),
    ("contains(string: text, match: text) -> boolean", lambda a, b: b in a,
     "whether the text has the match in it"),
    ("starts with(string: text, match: text) -> boolean", str.startswith,
     "whether the text begins with the match"),
    ("ends with(string: text, match: text) -> boolean", str.endswith,
     "whether the text ends with the match"),
    ("matches(input: text, pattern: text, flags?: text) -> boolean", lib.matches,
     "whether the regular expression fits a part of the text"),
    ("replace(input: text, pattern: text, replacement: text, flags?: text) -> text",
     lib.replaced_text, "the text, with what the regular expression fits replaced"),
    ("split(string: text, delimiter: text) -> list", lib.split_text,
     "the parts of the text between what the regular expression fits"),
    ("string join(list: list, delimiter?: text, prefix?: text, suffix?: text) -> text", lib.joined,
     "the texts of the list as one, with the delimiter between them"),
    ("trim(string: text) -> text", str.strip, "the text without spaces at its ends"),
    ("is blank(string: text) -> boolean", lambda text: not text.strip(),
     "whether the text has only spaces"),
    ("decimal(n: number, scale: number) -> number", lib.rounded("ROUND_HALF_EVEN"),
     "the number with so many decimals; a half goes to the even digit"),
    ("floor(n: number, scale?: number) -> number", lib.rounded("ROUND_FLOOR"),
     "the greatest number with so many decimals that is not above n"),
    ("ceiling(n: number, scale?: number) -> number", lib.rounded("ROUND_CEILING"),
     "the least number with so many decimals that is not below n"),
    ("round up(n: number, scale: number) -> number", lib.rounded("ROUND_UP"),
     "the number with so many decimals, away from zero"),
    ("round down(n: number, scale: number) -> number", lib.rounded("ROUND_DOWN"),
     "the number with so many decimals, towards zero"),
    ("round half up(n: number, scale: number) -> number", lib.rounded("ROUND_HALF_UP"),
     "the nearest number with so many decimals; a half goes away from zero"),
    ("round half down(n: number, scale: number) -> number", lib.rounded("ROUND_HALF_DOWN"),
     "the nearest number with so many decimals; a half goes towards zero"),
    ("abs(n: number|duration)", abs, "the number or duration without its sign"),
    ("modulo(dividend: number, divisor: number) -> number", lib.modulo,
     "the remainder, with the sign of the divisor"),
    ("sqrt(number: number) -> number", lib.root, "the square root"),
    ("log(number: number) -> number", lib.logarithm, "the natural logarithm"),
    ("exp(number: number) -> number", lambda n: number(n).exp(), "e to the power of the number"),
    ("odd(number: number) -> boolean", lib.parity(1), "whether the integer is odd"),
    ("even(number: number) -> boolean", lib.parity(0), "whether the integer is even"),
    ("list contains(list: list, element) -> boolean",
     lambda values, item: any(v.kind(each) == v.kind(item) and v.equal(each, item)
                              for each in values),
     "whether an item equals the element"),
    ("count(list: list) -> number", len,
     "how many items the list has"),
    ("min(list: list, ...)", lib.extreme(-1), "the least item"),
    ("max(list: list, ...)", lib.extreme(1), "the greatest item"),
    ("sum(list: list, ...) -> number", lib.total,
     "the sum of the numbers"),
    ("product(list: list, ...) -> number", lib.of_numbers(lambda n: math.prod(n, start=Decimal(1))),
     "the product of the numbers"),
    ("mean(list: list, ...) -> number", lib.of_numbers(lambda n: sum(n, Decimal()) / len(n)),
     "the arithmetic mean of the numbers"),
    ("median(list: list, ...) -> number", lib.of_numbers(statistics.median),
     "the middle one of the numbers"),
    ("stddev(list: list, ...) -> number", lib.of_numbers(statistics.stdev),
     "the sample standard deviation of the numbers"),
    ("mode(list: list, ...) -> list",
     lambda values: sorted(statistics.multimode(lib.numbers(values))),
     "the numbers that are most frequent"),
    ("all(list: list, ...) -> boolean", lib.truths(False), "whether all items are true"),
    ("any(list: list, ...) -> boolean", lib.truths(True), "whether an item is true"),
    ("sublist(list: list, start position: number, length?: number) -> list", lib.sublist,
     "the items from a position on; the first is 1, the last -1"),
    ("append(list: list, item, ...) -> list", lambda a, *b: [*a, *b],
     "the list with the items at its end"),
    ("concatenate(list, ...) -> list", lib.concatenated, "the items of all lists"),
    ("insert before(list: list, position: number, newItem) -> list", lib.inserted,
     "the list with an item before the position"),
    ("remove(list: list, position: number) -> list", lib.removed,
     "the list without the item at the position"),
    ("list replace(list: list, position: number, newItem) -> list", lib.replaced,
     "the list with another item at the position, or where the function is true"),
    ("list replace(list: list, match: function, newItem)", lib.replaced, ""),
    ("reverse(list: list) -> list", lambda values: values[::-1], "the list from its end"),
    ("index of(list: list, match) -> list", lib.indices,
     "the positions of the items that equal the match"),
    ("union(list, ...) -> list", lambda *lists: lib.distinct(lib.concatenated(*lists)),
     "the items of all lists, each once"),
    ("distinct values(list: list) -> list", lib.distinct, "the items, each once"),
    ("duplicate values(list: list) -> list", lib.doubled, "the items that are there several times"),
    ("flatten(list: list) -> list", lib.flat,
     "the items, with those of inner lists in place of these"),
    ("sort(list: list, precedes?: function) -> list", lib.in_order,
     "the items in order; precedes: whether one is before another"),
    ("partition(list: list, size: number) -> list", lib.partition, "the items in lists of so many"),
    ("is empty(list) -> boolean", lib.is_empty, "whether the list has no items"),
    ("get value(m: context, key: text|list)", lib.get_value, "the value of a key of the context"),
    ("get entries(m: context) -> list", lib.entries_of, "a list of the context's keys and values"),
    ("context(entries: list) -> context", lib.context_of,
     "a context, of a list of keys and values"),
    ("context put(context: context, key: text, value) -> context", lib.put,
     "the context with another value of a key, or of a path of keys"),
    ("context put(context: context, keys: list, value)", lib.put, ""),
    ("context merge(contexts: list) -> context", lib.merged,
     "the entries of all contexts; of equal keys, the last"),
    ("day of week(date: date|date and time) -> text", lambda day: lib.WEEKDAYS[day.weekday()],
     "the name of the weekday"),
    ("day of year(date: date|date and time) -> number",
     lambda day: day.timetuple().tm_yday, "the number of the day in its year"),
    ("week of year(date: date|date and time) -> number", lambda day: day.isocalendar()[1],
     "the number of the week, by ISO 8601"),
    ("month of year(date: date|date and time) -> text", lambda day: lib.MONTHS[day.month - 1],
     "the name of the month"),
    ("last day of month(date: date|date and time) -> date",
     lambda day: lib.last_day(lib.as_date(day)), "the last day of the date's month"),
    ("is(value1, value2?) -> boolean", lib.is_same,
     "whether both are the same, and of the same kind"),
    ("is defined(value) -> boolean", lambda value: value is not None,
     "whether the value is not null"),
    ("get or else(value, default)", lambda a, b: b if a is None else a,
     "the value, or the default if it is null"),
    ("assert(value, condition: boolean, cause?: text)", lib.asserted,
     "the value; an error if the condition is not true"),
    ("cycle(duration: duration) -> text", lambda each: f"R/{iso(each)}",
     "a timer's cycle, in ISO 8601"),
    ("cycle(repetitions: number, duration: duration)",
     lambda count, each: f"R{lib.whole(count)}/{iso(each)}", ""),
    *(
        (f"{name}(range1, range2) -> boolean", lib.relation(compute),
         f"whether range1 {name} range2 (points, or ranges)")
        for name, compute in lib.RELATIONS.items()
    ),
])  # fmt: skip


ALTERNATIVES = {
    f"{name}/{number}": replace(each, others=())
    for name, function in FEEL_FUNCTIONS.items()
    for number, each in enumerate(function.ways if function.others else ())
}
"""The ways to call a function: the names of arguments tell which one is meant."""
