"""What a call means in each dialect: a listed function, or what the other dialects write without.

JUEL: methods of texts and lists, Camunda's `execution.getVariable('x')`, and Flowable's
`var:equals(x, 1)`. XPath: the functions that BPMN adds to it (BPMN 2.0.2, clause 10.4.3).
"""

from collections.abc import Callable, Mapping, Sequence

from m2pem.mission.expression.dialect import Dialect
from m2pem.mission.expression.feel_functions import FEEL_FUNCTIONS
from m2pem.mission.expression.functions import FUNCTIONS, XPATH_FUNCTIONS
from m2pem.mission.expression.signatures import Function
from m2pem.mission.expression.temporal import NOW
from m2pem.mission.expression.tree import (
    And,
    Call,
    Compare,
    Comparison,
    If,
    Index,
    Literal,
    Name,
    Node,
    Not,
    Or,
)
from m2pem.suggestions import did_you_mean

Arguments = tuple[Node, ...]
Build = Callable[..., Node]


class CallError(Exception):
    """There is no such call; the message says what there is."""


def meaning(name: str, arguments: Arguments, dialect: Dialect) -> Node:
    """The tree of a call.

    Raises:
        CallError: the dialect has no such function, or it takes other arguments.
    """
    if name == "now" and not arguments:
        return _function("date", (Name(NOW),), dialect)
    match dialect:
        case Dialect.JUEL if ":" in name:
            return _of_variable(name, arguments)
        case Dialect.JUEL if name in _EXECUTION:
            return _built(name, _EXECUTION[name], (_variable(name, arguments),))
        case Dialect.JUEL if "." in name:
            receiver, _, method = name.rpartition(".")
            return method_call(Name(receiver), method, arguments)
        case Dialect.XPATH:
            name = name.rpartition(":")[2]
            if name in XPATH_DATA:
                return _variable(name, arguments[-1:])
            if name in _XPATH_SHAPES:
                return _built(name, _XPATH_SHAPES[name], arguments)
            name = XPATH_NAMES.get(name, name)
    return _function(name, arguments, dialect)


def feel_call(name: str, arguments: Arguments, names: Sequence[str]) -> Node:
    """The tree of a call in FEEL; `names`: of the arguments, in their order, or none.

    Raises:
        CallError: there is no such function.
    """
    if name in ("now", "today") and not arguments:
        moment = Call("FEEL date and time", (Name(NOW),))
        return moment if name == "now" else Call("FEEL date", (moment,))
    function = FEEL_FUNCTIONS.get(name)
    if function is None:
        if name in ("now", "today"):
            return Call("FEEL date and time", arguments or (Literal(None),))
        if name in FUNCTIONS and not names:
            return _function(name, arguments)
        known = (*FEEL_FUNCTIONS, *FUNCTIONS, "now", "today")
        hint = did_you_mean(name, known) or "docs/conditions.md lists them"
        raise CallError(f"there is no function {name[:40]!r}; {hint}")
    if names:
        name, arguments = _in_order(function, dict(zip(names, arguments, strict=True)))
    return Call(f"FEEL {name}", arguments)


def _in_order(function: Function, given: Mapping[str, Node]) -> tuple[str, Arguments]:
    """Which way to call a function the names mean, and its arguments as that has them; too many
    where a name is wrong."""
    for number, each in enumerate(function.ways):
        known = [parameter.name for parameter in each.parameters]
        if given.keys() <= {*known}:
            last = max((known.index(name) for name in given), default=-1)
            name = f"{function.name}/{number}" if function.others else function.name
            return name, tuple(given.get(each, Literal(None)) for each in known[: last + 1])
    return function.name, (*given.values(), *[Literal(None)] * (len(function.parameters) + 1))


def method_call(receiver: Node, method: str, arguments: Arguments) -> Node:
    """A method of a text or list, as JUEL has them.

    Raises:
        CallError: it is none of those that m2pem reads.
    """
    if method in _METHOD_SHAPES:
        return _built(method, _METHOD_SHAPES[method], (receiver, *arguments))
    if method in METHODS:
        return _function(METHODS[method], (receiver, *arguments))
    known = ", ".join(sorted({*METHODS, *_METHOD_SHAPES}))
    raise CallError(
        f"'{method[:40]}()' would run a method of an object, which m2pem does not; the methods "
        f"that it reads are {known}"
    )


