"""Verdicts on formulas with bounds, judged by RTAMT, a monitor of signal temporal logic.

RTAMT differs in two things. The ends of intervals belong to other ones, so moments begin at times
that no bound of a formula meets. And `f U g` needs f also when g comes: what m2pem means by it from
now on is `(f or g) U g` there; with a later beginning `test_dense_time.py` judges it.
"""

from random import Random

import pytest

from m2pem.monitors.anticipation import Verdict
from m2pem.monitors.timed import TimedEvaluation, TimedPlan
from m2pem.units import US_PER_S
from m2pem.verify.ltl import show
from m2pem.verify.ltl.formula import (
    Active,
    Always,
    And,
    Eventually,
    Formula,
    Implies,
    Not,
    Or,
    Timed,
    Until,
)

rtamt = pytest.importorskip("rtamt", reason="its parser needs a Python older than 3.13")

ATOMS = (Active("a"), Active("b"), Active("c"))
Timeline = list[tuple[int, frozenset[Formula]]]
"""When moments begin, in microseconds, and what is true in each."""

LONGEST_S = 60
"""More than all bounds of a formula together."""


def random_formula(dice: Random, depth: int) -> Formula:
    """A formula whose operators of the future all have bounds, of whole seconds."""
    if depth == 0 or dice.random() < 0.15:
        atom: Formula = dice.choice(ATOMS)
        return atom if dice.random() < 0.7 else Not(atom)
    low = dice.choice((0, 0, 0, 1, 2)) * US_PER_S
    high = low + dice.choice((1, 3, 5)) * US_PER_S
    one, two = (random_formula(dice, depth - 1) for _ in range(2))
    kinds: tuple[Formula, ...] = (
        Timed(Eventually(one), low, high),
        Timed(Always(one), low, high),
        Timed(Until(one, two), 0, high),
        And((one, two)),
        Or((one, two)),
        Implies(one, two),
        Not(one),
    )
    return dice.choice(kinds)


def random_timeline(dice: Random) -> Timeline:
    """Moments at whole microseconds, the first at 0."""
    at = 0
    found: Timeline = []
    for _ in range(dice.randint(1, 12)):
        found.append((at, frozenset(each for each in ATOMS if dice.random() < 0.5)))
        at += dice.randint(1, 3 * US_PER_S)
    return found


def in_stl(formula: Formula) -> str:
    """The formula as RTAMT writes it; each proposition is a signal that is 1 or -1."""
    match formula:
        case Active(element):
            return f"({element} > 0)"
        case Not(operand):
            return f"not({in_stl(operand)})"
        case And((left, right)):
            return f"(({in_stl(left)}) and ({in_stl(right)}))"
        case Or((left, right)):
            return f"(({in_stl(left)}) or ({in_stl(right)}))"
        case Implies(left, right):
            return f"(({in_stl(left)}) implies ({in_stl(right)}))"
        case Timed(operand, low, high):
            bounds = f"[{low // US_PER_S}:{high // US_PER_S}]"
        case _:
            operand, bounds = formula, ""
    match operand:
        case Eventually(inner):
            return f"eventually{bounds}({in_stl(inner)})"
        case Always(inner):
            return f"always{bounds}({in_stl(inner)})"
        case Until(left, right):
            return f"(({in_stl(Or((left, right)))}) until{bounds} ({in_stl(right)}))"
    raise TypeError(show(formula))


def judged_by_rtamt(formula: Formula, timeline: Timeline) -> Verdict:
    """The last moment remains, for longer than all bounds."""
    monitor = rtamt.StlDenseTimeSpecification()
    for atom in ATOMS:
        monitor.declare_var(atom.element, "float")
    monitor.spec = in_stl(formula)
    monitor.parse()
    end_s = timeline[-1][0] / US_PER_S + LONGEST_S
    signals = []
    for atom in ATOMS:
        samples = [[at / US_PER_S, 1.0 if atom in true else -1.0] for at, true in timeline]
        signals.append([atom.element, [*samples, [end_s, samples[-1][1]]]])
    robustness = monitor.evaluate(*signals)[0][1]
    return Verdict.SATISFIED if robustness > 0 else Verdict.VIOLATED


def judged(formula: Formula, timeline: Timeline) -> Verdict:
    """By the monitor of m2pem, which has every deadline."""
    plan = TimedPlan(formula)
    evaluation = TimedEvaluation(plan)
    for at, true in timeline:
        while (due := evaluation.due_us) is not None and due <= at:
            evaluation.advance(due)
        evaluation.read(at, sum(1 << n for n, each in enumerate(plan.base) if each in true))
    return evaluation.end()


@pytest.mark.parametrize(
    "seeds",
    [range(300), pytest.param(range(300, 10_000), marks=[pytest.mark.long])],
    ids=["some", "many"],
)
@pytest.mark.timeout(3_600)
@pytest.mark.tried_with(
    "RTAMT",
    "judges random runs by random requirements",
    kind="Recordings and analysis",
    result="the same verdicts",
    package="rtamt",
)
def test_verdicts_on_whole_runs_are_those_of_rtamt(seeds: range) -> None:
    found = set()
    for seed in seeds:
        dice = Random(seed)
        inner, timeline = random_formula(dice, 3), random_timeline(dice)
        formula = dice.choice((inner, Always(inner), Eventually(inner)))
        verdict = judged(formula, timeline)
        assert verdict is judged_by_rtamt(formula, timeline), (seed, show(formula), timeline)
        found.add((type(formula), verdict))
    assert len(found) > 8
