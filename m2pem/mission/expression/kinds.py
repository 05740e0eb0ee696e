"""Which kinds of values an expression can have, whatever is in the data."""

from collections.abc import Callable
from itertools import product
from typing import TypeAlias

from m2pem.mission.expression import tree as t
from m2pem.mission.expression.feel_arithmetic import result_kind
from m2pem.mission.expression.functions import LISTED
from m2pem.mission.expression.operators import kind
from m2pem.mission.expression.temporal import DAYS, MONTHS

DATA = frozenset({"boolean", "number", "text", "list", "map"})
"""What a name of data may be."""

Of: TypeAlias = Callable[[str], frozenset[str]]
"""The kinds that the values of a name may have, besides null."""

_NEGATED = frozenset({"number", DAYS, MONTHS})


def kinds(node: t.Node, *, coerced: bool = False, of: Of = lambda _: DATA) -> frozenset[str]:
    """The kinds of its values besides null, as `operators.kind` calls them; none: it has no value
    but null, or an error. `coerced`: as of JUEL and XPath, whose arithmetic gives numbers.
    """

    def within(inner: t.Node) -> frozenset[str]:
        return kinds(inner, coerced=coerced, of=of)

    match node:
        case t.Name(name):
            return of(name)
        case t.Negate() | t.Arithmetic() if coerced:
            return frozenset({"number"})
        case t.Literal(value):
            return frozenset() if value is None else frozenset({kind(value)})
        case t.Index() | t.Filter() | t.Path() | t.Invoke():
            return DATA
        case t.Call(function, arguments):
            called = LISTED[function]
            fits = called.fits([within(each) for each in arguments])
            return (frozenset(called.gives) or DATA) if fits else frozenset()
        case t.If(_, then, otherwise):
            return within(then) | within(otherwise)
        case t.Negate(operand):
            return within(operand) & _NEGATED
        case t.Arithmetic(sign, left, right):
            pairs = product(within(left), within(right))
            found = (_result(one, sign, other) for one, other in pairs)
            return frozenset(each for each in found if each is not None)
        case t.Join():
            return frozenset({"text"})
        case t.ListOf() | t.For():
            return frozenset({"list"})
        case t.ContextOf() | t.RangeOf() | t.Lambda():
            return frozenset({"map"})
    return frozenset({"boolean"})


def _result(left: str, sign: t.Operation, right: str) -> str | None:
    if left == right and (left == "number" or (left == "text" and sign is t.Operation.ADD)):
        return left
    return result_kind(left, sign, right)
