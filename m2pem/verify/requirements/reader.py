"""The reader of requirements: what spec files and BPMN files have in common."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from m2pem.errors import ExpressionSyntaxError, M2pemError
from m2pem.suggestions import did_you_mean, suggest
from m2pem.units import US_PER_S, Dimension, UnitError, quantity
from m2pem.verify.assumptions import AssumptionError, Assumptions, refuse_unknown
from m2pem.verify.assumptions import parse as parse_assumptions
from m2pem.verify.ltl import parse
from m2pem.verify.ltl.formula import (
    Always,
    Completed,
    Formula,
    Timed,
    bounds_misused,
    children,
    needs_steps,
    negated,
    walk,
)
from m2pem.verify.ltl.observer import Observer
from m2pem.verify.ltl.parser import MAX_BOUND_S
from m2pem.verify.requirements.english import English, sentence
from m2pem.verify.requirements.names import Names, UnknownNameError
from m2pem.verify.requirements.patterns import PATTERNS, Argument, Kind, Pattern
from m2pem.verify.requirements.patterns.scopes import ScopeError, say_scope, within
from m2pem.verify.requirements.requirement import Requirement

EACH = "each"
SCOPES = ("before", "after", "until")
_MOST_TIMES = 100
_NAME = re.compile(r"[\w.:-]+")
_CONSTANTS = ("true", "false", "ended")


class UnusableError(Exception):
    """One requirement cannot be used. `where`: the key with the error ("ltl", "pattern", "args.x").

    `misread`: the position, if it is in a formula.
    """

    def __init__(
        self,
        where: str,
        message: str,
        remedy: str = "",
        misread: ExpressionSyntaxError | None = None,
    ) -> None:
        super().__init__(message)
        self.where = where
        self.message = message
        self.remedy = remedy
        self.misread = misread


@dataclass(frozen=True, slots=True)
class WrittenRequirement:
    """A requirement as written. `arguments`: texts, numbers, flags and lists of texts, by name.
    `assume`: a text, or a list of texts.
    """

    id: str
    ltl: str | None = None
    pattern: str | None = None
    arguments: Mapping[str, Any] = field(default_factory=dict)
    text: str = ""
    fair: bool | None = None
    file: str = ""
    line: int = 0
    assume: str | Sequence[str] = ()
    monitor: bool = True
    on_violation: str = ""


def requirements_of(written: WrittenRequirement, names: Names) -> Iterator[Requirement]:
    """The requirements that a written one gives: one, or one for each vehicle.

    Raises:
        UnusableError: it cannot be read, or names what the mission or fleet lacks.
    """
    on_violation = _on_violation(written.on_violation, names)
    for each in _read(written, names):
        if on_violation:
            _refuse_unmonitored(each, monitor=written.monitor)
        yield replace(each, monitor=written.monitor, on_violation=on_violation)


def _refuse_unmonitored(requirement: Requirement, *, monitor: bool) -> None:
    """Refuse what is to be thrown by a requirement for which no run is monitored."""
    if not monitor:
        message = "runs are not monitored for it (monitor is false), so a violation throws nothing"
        remedy = "leave out one of the two"
    elif needs_steps(requirement.formula):
        message = "runs are not monitored for single steps, so a violation throws nothing"
        remedy = "leave it out"
    else:
        return
    raise UnusableError("on_violation", message, remedy)


def _on_violation(text: str, names: Names) -> str:
    """What a violation throws, with the id of a signal for its name."""
    kind, _, name = text.partition(":")
    if not text or (kind == "error" and name):
        return text
    if kind != "signal":
        raise UnusableError(
            "on_violation",
            f"{text!r} is neither an error nor a signal",
            "write error:CODE or signal:ID",
        )
    signals = names.mission.signals
    found = [each.id for each in signals.values() if name in (each.id, each.name)]
    if len(found) != 1:
        known = [each.name or each.id for each in signals.values()]
        hint = suggest(name, known, "signals") if known else "the mission has none"
        raise UnusableError("on_violation", f"the mission has no signal {name!r}", hint)
    return f"signal:{found[0]}"


def _read(written: WrittenRequirement, names: Names) -> Iterator[Requirement]:
    if (written.ltl is None) == (written.pattern is None):
        raise UnusableError(
            "", "a requirement has either 'ltl' or 'pattern'", "write one of the two"
        )
    assumed = assumptions_of(written.assume, names)
    if written.ltl is not None:
        if written.arguments:
            raise UnusableError("args", "only a pattern takes arguments", "delete them")
        formula = _formula(written.ltl, "ltl", names)
        yield _checked(
            Requirement(
                written.id,
                formula,
                English(names.labels).sentence(formula),
                written.text,
                fair=bool(written.fair),
                file=written.file,
                line=written.line,
                assumed=assumed,
            ),
            "ltl",
        )
        return
    assert written.pattern is not None
    pattern = PATTERNS.get(written.pattern)
    if pattern is None:
        hint = suggest(written.pattern, PATTERNS, "patterns")
        raise UnusableError("pattern", f"there is no pattern '{written.pattern}'", hint)
    yield from _of_pattern(written, pattern, names, assumed)


def assumptions_of(text: str | Iterable[str], names: Names) -> Assumptions:
    """Read what is assumed.

    Raises:
        UnusableError: it is no assumption, or names what the fleet lacks.
    """
    try:
        found = parse_assumptions(text)
        refuse_unknown(found, names.fleet)
    except AssumptionError as error:
        raise UnusableError("assume", error.message, error.remedy) from None
    return found


def _of_pattern(
    written: WrittenRequirement, pattern: Pattern, names: Names, assumed: Assumptions
) -> Iterator[Requirement]:
    values, scope = _values(written, pattern, names)
    resource = pattern.argument("resource")
    each = resource is not None and values["resource"] == EACH
    for vehicle in names.vehicles() if each else ("",):
        chosen = {**values, "resource": vehicle} if each else values
        words = English(names.labels)
        try:
            formula = _in_part(pattern.build(chosen, names), chosen, scope)
        except ScopeError as error:
            message = f"{pattern.name} cannot be asked for a part of a run: {error}"
            raise UnusableError("args", message) from None
        except UnknownNameError as error:
            raise UnusableError("args", str(error)) from None
        parts = {name: words.of(each) if each is not None else "" for name, each in scope.items()}
        said = say_scope(
            pattern.say(chosen, words), parts["before"], parts["after"], parts["until"]
        )
        yield _checked(
            Requirement(
                f"{written.id}/{vehicle}" if each else written.id,
                formula,
                sentence(said),
                written.text,
                pattern.name,
                vehicle,
                pattern.fair if written.fair is None else written.fair,
                written.file,
                written.line,
                assumed,
            ),
            "args",
        )


def _in_part(
    formula: Formula, arguments: Mapping[str, Any], scope: Mapping[str, Formula | None]
) -> Formula:
    """A pattern's formula, required of a part of the run.

    Raises:
        ScopeError: it cannot be.
        UnusableError: its bounds of time do not fit what it is about.
    """
    if arguments.get("for") is not None:
        _refuse_moments(formula)
        if scope["before"] is not None or scope["until"] is not None:
            raise ScopeError("'for' may go beyond its end; only 'after' goes with it")
    found = within(formula, **scope)
    for each in walk(found):
        if isinstance(each, Timed):
            for part in children(each.operand):
                if misused := bounds_misused(part):
                    raise UnusableError("args", misused)
    return found


def _refuse_moments(formula: Formula) -> None:
    """Refuse to have something go on that is true in single moments only."""
    for each in walk(formula):
        match each:
            case Timed(Always(Completed(element))):
                raise UnusableError(
                    "args.for",
                    f"completed({element}) is true in one moment, and never for a while",
                    f"write active({element})",
                )


def _checked(requirement: Requirement, where: str) -> Requirement:
    """The requirement, if its automaton is not too large."""
    try:
        Observer(negated(requirement.formula))
    except M2pemError as error:
        raise UnusableError(where, str(error)) from None
    return requirement


def _values(
    written: WrittenRequirement, pattern: Pattern, names: Names
) -> tuple[dict[str, Any], dict[str, Formula | None]]:
    scopes = [name for name in SCOPES if pattern.scoped and pattern.argument(name) is None]
    known = [*(each.name for each in pattern.arguments), *scopes]
    if unknown := [name for name in written.arguments if name not in known]:
        raise _unknown_arguments(unknown, written, pattern, known)
    scope: dict[str, Formula | None] = dict.fromkeys(SCOPES)
    for name in scopes:
        if name in written.arguments:
            scope[name] = _condition(written.arguments[name], name, names)
    values: dict[str, Any] = {}
    for argument in pattern.arguments:
        if argument.name in written.arguments:
            value = written.arguments[argument.name]
            values[argument.name] = _value(argument, value, names, values)
        elif argument.required:
            raise UnusableError(
                "args", f"{pattern.name} needs '{argument.name}'", _example(argument)
            )
        else:
            values[argument.name] = argument.default
    return values, scope


def _unknown_arguments(
    unknown: Sequence[str], written: WrittenRequirement, pattern: Pattern, known: Sequence[str]
) -> UnusableError:
    """Name all arguments that a pattern does not take, and those that it lacks."""
    free = [name for name in known if name not in written.arguments]
    needed = [each.name for each in pattern.arguments if each.required and each.name in free]
    message = f"{pattern.name} takes no {' and no '.join(map(repr, unknown))}"
    if needed:
        message += f", and needs {' and '.join(map(repr, needed))}"
    hints = [did_you_mean(name, free) for name in unknown]
    if all(hints):
        each = [f"{name!r}: {hint}" for name, hint in zip(unknown, hints, strict=True)]
        remedy = hints[0] if len(hints) == 1 else "; ".join(each)
    elif len(unknown) == len(needed) == 1:
        remedy = f"did you mean {needed[0]!r}?"
    else:
        remedy = f"known arguments: {', '.join(known)}"
    return UnusableError(f"args.{unknown[0]}", message, remedy)


def _value(argument: Argument, value: Any, names: Names, others: Mapping[str, Any]) -> Any:
    where = f"args.{argument.name}"
    try:
        match argument.kind:
            case Kind.CONDITION:
                return _condition(value, argument.name, names)
            case Kind.CONDITIONS:
                listed = _listed(value, where)
                return tuple(_condition(each, argument.name, names) for each in listed)
            case Kind.ELEMENT:
                return names.element(_text(value, where))
            case Kind.ELEMENTS:
                return tuple(names.element(each) for each in _listed(value, where))
            case Kind.RESOURCE:
                return value if value == EACH else names.resource(_text(value, where))
            case Kind.BEHAVIOR:
                return names.behavior(_text(value, where))
            case Kind.COUNT:
                return _count(value, where)
            case Kind.DURATION:
                return _duration_us(value, where)
            case Kind.FLAG:
                if value not in (True, False, "true", "false"):
                    raise UnusableError(where, f"{value!r} is neither true nor false")
                return value in (True, "true")
            case Kind.DECISION:
                return names.decision(others["ask"], _text(value, where))
    except UnknownNameError as error:
        raise UnusableError(where, str(error)) from None


def _condition(value: Any, name: str, names: Names) -> Formula:
    text = _text(value, f"args.{name}")
    try:
        return Completed(names.element(text))
    except UnknownNameError as error:
        if _NAME.fullmatch(text) and text not in names.data_names and text not in _CONSTANTS:
            raise UnusableError(f"args.{name}", str(error)) from None
        return _formula(text, f"args.{name}", names)


def _formula(text: str, where: str, names: Names) -> Formula:
    try:
        return names.resolved(parse(text), text)
    except ExpressionSyntaxError as error:
        raise UnusableError(where, error.message, misread=error) from None


def _text(value: Any, where: str) -> str:
    if not isinstance(value, str) or not value.strip():
        raise UnusableError(where, f"{value!r} is no text", "write a name, or a formula")
    return value.strip()


def _listed(value: Any, where: str) -> list[str]:
    found = value if isinstance(value, list) else _split(_text(value, where))
    if len(found) < 2:
        raise UnusableError(where, "a list of two or more is needed", "write [A, B]")
    return [_text(each, where) for each in found]


def _split(text: str) -> list[str]:
    """The parts between commas that are not inside parentheses."""
    parts, depth = [""], 0
    for character in text:
        depth += (character in "([") - (character in ")]")
        if character == "," and not depth:
            parts.append("")
        else:
            parts[-1] += character
    return parts


def _count(value: Any, where: str) -> int:
    number = int(value) if isinstance(value, str) and value.strip().isdecimal() else value
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number <= _MOST_TIMES:
        raise UnusableError(where, f"{value!r} is no whole number from 0 to {_MOST_TIMES}")
    return number


def _duration_us(value: Any, where: str) -> int:
    text = value.strip() if isinstance(value, str) else f"{value}"
    if not text[-1:].isalpha():
        raise UnusableError(where, f"{text!r} is no time with its unit", "write 30 s")
    try:
        duration_s = quantity(text, Dimension.DURATION)
    except UnitError as error:
        raise UnusableError(where, str(error), "write 30 s") from None
    if not 0 < duration_s <= MAX_BOUND_S:
        raise UnusableError(where, f"{text!r} is no time up to 30 days, and more than 0 s")
    return round(duration_s * US_PER_S)


def _example(argument: Argument) -> str:
    examples = {
        Kind.CONDITION: "Survey, or a formula",
        Kind.CONDITIONS: "[SurveyNorth, SurveySouth]",
        Kind.ELEMENT: "AskOperator",
        Kind.ELEMENTS: "[DriveNorth, DriveSouth]",
        Kind.RESOURCE: "each, or the name of a vehicle",
        Kind.BEHAVIOR: "area_survey",
        Kind.COUNT: "2",
        Kind.FLAG: "true",
        Kind.DECISION: "continue",
        Kind.DURATION: "30 s",
    }
    return f"write {argument.name}: {examples[argument.kind]}"
