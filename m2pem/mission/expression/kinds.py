"""Which kinds of values an expression can have, whatever is in the data."""

from collections.abc import Callable, Sequence
from itertools import chain, product, repeat
from typing import TypeAlias

from m2pem.mission.expression.feel_arithmetic import result_kind
from m2pem.mission.expression.feel_functions import FeelFunction, Parameter
from m2pem.mission.expression.functions import LISTED
from m2pem.mission.expression.operators import kind
from m2pem.mission.expression.temporal import DAYS, MONTHS
from m2pem.mission.expression.tree import (
    Arithmetic,
    Call,
    ContextOf,
    Filter,
    For,
    If,
    Index,
    Invoke,
    Join,
    Lambda,
    ListOf,
    Literal,
    Name,
    Negate,
    Node,
    Operation,
    Path,
    RangeOf,
)

DATA = frozenset({"boolean", "number", "text", "list", "map"})
"""What a name of data may be."""

Of: TypeAlias = Callable[[str], frozenset[str]]
"""The kinds that the values of a name may have, besides null."""

_NEGATED = frozenset({"number", DAYS, MONTHS})


def kinds(node: Node, *, coerced: bool = False, of: Of = lambda _: DATA) -> frozenset[str]:
    """The kinds of its values besides null, as `operators.kind` calls them; none: it has no value
    but null, or an error. `coerced`: as of JUEL and XPath, whose arithmetic gives numbers.
    """

    def within(inner: Node) -> frozenset[str]:
        return kinds(inner, coerced=coerced, of=of)

    match node:
        case Name(name):
            return of(name)
        case Negate() | Arithmetic() if coerced:
            return frozenset({"number"})
        case Literal(value):
            return frozenset() if value is None else frozenset({kind(value)})
        case Index() | Filter() | Path() | Invoke():
            return DATA
        case Call(function, arguments):
            called = LISTED[function]
            if isinstance(called, FeelFunction):
                given = [within(each) for each in arguments]
                return (frozenset(called.gives) or DATA) if _fits(called, given) else frozenset()
            takes = chain(called.takes, repeat(called.takes[-1]))
            fits = all((within(each) | {"null"}) & {*next(takes)} for each in arguments)
            return frozenset(called.gives) if fits else frozenset()
        case If(_, then, otherwise):
            return within(then) | within(otherwise)
        case Negate(operand):
            return within(operand) & _NEGATED
        case Arithmetic(sign, left, right):
            pairs = product(within(left), within(right))
            found = (_result(one, sign, other) for one, other in pairs)
            return frozenset(each for each in found if each is not None)
        case Join():
            return frozenset({"text"})
        case ListOf() | For():
            return frozenset({"list"})
        case ContextOf() | RangeOf() | Lambda():
            return frozenset({"map"})
    return frozenset({"boolean"})


def _fits(called: FeelFunction, given: Sequence[frozenset[str]]) -> bool:
    """Whether there is a way to call a function of FEEL with arguments of some kinds."""
    for each in (called, *called.others):
        if each.rest or (each.accepts(len(given)) and all(map(_takes, each.parameters, given))):
            return True
    return False


def _takes(parameter: Parameter, given: frozenset[str]) -> bool:
    known = {"context" if each == "map" else each for each in given}
    anything = not parameter.kinds or not given or "list" in {*parameter.kinds, *given}
    return anything or not known.isdisjoint(parameter.kinds)


def _result(left: str, sign: Operation, right: str) -> str | None:
    if left == right and (left == "number" or (left == "text" and sign is Operation.ADD)):
        return left
    return result_kind(left, sign, right)
