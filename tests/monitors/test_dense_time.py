"""Formulas with bounds, judged by their definition at each time that can make a difference."""

from random import Random

import pytest

from m2pem.monitors.anticipation import Verdict
from m2pem.monitors.timed import TimedEvaluation, TimedPlan, base_propositions
from m2pem.verify.ltl.formula import (
    Active,
    Always,
    And,
    Eventually,
    Formula,
    Not,
    Or,
    Timed,
    Until,
)

ATOMS = (Active("a"), Active("b"))
Timeline = list[tuple[int, frozenset[Formula]]]
"""When moments begin, in microseconds, and what is true in each."""


def random_formula(dice: Random, depth: int) -> Formula:
    """A formula whose operators of the future all have bounds."""
    if depth == 0 or dice.random() < 0.2:
        atom: Formula = dice.choice(ATOMS)
        return atom if dice.random() < 0.7 else Not(atom)
    low = dice.choice((0, 0, 1, 2))
    high = low + dice.choice((0, 1, 3))
    inner = [random_formula(dice, depth - 1) for _ in range(2)]
    kinds: tuple[Formula, ...] = (
        Timed(Eventually(inner[0]), low, high),
        Timed(Always(inner[0]), low, high),
        Timed(Until(inner[0], inner[1]), low, high),
        And((inner[0], inner[1])),
        Or((inner[0], inner[1])),
        Not(inner[0]),
    )
    return dice.choice(kinds)


def random_timeline(dice: Random) -> Timeline:
    """Moments at whole microseconds, some at the same time."""
    at = 0
    found: Timeline = []
    for _ in range(dice.randint(1, 5)):
        found.append((at, frozenset(each for each in ATOMS if dice.random() < 0.5)))
        at += dice.choice((0, 1, 1, 2, 4))
    return found


class Definition:
    """The truth of a formula by the definition of MTL, position by position.

    A position is a time in half microseconds and a moment that has it: an odd number is any time
    between two whole ones. The last moment remains for ever, of which `length` is enough.
    """

    def __init__(self, timeline: Timeline, length: int) -> None:
        ends = [2 * begin for begin, _ in timeline[1:]] + [2 * (timeline[-1][0] + length)]
        self.positions = [
            (time, true)
            for (begin, true), end in zip(timeline, ends, strict=True)
            for time in range(2 * begin, end + 1)
        ]
        self.known: dict[tuple[Formula, int], bool] = {}

    def holds(self, formula: Formula, at: int) -> bool:
        key = (formula, at)
        if key not in self.known:
            self.known[key] = self._holds(formula, at)
        return self.known[key]

    def _holds(self, formula: Formula, at: int) -> bool:
        match formula:
            case Not(operand):
                return not self.holds(operand, at)
            case And(operands):
                return all(self.holds(each, at) for each in operands)
            case Or(operands):
                return any(self.holds(each, at) for each in operands)
            case Timed(Eventually(operand), low, high):
                return any(self.holds(operand, each) for each in self._within(at, low, high))
            case Timed(Always(operand), low, high):
                return all(self.holds(operand, each) for each in self._within(at, low, high))
            case Timed(Until(left, right), low, high):
                return any(
                    self.holds(right, each)
                    and all(self.holds(left, before) for before in range(at, each))
                    for each in self._within(at, low, high)
                )
            case _:
                return formula in self.positions[at][1]

    def _within(self, at: int, low: int, high: int) -> list[int]:
        begin = self.positions[at][0]
        return [
            each
            for each in range(at, len(self.positions))
            if 2 * low <= self.positions[each][0] - begin <= 2 * high
        ]


def verdicts(formula: Formula, timeline: Timeline, *, punctual: bool) -> list[tuple[int, Verdict]]:
    """The verdicts as time passes, then the final one. `punctual`: time also passes between."""
    evaluation = TimedEvaluation(TimedPlan(formula))
    base = base_propositions(formula)
    found = []
    for at, true in timeline:
        while punctual and evaluation.due_us is not None and evaluation.due_us <= at:
            due = evaluation.due_us
            found.append((due, evaluation.advance(due)))
        letter = sum(1 << n for n, each in enumerate(base) if each in true)
        found.append((at, evaluation.read(at, letter)))
    found.append((timeline[-1][0] + 1_000, evaluation.end()))
    return found


def judged(seed: int) -> None:
    dice = Random(seed)
    inner, timeline = random_formula(dice, 3), random_timeline(dice)
    wrappers = {
        "now": lambda each: each,
        "always": Always,
        "at some time": Eventually,
    }
    for name, wrap in wrappers.items():
        definition = Definition(timeline, 60)
        settled = 2 * (timeline[-1][0] + 25)
        every = [n for n, (time, _) in enumerate(definition.positions) if time <= settled]
        values = [definition.holds(inner, each) for each in every]
        expected = {"now": values[0], "always": all(values), "at some time": any(values)}[name]
        final = Verdict.SATISFIED if expected else Verdict.VIOLATED
        for punctual in (False, True):
            found = [each for _, each in verdicts(wrap(inner), timeline, punctual=punctual)]
            assert found[-1] is final, (seed, name, wrap(inner), timeline)
            assert set(found) <= {Verdict.OPEN, final}, (seed, name, wrap(inner), timeline)


@pytest.mark.parametrize(
    "seeds",
    [range(150), pytest.param(range(150, 20_000), marks=[pytest.mark.long])],
    ids=["some", "many"],
)
@pytest.mark.timeout(3_600)
def test_verdicts_are_those_of_the_definition(seeds: range) -> None:
    for seed in seeds:
        judged(seed)
