"""The functions of FEEL (DMN 1.5, clause 10.3.4), and those that Camunda adds.

An argument of a wrong kind has no value: the call is null. A list of one item is taken for the
item, and a value for a list of it, where the other is wanted (clause 10.3.2.9.4).
"""

import math
import re
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from decimal import (
    ROUND_CEILING,
    ROUND_DOWN,
    ROUND_FLOOR,
    ROUND_HALF_DOWN,
    ROUND_HALF_EVEN,
    ROUND_HALF_UP,
    ROUND_UP,
    Decimal,
    InvalidOperation,
    localcontext,
)

from m2pem.mission.expression import feel_library as lib
from m2pem.mission.expression import feel_values as v
from m2pem.mission.expression.feel_library import NoValueError
from m2pem.mission.expression.feel_values import DIGITS, FeelValue, number
from m2pem.mission.expression.operators import bounded_list, bounded_text, look_at
from m2pem.mission.expression.temporal import (
    DATE,
    DAYS,
    MOMENT,
    MONTHS,
    TIME,
    iso,
    read_duration,
)

NUMBER, TEXT, BOOLEAN, LIST, CONTEXT = ("number",), ("text",), ("boolean",), ("list",), ("context",)
ANY: tuple[str, ...] = ()
"""Kinds that a parameter takes; none: all, null too."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter: its name, the kinds it takes, and whether it may be left out or be null."""

    name: str
    kinds: tuple[str, ...] = ANY
    optional: bool = False


@dataclass(frozen=True, slots=True)
class FeelFunction:
    """A function of FEEL. `rest`: the list may be written as the arguments themselves. `more`: the
    last parameter may be there several times. `others`: other ways to call it. `gives`: the kinds
    of its values besides null; none: any. `decimals`: it computes with numbers."""

    name: str
    parameters: tuple[Parameter, ...]
    compute: Callable[..., FeelValue]
    rest: bool = False
    gives: tuple[str, ...] = ()
    others: tuple["FeelFunction", ...] = ()
    more: bool = False
    decimals: bool = False
    _least: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_least", sum(not each.optional for each in self.parameters))

    def call(self, arguments: Sequence[FeelValue]) -> FeelValue:
        """Return the value; null where there is none."""
        for each in (self, *self.others):
            if each._fits(arguments):
                return each._call(arguments)
        v.without_value(f"{self.name}() of {len(arguments)} arguments")
        return None

    def accepts(self, count: int) -> bool:
        """Whether it may be called so with so many arguments."""
        return count >= self._least and (count <= len(self.parameters) or self.rest or self.more)

    def _fits(self, arguments: Sequence[FeelValue]) -> bool:
        if not self.accepts(len(arguments)):
            return False
        if not self.others:
            return True
        return all(
            value is None or not each.kinds or v.kind(value) in each.kinds
            for each, value in zip(self.parameters, arguments, strict=False)
        )

    def _call(self, arguments: Sequence[FeelValue]) -> FeelValue:
        if self.rest and (len(arguments) > 1 or not isinstance(arguments[0], list)):
            arguments = [[*arguments]]
        taken = list[FeelValue]()
        parameters = self.parameters
        if self.more:
            parameters += parameters[-1:] * len(arguments)
        for each, value in zip(parameters, arguments, strict=False):
            if value is None and each.kinds and not each.optional:
                return None
            found = _as_kind(value, each.kinds)
            if found is _WRONG:
                wanted = " or a ".join(each.kinds)
                v.without_value(f"{self.name}() takes a {wanted}, not {v.describe(value)}")
                return None
            if isinstance(found, list):
                look_at(len(found))
            taken.append(found)
        try:
            if not self.decimals:
                return _bounded(self.compute(*taken), self.name)
            with localcontext(DIGITS):
                return _bounded(self.compute(*taken), self.name)
        except NoValueError as error:
            v.without_value(f"{self.name}(): {error}")
        except (ArithmeticError, InvalidOperation, ValueError):
            shown = ", ".join(map(v.describe, arguments[:3]))
            v.without_value(f"{self.name}() of {shown}")
        return None


