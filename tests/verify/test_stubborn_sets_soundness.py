"""On random nets, what is left out of a search changes neither properties nor requirements."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from random import Random

import pytest

from m2pem.verify.ltl.formula import needs_steps
from m2pem.verify.ltl.model_check import Result
from m2pem.verify.net import concurrency
from m2pem.verify.net.petri_net import PetriNet
from m2pem.verify.search.explore import Exploration, Limits, explore
from m2pem.verify.search.stubborn_sets import StubbornSets
from m2pem.verify.translate import translate
from tests.engine.notation import mission as notation
from tests.engine.random_missions import graph, structured
from tests.seeds import seeds_for
from tests.verify.answers import FEW, NO_FEWER, atoms_of, both, formula_of
from tests.verify.random_keeping import keeping
from tests.verify.random_mission_nets import random_mission_net
from tests.verify.random_needs import branches_with_needs, net_of
from tests.verify.random_nets import random_net

Make = Callable[[Random], PetriNet]
FORMULAS = 5
LONG_S = 240.0
SMALL = replace(FEW, states=600)
"""Of the short tests: larger ones take most of the time and find no more."""
MOST_TRANSITIONS = 2_000
"""Of a net that is looked at; some random missions have very many."""
ODD_TRANSITIONS, ODD_MISSIONS = (221126029,), (655301641,)
"""Seeds at which an answer was wrong once."""


def nets(dice: Random) -> PetriNet:
    return random_mission_net(dice, 16)


def sound_nets(dice: Random) -> PetriNet:
    return random_mission_net(dice, 20, spoilt=0)


def failing_nets(dice: Random) -> PetriNet:
    return random_mission_net(dice, 14, failing=True)


def transitions(dice: Random) -> PetriNet:
    made = random_net(dice, 12, 14)
    start = sorted(dice.sample(range(3, 15), 5))
    return replace(made, initial=tuple((place, 1) for place in start))


def missions(dice: Random) -> PetriNet:
    return translate(notation(dice.choice([structured, graph])(dice)))


def needs(dice: Random) -> PetriNet:
    return net_of(notation(branches_with_needs(dice)))


def keepings(dice: Random) -> PetriNet:
    return net_of(notation(keeping(dice)))


def seen(found: Exploration) -> tuple[object, ...]:
    """What the properties of every mission are read from."""
    return {found.states[n] for n in found.terminals}, set(found.fired)


def compare(make: Make, seed: int, count: Counter[str], limits: Limits = FEW) -> list[str]:
    """What differs; `count` says what was compared."""
    dice = Random(seed)
    net = make(dice)
    if len(net.transitions) > MOST_TRANSITIONS:
        return []
    whole = explore(net, limits)
    if not whole.complete:
        return []
    count["systems"] += 1
    wrong = []
    less = explore(net, NO_FEWER, reduction=StubbornSets(net))
    if bool(whole.overflows) != bool(less.overflows):
        wrong.append(f"{seed}: a second token")
    elif not whole.overflows and seen(whole) != seen(less):
        wrong.append(f"{seed}: states or rules")
    kinds = {
        "unsafe": bool(whole.overflows),
        "circles": any(
            after <= n for n in range(len(whole.states)) for _, after in _steps(whole, n)
        ),
        "interrupted": sum(len(transition.reset) > 2 for transition in net.transitions) > 1,
    }
    count.update(name for name, found in kinds.items() if found)
    for _ in range(FORMULAS):
        formula = formula_of(dice, atoms_of(dice, net))
        if needs_steps(formula):
            continue
        found = both(net, formula, whole)
        assert found is not None
        count["formulas"] += 1
        count["smaller"] += len(found.reduced.states) < len(found.whole.states)
        count["violated"] += found.answers[0] is Result.VIOLATED
        if found.answers[0] is not found.answers[1]:
            wrong.append(f"{seed}: {formula}: {found.answers}")
    return wrong


def _steps(found: Exploration, number: int) -> list[tuple[int, int]]:
    return list(found.successors(number))


@pytest.fixture(params=["proven", "too large to prove"])
def places(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether it is known of each place how many tokens it may have, and beside which others."""
    if request.param != "proven":
        monkeypatch.setattr(concurrency, "MOST_PLACES", 0)


@pytest.mark.usefixtures("places")
@pytest.mark.parametrize(
    ("make", "models"),
    [
        (nets, 10),
        (sound_nets, 12),
        (failing_nets, 12),
        (transitions, 45),
        (missions, 10),
        (needs, 3),
        (keepings, 4),
    ],
)
def test_nothing_that_can_be_asked_is_answered_otherwise(make: Make, models: int) -> None:
    count: Counter[str] = Counter()
    assert not [each for seed in range(models) for each in compare(make, seed, count, SMALL)]
    assert count["systems"] > models / 3
    assert 0 < count["violated"] < count["formulas"]
    # What makes leaving things out hard is among them.
    assert min(count["smaller"], count["circles"], count["interrupted"]) > 0
    assert count["unsafe"] or make is not transitions


@pytest.mark.usefixtures("places")
@pytest.mark.parametrize(
    ("make", "seed"),
    [
        *((transitions, each) for each in ODD_TRANSITIONS),
        *((missions, each) for each in ODD_MISSIONS),
    ],
)
def test_nor_of_odd_models(make: Make, seed: int) -> None:
    assert compare(make, seed, Counter()) == []


@pytest.mark.long
@pytest.mark.timeout(3_600)
@pytest.mark.usefixtures("places")
@pytest.mark.parametrize(
    "make", [nets, sound_nets, failing_nets, transitions, missions, needs, keepings]
)
def test_nor_of_very_many_models(make: Make) -> None:
    count: Counter[str] = Counter()
    assert not [each for seed in seeds_for(LONG_S) for each in compare(make, seed, count)]
