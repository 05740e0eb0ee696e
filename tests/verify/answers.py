"""Answers about a mission, or a net without one, with and without reduction."""

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random
from types import SimpleNamespace

from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission
from m2pem.verify.ltl import formula as f
from m2pem.verify.ltl import propositions
from m2pem.verify.ltl.model_check import Result, check
from m2pem.verify.net.petri_net import Action, Kind, PetriNet, Role
from m2pem.verify.net.simplify import simplify
from m2pem.verify.requirements.check import Answer, check_requirement, net_for, reduction_for
from m2pem.verify.requirements.propositions import ExploredRuns, Labels
from m2pem.verify.requirements.requirement import Requirement
from m2pem.verify.search.explore import Exploration, Limits, explore
from m2pem.verify.search.stubborn_sets import StubbornSets
from m2pem.verify.translate import Options

FEW = Limits(states=1_500, tokens=3, seconds=1e9)
NO_FEWER = Limits(states=2 * FEW.states, tokens=3, seconds=1e9)
"""For what must be seen whole: a search may see a few more than its limit before it stops."""


def atoms_of(dice: Random, net: PetriNet, count: int = 3) -> list[f.Formula]:
    """Some things that may be true in the net."""
    active = sorted({p.element for p in net.places if p.role is not Role.END})
    done = [
        step.element
        for transition in net.transitions
        for step in transition.steps
        if step.action is Action.COMPLETED
        and (transition.kind is Kind.EXTERNAL or dice.random() < 0.3)
    ]
    found: list[f.Formula] = []
    for _ in range(count):
        if done and dice.random() < 0.7:
            found.append(f.Completed(dice.choice(sorted(done))))
        else:
            found.append(f.Active(dice.choice(active)))
    return found


def formula_of(dice: Random, atoms: list[f.Formula], depth: int = 3) -> f.Formula:
    """A random formula in which no single steps are told apart; some that people write."""
    a, b, c = (dice.choice(atoms) for _ in range(3))
    if depth == 3 and dice.random() < 0.5:
        return dice.choice(
            (
                f.Always(f.Implies(a, f.Eventually(b))),
                f.WeakUntil(f.Not(a), b),
                f.Always(f.Not(f.And((a, b)))),
                f.Eventually(a),
                f.Eventually(f.And((a, f.Eventually(b)))),
                f.Always(f.Implies(a, f.Always(f.Not(b)))),
                f.Always(f.Implies(a, f.Always(f.Not(b)))),
                f.Always(f.Eventually(a)),
                f.Eventually(f.Always(f.Not(a))),
                f.Always(f.Implies(a, f.WeakUntil(f.Not(b), c))),
                f.Always(f.Implies(a, f.Once(b))),
                f.Implies(f.Always(f.Eventually(a)), f.Always(f.Eventually(b))),
                f.Always(f.Implies(a, f.Or((f.Eventually(b), f.Always(c))))),
                f.Always(f.Implies(a, f.Since(f.Not(b), c))),
                f.Always(f.Count((a,), "<=", 1)),
            )
        )
    if not depth or dice.random() < 0.15:
        return a
    one, other = (formula_of(dice, atoms, depth - 1) for _ in range(2))
    return dice.choice(
        (
            f.Not(one),
            f.And((one, other)),
            f.Or((one, other)),
            f.Implies(one, other),
            f.Always(one),
            f.Always(one),
            f.Eventually(one),
            f.Eventually(one),
            f.Until(one, other),
            f.WeakUntil(one, other),
        )
    )


@dataclass(frozen=True, slots=True)
class Both:
    """What both searches answer; None: it is too large to be searched whole."""

    whole: Exploration
    reduced: Exploration
    answers: tuple[Result, Result]


def labels_of(net: PetriNet, formula: f.Formula) -> Labels:
    world = SimpleNamespace(elements={}), SimpleNamespace(teams={})
    return Labels(net, *world, propositions(formula))  # type: ignore[arg-type]


def both(net: PetriNet, formula: f.Formula, whole: Exploration | None = None) -> Both | None:
    """The formula's answers without and with reduction."""
    whole = whole or explore(net, FEW)
    if not whole.complete:
        return None
    labels = labels_of(net, formula)
    answers = [check(ExploredRuns(whole, labels), formula).result]
    small = simplify(net, labels.visible_places(), labels.visible_transitions())
    labels = labels_of(small, formula)
    reduced = explore(small, NO_FEWER, reduction=StubbornSets(small, labels.visible_transitions()))
    answers.append(check(ExploredRuns(reduced, labels), formula).result)
    return Both(whole, reduced, (answers[0], answers[1]))


def check_mission(
    mission: Mission,
    fleet: Fleet,
    requirements: Sequence[Requirement],
    *,
    process: str | None = None,
    options: Options | None = None,
    limits: Limits | None = None,
    reduce: bool = False,
) -> list[Answer]:
    """Translate, explore and check in one call.

    With `reduce`, a reduction is used for requirements that allow one.
    """
    net = net_for(mission, fleet, requirements, process=process, options=options)
    whole: Exploration | None = None
    answers = []
    for each in requirements:
        reduction = reduction_for(net, mission, fleet, each) if reduce else None
        if reduction is not None:
            found = explore(net, limits, reduction=reduction)
        else:
            found = whole = whole or explore(net, limits)
        answers.append(check_requirement(found, mission, fleet, each))
    return answers