def _function(name: str, arguments: Arguments, dialect: Dialect = Dialect.JUEL) -> Node:
    own = XPATH_FUNCTIONS if dialect is Dialect.XPATH else {}
    functions = {**FUNCTIONS, **own}
    prefix = "XPATH " if name in own else ""
    function = functions.get(name)
    if function is None:
        if "." in name:
            raise CallError(f"{name[:40]!r} would run a method of an object, which m2pem does not")
        hint = did_you_mean(name, functions) or "there are " + ", ".join((*functions, "now"))
        raise CallError(f"there is no function {name[:40]!r}; {hint}")
    if not function.accepts(len(arguments)):
        raise CallError(f"expected {function.signature}, found {len(arguments)} arguments")
    return Call(prefix + name, arguments)


def _built(name: str, build: Build, arguments: Arguments) -> Node:
    try:
        return build(*arguments)
    except TypeError:
        raise CallError(f"{name}() takes another number of arguments") from None


def _variable(name: str, arguments: Arguments) -> Name:
    """The variable that a call names, by a text or as it stands."""
    match arguments:
        case (Literal(str(key)),) if key.strip():
            return Name(key)
        case (Name() as variable,):
            return variable
    raise CallError(f"{name}() takes the name of a variable")


def _of_variable(name: str, arguments: Arguments) -> Node:
    """Flowable's functions, which take a variable's name first."""
    function = name.partition(":")[2]
    if function not in FLOWABLE:
        raise CallError(
            f"there is no function {name[:40]!r}; after 'var:' there are {', '.join(FLOWABLE)}"
        )
    return _built(name, FLOWABLE[function], (_variable(name, arguments[:1]), *arguments[1:]))


def _comparing(operator: Comparison) -> Build:
    return lambda left, right: Compare(operator, left, right)


def _calling(function: str) -> Callable[[Node], Node]:
    return lambda node: Call(function, (node,))


_lower, _exists, _empty = map(_calling, ("lower", "exists", "is_empty"))


def _contains(container: Node, item: Node, *more: Node) -> tuple[Node, ...]:
    return tuple(Call("contains", (container, each)) for each in (item, *more))


METHODS = {
    "contains": "contains",
    "endsWith": "ends_with",
    "isEmpty": "is_empty",
    "length": "length",
    "size": "length",
    "startsWith": "starts_with",
    "toLowerCase": "lower",
    "toString": "text",
    "toUpperCase": "upper",
}
"""Methods that are functions of their object."""

_METHOD_SHAPES: dict[str, Build] = {
    "equals": _comparing(Comparison.EQUAL),
    "equalsIgnoreCase": lambda a, b: Compare(Comparison.EQUAL, _lower(a), _lower(b)),
    "get": Index,
}
_EXECUTION: dict[str, Build] = {
    "execution.getVariable": lambda x: x,
    "execution.hasVariable": _exists,
}
FLOWABLE: dict[str, Build] = {
    "get": lambda x: x,
    "getOrDefault": lambda x, default: If(_exists(x), x, default),
    "exists": _exists,
    "empty": _empty,
    "isEmpty": _empty,
    "notEmpty": lambda x: Not(_empty(x)),
    "isNotEmpty": lambda x: Not(_empty(x)),
    "contains": lambda x, *items: And(_contains(x, *items)),
    "containsAny": lambda x, *items: Or(_contains(x, *items)),
    **{
        name: _comparing(sign)
        for sign, names in {
            Comparison.EQUAL: ("equals", "eq"),
            Comparison.NOT_EQUAL: ("notEquals", "ne"),
            Comparison.LESS: ("lowerThan", "lt"),
            Comparison.LESS_EQUAL: ("lowerThanOrEquals", "lte"),
            Comparison.GREATER: ("greaterThan", "gt"),
            Comparison.GREATER_EQUAL: ("greaterThanOrEquals", "gte"),
        }.items()
        for name in names
    },
}
"""What follows `var:`, `vars:` or `variables:`."""

XPATH_DATA = frozenset({"getDataInput", "getDataObject", "getDataOutput", "getProcessProperty"})
"""They name what they read last; the process may stand before it."""

_XPATH_SHAPES: dict[str, Build] = {
    "true": lambda: Literal(True),
    "false": lambda: Literal(False),
    "not": Not,
}
XPATH_NAMES = {"count": "length"}
"""What XPath 1.0 calls one of `FUNCTIONS`, whose names it may use too."""
