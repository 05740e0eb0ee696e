"""Requirements for a part of a run: before, after or between things that happen.

| written | the requirement is about |
|---|---|
| nothing | the whole run |
| `before: R` | from the beginning to the first R, if R comes |
| `after: Q` | from the first Q on |
| `after: Q`, `before: R` | from each Q to the next R, if that comes |
| `after: Q`, `until: R` | from each Q to the next R, or on if that never comes |

Within a part, `<>` means "before it is over" and `[]` "until it is over".
"""

from m2pem.verify.ltl.formula import (
    PAST,
    Always,
    And,
    Eventually,
    Formula,
    Implies,
    Next,
    Not,
    Or,
    Timed,
    Until,
    WeakUntil,
    rebuilt,
    walk,
)


class ScopeError(ValueError):
    """A formula that cannot be required of a part of a run."""


def within(
    formula: Formula,
    before: Formula | None = None,
    after: Formula | None = None,
    until: Formula | None = None,
) -> Formula:
    """The formula, required of one part of the run.

    Raises:
        ScopeError: it has operators of the past, or observes single steps, or `until` is given
            without `after`.
    """
    if before is None and after is None and until is None:
        return formula
    if any(isinstance(each, (*PAST, Next)) for each in walk(formula)):
        raise ScopeError("it counts from the beginning of the run, or looks at single steps")
    if until is not None and (after is None or before is not None):
        raise ScopeError("'until' stands beside 'after', and without 'before'")
    if after is None:
        assert before is not None
        return Implies(Eventually(before), _up_to(formula, before))
    if before is None and until is None:
        return WeakUntil(Not(after), And((after, formula)))
    end = before if before is not None else until
    assert end is not None
    parts = [after, Not(end), *([Eventually(end)] if before is not None else [])]
    return Always(Implies(And(tuple(parts)), _up_to(formula, end)))


def _up_to(formula: Formula, end: Formula) -> Formula:
    """The formula, required of the moments before the first in which `end` holds."""
    match formula:
        case Timed(Always(operand), low, high):
            return Not(_up_to(Timed(Eventually(Not(operand)), low, high), end))
        case Always(operand):
            return WeakUntil(_up_to(operand, end), end)
        case Eventually(operand):
            return Until(Not(end), And((_up_to(operand, end), Not(end))))
        case Until(left, right):
            inside = And((_up_to(left, end), Not(end)))
            return Until(inside, And((_up_to(right, end), Not(end))))
        case WeakUntil(left, right):
            return WeakUntil(_up_to(left, end), Or((_up_to(right, end), end)))
        case _:
            return rebuilt(formula, lambda each: _up_to(each, end))


def say_scope(said: str, before: str, after: str, until: str) -> str:
    """The sentence, with the part of the run that it is about."""
    if after and before:
        return f"from when {after} to when {before}, if that comes: {said}"
    if after and until:
        return f"from when {after} until {until}: {said}"
    if after:
        return f"once {after}: {said}"
    return f"before {before}, if that comes: {said}" if before else said
