"""The syntax tree of LTL formulas, and their text.

Nodes are immutable and compared by value. `show` writes a formula as people write it; parsing that
text gives the same formula. Operators of the past look at a run from its beginning to now; their
operands and that of `Count` contain no operator of the future. `Next` is not in the language: only
patterns that look at single steps use it (`needs_steps`).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, TypeAlias, Union

from m2pem.mission.expression import Expression
from m2pem.units import US_PER_S

# --- propositions: what is true or false of one moment of a run ----------------------------------


@dataclass(frozen=True, slots=True)
class Active:
    """A token is on the element."""

    element: str
    position: int = field(default=0, compare=False)


@dataclass(frozen=True, slots=True)
class Completed:
    """A token leaves the element as completed, in this moment."""

    element: str
    position: int = field(default=0, compare=False)


@dataclass(frozen=True, slots=True)
class Commanded:
    """The behavior holds the resource; any behavior does, where none is named."""

    resource: str
    behavior: str = ""
    position: int = field(default=0, compare=False)
    behavior_position: int = field(default=0, compare=False)


@dataclass(frozen=True, slots=True)
class Ended:
    """The run is over: as "completed", "terminated" or "failed", or in any way ("")."""

    outcome: str = ""
    position: int = field(default=0, compare=False)


@dataclass(frozen=True, slots=True)
class Data:
    """A condition over the data of the process that the run begins with."""

    expression: Expression
    position: int = field(default=0, compare=False)


@dataclass(frozen=True, slots=True)
class Measured:
    """A comparison of what telemetry says of vehicles: `distance(a, b) < 5 m`.

    `value`: in SI (metres, m/s), a fraction (battery), or the state of a link. `text`: the value as
    written.
    """

    quantity: str
    resources: tuple[str, ...]
    operator: str
    value: float | str
    text: str = field(default="", compare=False)
    position: int = field(default=0, compare=False)


@dataclass(frozen=True, slots=True)
class Timed:
    """An operator of the future with bounds: `<>[0 s, 30 s] a`. Times are microseconds of mission
    time from the moment of which it is said; both bounds belong to it.

    `operand`: one `Eventually`, `Always` or `Until`; within it, each operator of the future has
    bounds. So its truth is known after `high_us` and the bounds within, and the rest of a formula
    takes it as a proposition.
    """

    operand: "Formula"
    low_us: int
    high_us: int


OUTCOMES = ("completed", "terminated", "failed")

Proposition: TypeAlias = Union[Active, Completed, Commanded, Ended, Data, Measured, Timed]

# --- formulas ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Constant:
    """A formula that is always true, or never."""

    value: bool


@dataclass(frozen=True, slots=True)
class _Unary:
    operand: "Formula"


@dataclass(frozen=True, slots=True)
class _Binary:
    left: "Formula"
    right: "Formula"


@dataclass(frozen=True, slots=True)
class Not(_Unary):
    """`!a`."""


@dataclass(frozen=True, slots=True)
class And:
    """`a && b && ...`."""

    operands: "tuple[Formula, ...]"


@dataclass(frozen=True, slots=True)
class Or:
    """`a || b || ...`."""

    operands: "tuple[Formula, ...]"


@dataclass(frozen=True, slots=True)
class Implies(_Binary):
    """`a -> b`."""


@dataclass(frozen=True, slots=True)
class Iff(_Binary):
    """`a <-> b`."""


@dataclass(frozen=True, slots=True)
class Always(_Unary):
    """`[] a`: from now on."""


@dataclass(frozen=True, slots=True)
class Eventually(_Unary):
    """`<> a`: now or later."""


@dataclass(frozen=True, slots=True)
class Until(_Binary):
    """`a U b`: b comes, and a holds until then."""


@dataclass(frozen=True, slots=True)
class WeakUntil(_Binary):
    """`a W b`: the same, or a holds for ever."""


@dataclass(frozen=True, slots=True)
class Next(_Unary):
    """A formula about the next moment."""


@dataclass(frozen=True, slots=True)
class Once(_Unary):
    """`once a`: now or before."""


@dataclass(frozen=True, slots=True)
class Historically(_Unary):
    """`historically a`: until now, always."""


@dataclass(frozen=True, slots=True)
class Since(_Binary):
    """`a since b`: b came, and a has held after it."""


@dataclass(frozen=True, slots=True)
class Count:
    """`count(a, b) >= 2`: how many times, all together, one of them has begun to hold so far."""

    operands: "tuple[Formula, ...]"
    operator: str
    number: int


Formula: TypeAlias = Union[
    Active,
    Completed,
    Commanded,
    Ended,
    Data,
    Measured,
    Timed,
    Constant,
    Not,
    And,
    Or,
    Implies,
    Iff,
    Always,
    Eventually,
    Until,
    WeakUntil,
    Next,
    Once,
    Historically,
    Since,
    Count,
]

PROPOSITIONS = (Active, Completed, Commanded, Ended, Data, Measured, Timed)
PAST = (Once, Historically, Since, Count)
FUTURE = (Always, Eventually, Until, WeakUntil, Next)

PREFIXES: dict[type[Not] | type[Always] | type[Eventually], str] = {
    Always: "[]",
    Eventually: "<>",
    Not: "!",
}
"""Prefix operators."""
OPERATORS: dict[type[Until] | type[WeakUntil] | type[Since], str] = {
    Until: "U",
    WeakUntil: "W",
    Since: "since",
}
"""Infix operators over time."""

TRUE = Constant(True)
FALSE = Constant(False)


def conjunction(operands: "Sequence[Formula]") -> Formula:
    """`a && b && ...`; true of no operands."""
    if not operands:
        return TRUE
    return operands[0] if len(operands) == 1 else And(tuple(operands))


def disjunction(operands: "Sequence[Formula]") -> Formula:
    """`a || b || ...`; false of no operands."""
    if not operands:
        return FALSE
    return operands[0] if len(operands) == 1 else Or(tuple(operands))


def negated(formula: Formula) -> Formula:
    return formula.operand if isinstance(formula, Not) else Not(formula)


def children(formula: Formula) -> tuple[Formula, ...]:
    """The formulas directly below, in the order in which they are written."""
    match formula:
        case And() | Or() | Count():
            return formula.operands
        case _Binary():
            return (formula.left, formula.right)
        case _Unary() | Timed():
            return (formula.operand,)
        case _:
            return ()


def rebuilt(formula: Formula, change: Callable[[Formula], Formula]) -> Formula:
    """The formula with `change` applied to those directly below."""
    if not children(formula):
        return formula
    new: dict[str, Any] = {}
    for each in fields(formula):
        value = getattr(formula, each.name)
        if each.name == "operands":
            new[each.name] = tuple(change(operand) for operand in value)
        elif each.name in ("operand", "left", "right"):
            new[each.name] = change(value)
    return replace(formula, **new)


def walk(formula: Formula) -> Iterator[Formula]:
    """The formula and all below it, parents first."""
    waiting = [formula]
    while waiting:
        current = waiting.pop()
        yield current
        waiting += reversed(children(current))


def propositions(formula: Formula) -> tuple[Proposition, ...]:
    """The propositions of a formula, each once, in the order in which they are written.

    An operator with bounds is one, and what is within it is not.
    """
    found: dict[Proposition, None] = {}
    waiting = [formula]
    while waiting:
        current = waiting.pop()
        if isinstance(current, PROPOSITIONS):
            found.setdefault(current)
        else:
            waiting += reversed(children(current))
    return tuple(found)


def bounds_misused(formula: Formula) -> str:
    """Return why a formula cannot stand in an operator with bounds; "" if it can."""
    if any(isinstance(each, PAST) for each in walk(formula)):
        return "once, historically, since and count look beyond bounds"
    if any(isinstance(each, FUTURE) for each in _outside_bounds(formula)):
        return "in an operator with bounds each [], <> and U has bounds, and there is no W"
    return ""


def _outside_bounds(formula: Formula) -> Iterator[Formula]:
    """The formula and all below it, but for operators with bounds and what is within them."""
    if not isinstance(formula, Timed):
        yield formula
        for each in children(formula):
            yield from _outside_bounds(each)


def needs_steps(formula: Formula) -> bool:
    """Whether a formula observes single steps, so that a search may leave none out."""
    return any(isinstance(each, Next) for each in walk(formula))


def needs_runs(formula: Formula) -> bool:
    """Whether a formula is about time or telemetry, which only runs have."""
    return any(isinstance(each, Timed | Measured) for each in walk(formula))


_LOOSE, _IFF, _IMPLIES, _OR, _AND, _UNTIL, _UNARY = range(7)

_BINARY: dict[type[Formula], tuple[str, int]] = {
    Iff: ("<->", _IFF),
    Implies: ("->", _IMPLIES),
    **{kind: (word, _UNTIL) for kind, word in OPERATORS.items()},
}


def show(formula: Formula) -> str:
    """Return the formula as text."""
    return _show(formula, _LOOSE)


def _show(formula: Formula, around: int) -> str:
    """`around`: the precedence of the operator around it; a weaker formula gets parentheses."""
    match formula:
        case Active():
            return f"active({_name(formula.element)})"
        case Completed():
            return f"completed({_name(formula.element)})"
        case Commanded():
            behavior = f", {_name(formula.behavior)}" if formula.behavior else ""
            return f"commanded({_name(formula.resource)}{behavior})"
        case Ended():
            return f"ended({formula.outcome})" if formula.outcome else "ended"
        case Data():
            return f"({formula.expression.text.strip()})" if around else formula.expression.text
        case Measured():
            return show_measured(formula)
        case Timed(operand):
            return _show_timed(formula, operand, around)
        case Constant():
            return "true" if formula.value else "false"
        case Count():
            inside = ", ".join(show(each) for each in formula.operands)
            text = f"count({inside}) {formula.operator} {formula.number}"
            return f"({text})" if around >= _UNTIL else text
        case Once():
            return f"once({show(formula.operand)})"
        case Historically():
            return f"historically({show(formula.operand)})"
        case Not() | Always() | Eventually():
            return PREFIXES[type(formula)] + _show(formula.operand, _UNARY)
        case Next():
            return f"X {_show(formula.operand, _UNARY)}"
        case And():
            return _joined(" && ", formula.operands, _AND, around)
        case Or():
            return _joined(" || ", formula.operands, _OR, around)
        case _:
            word, strength = _BINARY[type(formula)]
            text = (
                f"{_show(formula.left, strength + 1)} {word} {_show(formula.right, strength + 1)}"
            )
            return f"({text})" if around > strength or around == _UNARY else text


def show_measured(each: Measured) -> str:
    """Return a comparison of telemetry as text."""
    names = ", ".join(map(_name, each.resources))
    return f"{each.quantity}({names}) {each.operator} {each.text or each.value}"


def show_us(time_us: int) -> str:
    """Return a duration as text: "30 s", "1.5 s"."""
    return f"{time_us / US_PER_S:.6f}".rstrip("0").rstrip(".") + " s"


def _show_timed(formula: Timed, operand: Formula, around: int) -> str:
    bounds = f"[{show_us(formula.low_us)}, {show_us(formula.high_us)}]"
    if isinstance(operand, Until):
        left, right = _show(operand.left, _UNARY), _show(operand.right, _UNARY)
        text = f"{left} U{bounds} {right}"
        return f"({text})" if around >= _UNTIL else text
    assert isinstance(operand, Always | Eventually)
    return f"{PREFIXES[type(operand)]}{bounds} {_show(operand.operand, _UNARY)}"


def _joined(word: str, operands: tuple[Formula, ...], strength: int, around: int) -> str:
    text = word.join(_show(each, strength + 1) for each in operands)
    return f"({text})" if around > strength else text


def _name(name: str) -> str:
    plain = name and all(c.isalnum() or c in "_-.:/" for c in name)
    return name if plain else "'" + name.replace("'", "\\'") + "'"
