"""Random missions with compensation and transactions: the invariants hold after every input."""

from collections.abc import Callable, Iterable
from random import Random

import pytest

from tests.engine.random_compensation import with_compensation
from tests.engine.random_missions import graph, structured
from tests.engine.random_play import RandomPlay
from tests.engine.test_random import BATCHES, check_taken_up
from tests.seeds import seeds_for

FEW = 25
LONG_S = 300.0


def run(make: Callable[[Random], str], dice: Random) -> None:
    mission, text = with_compensation(make(dice), dice)
    batch = dice.choice(BATCHES)
    game = RandomPlay(mission, batch)
    game.go([dice.randrange(10_000) for _ in range(dice.randrange(40))])
    game.finish()
    play = game.play
    try:
        if not play.ended:
            assert play.run.wants_continue or play.awaits()
        if make is structured:
            assert not play.detail.startswith("stuck"), play.detail
        check_taken_up(play, batch, dice.randrange(len(play.steps)))
        game.end()
        play.verify()
    except Exception as error:
        error.add_note(text)
        raise


def run_seeds(make: Callable[[Random], str], seeds: Iterable[int]) -> None:
    for seed in seeds:
        try:
            run(make, Random(seed))
        except Exception as error:
            error.add_note(f"seed {seed}")
            raise


KINDS = pytest.mark.parametrize("make", [structured, graph])


@KINDS
def test_some_missions_keep_the_laws(make: Callable[[Random], str]) -> None:
    run_seeds(make, range(FEW))


@pytest.mark.long
@pytest.mark.timeout(3600)
@KINDS
def test_many_missions_keep_the_laws(make: Callable[[Random], str]) -> None:
    run_seeds(make, seeds_for(LONG_S))