_WRONG = object()


def _bounded(value: FeelValue, name: str) -> FeelValue:
    """The value that a function made, when it is not too large."""
    if isinstance(value, list | dict):
        return bounded_list([value])[0]
    return bounded_text(value, f"{name}()") if isinstance(value, str) else value


def _as_kind(value: FeelValue, kinds: tuple[str, ...]) -> FeelValue:
    if value is None or not kinds or v.kind(value) in kinds:
        return value
    if "list" in kinds:
        return [value]
    if isinstance(value, list) and len(value) == 1 and v.kind(value[0]) in kinds:
        return value[0]
    return _WRONG


# --- the table ------------------------------------------------------------------------------------


def _function(
    name: str,
    parameters: str,
    kinds: Sequence[tuple[str, ...]],
    compute: Callable[..., FeelValue],
    gives: tuple[str, ...] = (),
    *others: FeelFunction,
    rest: bool = False,
    more: bool = False,
) -> FeelFunction:
    """`parameters`: their names, separated by commas, with a ? after those that are optional."""
    names = [each.strip() for each in parameters.split(",")] if parameters else []
    taken = tuple(
        Parameter(each.rstrip("?"), of, each.endswith("?"))
        for each, of in zip(names, kinds, strict=True)
    )
    decimals = rest or "number" in {*gives, *(kind for each in kinds for kind in each)}
    return FeelFunction(name, taken, compute, rest, gives, others, more, decimals)


_WHEN = (DATE, MOMENT)
_f = _function

