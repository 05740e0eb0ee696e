"""What is decided when a rule fires: by somebody outside, or by a choice that the mission leaves.

Fairness is about outcomes: one that can come again and again does come again and again. Rules of
one outcome are the same answer, report, timer, ..., which finds the mission in different states:
never can both fire. A join only waits, and decides nothing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from m2pem.verify.system import Kind, Rule, System

_Decided = tuple[object, ...]


def with_outcomes(rules: Sequence[Rule]) -> list[Rule]:
    """The same rules, each with its outcome."""
    alike: dict[_Decided, list[tuple[Rule, int]]] = {}
    count = 0
    made: list[Rule] = []
    for rule in rules:
        if rule.kind is Kind.JOIN:
            made.append(rule)
            continue
        others = alike.setdefault(_decided(rule), [])
        taken = {outcome for other, outcome in others if not _exclude(rule, other)}
        free = [outcome for _, outcome in others if outcome not in taken]
        outcome = free[0] if free else count
        count += not free
        others.append((rule, outcome))
        made.append(replace(rule, outcomes=(outcome,)))
    return made


def _decided(rule: Rule) -> _Decided:
    if rule.kind is not Kind.OUTSIDE:
        return (rule.index,)
    return rule.trigger, rule.detail, rule.element, rule.consume, rule.assign


def _exclude(one: Rule, other: Rule) -> bool:
    """Whether two rules ask for what cannot be at once."""
    guard = dict(one.guard)
    if any(v in guard and not guard[v] & values for v, values in other.guard):
        return True
    return any(
        {*(p for p, _ in a.consume), *a.read} & set(b.inhibit)
        for a, b in ((one, other), (other, one))
    )


def outcomes_of(system: System) -> Mapping[int, tuple[int, ...]]:
    """By rule, the outcomes that it stands for: several, where it was made of several rules."""
    if any(rule.outcomes for rule in system.rules):
        return {rule.index: rule.outcomes for rule in system.rules}
    return {r.index: () if r.kind is Kind.JOIN else (r.index,) for r in system.rules}
