"""Random missions under random inputs: the laws hold whatever happens."""

import builtins
import random
import time
import uuid
from typing import Any, NoReturn

import pytest
from hypothesis import HealthCheck, given, note, settings
from hypothesis import strategies as st

from m2pem.engine.run import MissionRun
from m2pem.errors import MissionError
from tests.engine.kit import Play
from tests.engine.random_missions import graphs, structured
from tests.engine.random_play import RandomPlay
from tests.engine.snapshot import snapshot

CHOICES = st.lists(st.integers(0, 10_000), max_size=25)
BATCHES = st.sampled_from([1, 2, 5, 100, 100])

QUICK = settings(
    max_examples=150, deadline=None, suppress_health_check=list(HealthCheck), database=None
)
LONG = settings(QUICK, max_examples=20_000)


def _forbidden(*_: Any, **__: Any) -> NoReturn:
    raise AssertionError("the engine is pure")


def played(text: str, choices: list[int], batch: int) -> RandomPlay:
    """Play by numbers, with clock, randomness and files out of the engine's reach."""
    Play.made.clear()
    game = RandomPlay(text, batch)
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


def check_taken_up(play: Play, place: int) -> None:
    """A run that is rebuilt after `place` inputs decides the others as the first one did."""
    taken_up = MissionRun(play.mission, play.fleet, "r1", play.run._x.batch)
    for step in play.steps[:place]:
        taken_up.replay(step.records)
    for step in play.steps[place:]:
        assert list(taken_up.receive(step.input, step.at_us).records) == list(step.records)
    assert snapshot(taken_up.state) == snapshot(play.run.state)


def structured_run(text: str, choices: list[int], batch: int) -> None:
    note(text)
    game = played(text, choices, batch)
    play = game.play
    assert not play.detail.startswith("stuck"), play.detail
    if not play.ended:
        assert play.run.wants_continue or play.awaits()
        assert not play.run.state.behaviors or play.run.wants_continue or all_cancelling(play)
    check_taken_up(play, len(play.steps) // 2)
    game.end()
    play.verify()


def all_cancelling(play: Play) -> bool:
    return all(b.phase.value == "cancelling" for b in play.run.state.behaviors.values())


def graph_run(text: str, choices: list[int], batch: int) -> None:
    note(text)
    try:
        game = played(text, choices, batch)
    except MissionError:
        return  # the reader refuses it
    play = game.play
    if play.ended == "failed":
        assert play.detail
    elif not play.ended:
        assert play.run.wants_continue or play.awaits()
    assert max(len(step.records) for step in play.steps) < 50_000
    check_taken_up(play, len(play.steps) // 2)
    game.end()
    assert play.ended
    play.verify()


@given(structured(), CHOICES, BATCHES)
@QUICK
def test_structured_missions_keep_the_laws(text: str, choices: list[int], batch: int) -> None:
    structured_run(text, choices, batch)


@given(graphs(), CHOICES, st.just(20))
@QUICK
def test_any_graph_has_a_named_outcome(text: str, choices: list[int], batch: int) -> None:
    graph_run(text, choices, batch)


@pytest.mark.long
@pytest.mark.timeout(3600)
@given(structured(), CHOICES, BATCHES)
@LONG
def test_many_structured_missions_keep_the_laws(text: str, choices: list[int], batch: int) -> None:
    structured_run(text, choices, batch)


@pytest.mark.long
@pytest.mark.timeout(3600)
@given(graphs(), CHOICES, st.just(20))
@LONG
def test_many_graphs_have_a_named_outcome(text: str, choices: list[int], batch: int) -> None:
    graph_run(text, choices, batch)