FEEL_FUNCTIONS: dict[str, FeelFunction] = {
    each.name: each
    for each in (
        _f("@", "text", [TEXT], lib.literal, (DATE, MOMENT, TIME, DAYS, MONTHS)),
        _f("date", "from", [("text", DATE, MOMENT)], lib.as_date, (DATE,),
           _f("date", "year,month,day", [NUMBER] * 3, lib.date_of)),
        _f("date and time", "from", [("text", DATE, MOMENT)], lib.as_moment, (MOMENT,),
           _f("date and time", "date,time", [_WHEN, (TIME,)], lib.moment_of)),
        _f("time", "from", [("text", TIME, *_WHEN)], lib.as_time, (TIME,),
           _f("time", "hour,minute,second,offset?", [*[NUMBER] * 3, (DAYS,)], lib.time_of)),
        _f("duration", "from", [("text", DAYS, MONTHS)],
           lambda value: read_duration(value) if isinstance(value, str) else value, (DAYS, MONTHS)),
        _f("years and months duration", "from,to", [_WHEN, _WHEN], lib.months_between, (MONTHS,)),
        _f("number", "from,grouping separator?,decimal separator?",
           [("text", "number"), TEXT, TEXT], lib.as_number, NUMBER),
        _f("string", "from", [ANY], lib.as_text, TEXT),
        _f("range", "from", [TEXT], lib.as_range, ("range",)),
        _f("substring", "string,start position,length?", [TEXT, NUMBER, NUMBER], lib.substring,
           TEXT),
        _f("string length", "string", [TEXT], lambda text: Decimal(len(text)), NUMBER),
        _f("upper case", "string", [TEXT], str.upper, TEXT),
        _f("lower case", "string", [TEXT], str.lower, TEXT),
        _f("substring before", "string,match", [TEXT, TEXT], lib.text_before, TEXT),
        _f("substring after", "string,match", [TEXT, TEXT], lib.text_after, TEXT),
        _f("contains", "string,match", [TEXT, TEXT], lambda a, b: b in a, BOOLEAN),
        _f("starts with", "string,match", [TEXT, TEXT], str.startswith, BOOLEAN),
        _f("ends with", "string,match", [TEXT, TEXT], str.endswith, BOOLEAN),
        _f("matches", "input,pattern,flags?", [TEXT] * 3, lib.matches, BOOLEAN),
        _f("replace", "input,pattern,replacement,flags?", [TEXT] * 4, lib.replaced_text, TEXT),
        _f("split", "string,delimiter", [TEXT, TEXT], lib.split_text, LIST),
        _f("string join", "list,delimiter?,prefix?,suffix?", [LIST, TEXT, TEXT, TEXT], lib.joined,
           TEXT),
        _f("trim", "string", [TEXT], str.strip, TEXT),
        _f("is blank", "string", [TEXT], lambda text: not text.strip(), BOOLEAN),
        _f("decimal", "n,scale", [NUMBER, NUMBER], lib.rounded(ROUND_HALF_EVEN), NUMBER),
        _f("floor", "n,scale?", [NUMBER, NUMBER], lib.rounded(ROUND_FLOOR), NUMBER),
        _f("ceiling", "n,scale?", [NUMBER, NUMBER], lib.rounded(ROUND_CEILING), NUMBER),
        _f("round up", "n,scale", [NUMBER, NUMBER], lib.rounded(ROUND_UP), NUMBER),
        _f("round down", "n,scale", [NUMBER, NUMBER], lib.rounded(ROUND_DOWN), NUMBER),
        _f("round half up", "n,scale", [NUMBER, NUMBER], lib.rounded(ROUND_HALF_UP), NUMBER),
        _f("round half down", "n,scale", [NUMBER, NUMBER], lib.rounded(ROUND_HALF_DOWN), NUMBER),
        _f("abs", "n", [("number", DAYS, MONTHS)], abs),
        _f("modulo", "dividend,divisor", [NUMBER, NUMBER], lib.modulo, NUMBER),
        _f("sqrt", "number", [NUMBER], lib.root, NUMBER),
        _f("log", "number", [NUMBER], lib.logarithm, NUMBER),
        _f("exp", "number", [NUMBER], lambda n: number(n).exp(), NUMBER),
        _f("odd", "number", [NUMBER], lib.parity(1), BOOLEAN),
        _f("even", "number", [NUMBER], lib.parity(0), BOOLEAN),
        _f("list contains", "list,element", [LIST, ANY],
           lambda values, item: any(v.kind(each) == v.kind(item) and bool(v.equal(each, item))
                                    for each in values), BOOLEAN),
        _f("count", "list", [LIST], lambda values: Decimal(len(values)), NUMBER),
        _f("min", "list", [LIST], lib.extreme(-1), rest=True),
        _f("max", "list", [LIST], lib.extreme(1), rest=True),
        _f("sum", "list", [LIST], lib.of_numbers(lambda n: sum(n, Decimal())), NUMBER, rest=True),
        _f("product", "list", [LIST], lib.of_numbers(lambda n: math.prod(n, start=Decimal(1))),
           NUMBER, rest=True),
        _f("mean", "list", [LIST], lib.of_numbers(lambda n: sum(n, Decimal()) / len(n)), NUMBER,
           rest=True),
        _f("median", "list", [LIST], lib.of_numbers(statistics.median), NUMBER, rest=True),
        _f("stddev", "list", [LIST], lib.of_numbers(lib.deviation), NUMBER, rest=True),
        _f("mode", "list", [LIST],
           lambda values: sorted(statistics.multimode(lib.numbers(values))), LIST, rest=True),
        _f("all", "list", [LIST], lib.truths(False), BOOLEAN, rest=True),
        _f("any", "list", [LIST], lib.truths(True), BOOLEAN, rest=True),
        _f("sublist", "list,start position,length?", [LIST, NUMBER, NUMBER], lib.sublist, LIST),
        _f("append", "list,item", [LIST, ANY], lambda a, *b: [*a, *b], LIST,
           more=True),
        _f("concatenate", "list", [ANY], lib.concatenated, LIST, more=True),
        _f("insert before", "list,position,newItem", [LIST, NUMBER, ANY], lib.inserted, LIST),
        _f("remove", "list,position", [LIST, NUMBER], lib.removed, LIST),
        _f("list replace", "list,position,newItem", [LIST, ("number",), ANY], lib.replaced, LIST,
           _f("list replace", "list,match,newItem", [LIST, ("function",), ANY], lib.replaced)),
        _f("reverse", "list", [LIST], lambda values: values[::-1], LIST),
        _f("index of", "list,match", [LIST, ANY], lib.indices, LIST),
        _f("union", "list", [ANY], lambda *lists: lib.distinct(lib.concatenated(*lists)), LIST,
           more=True),
        _f("distinct values", "list", [LIST], lib.distinct, LIST),
        _f("duplicate values", "list", [LIST], lib.doubled, LIST),
        _f("flatten", "list", [LIST], lib.flat, LIST),
        _f("sort", "list,precedes?", [LIST, ("function",)], lib.in_order, LIST),
        _f("partition", "list,size", [LIST, NUMBER], lib.partition, LIST),
        _f("is empty", "list", [ANY], lib.is_empty, BOOLEAN),
        _f("get value", "m,key", [CONTEXT, ("text", "list")], lib.get_value),
        _f("get entries", "m", [CONTEXT], lib.entries_of, LIST),
        _f("context", "entries", [LIST], lib.context_of, CONTEXT),
        _f("context put", "context,key,value", [CONTEXT, ("text",), ANY], lib.put, CONTEXT,
           _f("context put", "context,keys,value", [CONTEXT, ("list",), ANY], lib.put)),
        _f("context merge", "contexts", [LIST], lib.merged, CONTEXT),
        _f("day of week", "date", [_WHEN], lambda day: lib.WEEKDAYS[day.weekday()], TEXT),
        _f("day of year", "date", [_WHEN], lambda day: Decimal(day.timetuple().tm_yday), NUMBER),
        _f("week of year", "date", [_WHEN], lambda day: Decimal(day.isocalendar()[1]), NUMBER),
        _f("month of year", "date", [_WHEN], lambda day: lib.MONTHS[day.month - 1], TEXT),
        _f("last day of month", "date", [_WHEN], lambda day: lib.last_day(lib.as_date(day)),
           (DATE,)),
        _f("is", "value1,value2?", [ANY, ANY], lib.is_same, BOOLEAN),
        _f("is defined", "value", [ANY], lambda value: value is not None, BOOLEAN),
        _f("get or else", "value,default", [ANY, ANY], lambda a, b: b if a is None else a),
        _f("assert", "value,condition,cause?", [ANY, BOOLEAN, TEXT], lib.asserted),
        _f("cycle", "duration", [(DAYS, MONTHS)], lambda each: f"R/{iso(each)}", TEXT,
           _f("cycle", "repetitions,duration", [NUMBER, (DAYS, MONTHS)],
              lambda count, each: f"R{lib.whole(count)}/{iso(each)}")),
        *(
            _f(name, "range1,range2", [ANY, ANY], lib.relation(compute), BOOLEAN)
            for name, compute in lib.RELATIONS.items()
        ),
    )
}  # fmt: skip


ALTERNATIVES = {
    f"{name}/{number}": replace(each, others=())
    for name, function in FEEL_FUNCTIONS.items()
    for number, each in enumerate((function, *function.others) if function.others else ())
}
"""The ways to call a function: the names of arguments tell which one is meant."""

_NAMED = (each for each in {*FEEL_FUNCTIONS, "not"} if " " in each or each == "not")
NAMES = [
    (re.compile("(" + name.replace(" ", r"\s+") + r")(?=\s*\()"), name)
    for name in sorted(_NAMED, key=len, reverse=True)
]
"""Names of functions that are several words, and how they are found."""

NAME_HEADS = frozenset(name.split()[0] for _, name in NAMES)
