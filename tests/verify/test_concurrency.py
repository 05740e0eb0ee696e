"""What the structure proves about places and transitions is so in every run."""

from collections.abc import Callable
from dataclasses import replace
from random import Random

import pytest

from m2pem.verify.net.concurrency import Concurrency
from m2pem.verify.net.petri_net import PetriNet
from m2pem.verify.net.simplify import simplify
from m2pem.verify.search.explore import Limits, explore
from tests.verify.random_mission_nets import random_mission_net
from tests.verify.random_nets import random_net
from tests.verify.test_overfull import START, WORK, fills

SMALL = Limits(states=1_000, tokens=3)


def proves_nothing_wrong(net: PetriNet) -> None:
    found, proven = explore(net, SMALL), Concurrency(net)
    assert not proven.single & found.overflows.keys()
    assert all(proven.may_fire(net.transitions[number]) for number in found.fired)


@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("made", [random_net, random_mission_net])
def test_nothing_that_happens_was_ruled_out(made: Callable[[Random], PetriNet], seed: int) -> None:
    proves_nothing_wrong(made(Random(seed)))


@pytest.mark.parametrize("seed", range(40))
def test_what_was_proven_is_so_of_the_simplified_transitions(seed: int) -> None:
    small = simplify(random_mission_net(Random(seed)))
    assert small.single is not None
    assert not small.single & explore(small, SMALL).overflows.keys()


def test_a_token_that_comes_beside_one_that_moves_makes_two() -> None:
    both = fills((START, 1), (WORK, 1))
    moving = replace(both.transitions[0], produce=((WORK, 1),), moves=((START, WORK),), consume=())
    net = replace(both, transitions=(replace(moving, read=(START,)), both.transitions[1]))
    assert WORK in explore(net, SMALL).overflows
    assert WORK not in Concurrency(net).single
