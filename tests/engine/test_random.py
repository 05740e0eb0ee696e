"""Random missions under random inputs: the invariants hold after every input."""

import builtins
import random
import time
import uuid
from collections.abc import Callable, Iterable
from random import Random
from typing import Any, NoReturn

import pytest
from hypothesis import HealthCheck, given, note, settings
from hypothesis import strategies as st

from m2pem.engine.run import MissionRun
from m2pem.mission.elements import ErrorPolicy
from tests.engine.kit import Play
from tests.engine.random_missions import graph, structured
from tests.engine.random_play import RandomPlay
from tests.engine.snapshot import snapshot
from tests.seeds import examples, seeds_for

DICE = st.randoms(use_true_random=False)

QUICK = settings(
    max_examples=examples(30, 100),
    deadline=None,
    suppress_health_check=list(HealthCheck),
    database=None,
)
FEW = 100
LONG_S = 600.0
BATCHES = (1, 2, 5, 100, 100)
GRAPH_BATCH = 20


def _forbidden(*_: Any, **__: Any) -> NoReturn:
    raise AssertionError("the engine is pure")


def played(
    text: str, choices: list[int], batch: int, on_error: ErrorPolicy = ErrorPolicy.END
) -> RandomPlay:
    """Play by numbers, with clock, randomness and files out of the engine's reach."""
    Play.made.clear()
    game = RandomPlay(text, batch, on_error)
    with pytest.MonkeyPatch.context() as patched:
        for module, name in (
            (time, "time"),
            (random, "random"),
            (uuid, "uuid4"),
            (builtins, "open"),
        ):
            patched.setattr(module, name, _forbidden)
        game.go(choices)
        game.finish()
    return game


def check_taken_up(play: Play, batch: int, place: int) -> None:
    """A run that is rebuilt after `place` inputs decides the others as the first one did."""
    taken_up = MissionRun(play.mission, play.fleet, "r1", batch)
    for step in play.steps[:place]:
        taken_up.replay(step.records)
    for step in play.steps[place:]:
        assert list(taken_up.receive(step.input, step.at_us).records) == list(step.records)
    assert snapshot(taken_up.state) == snapshot(play.run.state)


def structured_run(
    dice: Random, say: Callable[[str], object] = str, on_error: ErrorPolicy = ErrorPolicy.END
) -> None:
    text = structured(dice)
    say(text)
    choices = [dice.randrange(10_000) for _ in range(dice.randrange(40))]
    batch = dice.choice(BATCHES)
    game = played(text, choices, batch, on_error)
    play = game.play
    # An operator who moves a token may leave a join without one.
    moved = on_error is ErrorPolicy.INCIDENT
    assert moved or not play.detail.startswith("stuck"), play.detail
    if not play.ended:
        assert play.run.wants_continue or play.awaits()
    check_taken_up(play, batch, dice.randrange(len(play.steps)))
    game.end()
    play.verify()


def graph_run(
    dice: Random, say: Callable[[str], object] = str, on_error: ErrorPolicy = ErrorPolicy.END
) -> None:
    text = graph(dice)
    say(text)
    choices = [dice.randrange(10_000) for _ in range(dice.randrange(40))]
    game = played(text, choices, GRAPH_BATCH, on_error)
    play = game.play
    if play.ended == "failed":
        assert play.detail
    elif not play.ended:
        assert play.run.wants_continue or play.awaits()
    assert max(len(step.records) for step in play.steps) < 50_000
    check_taken_up(play, GRAPH_BATCH, dice.randrange(len(play.steps)))
    game.end()
    assert play.ended
    play.verify()


@given(DICE)
@QUICK
def test_structured_missions_keep_the_laws(dice: Random) -> None:
    structured_run(dice, note)


@given(DICE)
@QUICK
def test_any_graph_has_a_named_outcome(dice: Random) -> None:
    graph_run(dice, note)


RUNS = pytest.mark.parametrize("run", [structured_run, graph_run])


def run_seeds(run: Callable[[Random], None], seeds: Iterable[int]) -> None:
    """Evenly spread missions, where hypothesis prefers small ones."""
    for seed in seeds:
        try:
            run(Random(seed))
        except Exception as error:
            error.add_note(f"seed {seed}")
            raise


@RUNS
def test_some_missions_of_all_sizes(run: Callable[[Random], None]) -> None:
    run_seeds(run, range(FEW))


@pytest.mark.long
@pytest.mark.timeout(3600)
@RUNS
def test_many_missions_of_all_sizes(run: Callable[[Random], None]) -> None:
    run_seeds(run, seeds_for(LONG_S))
