"""Random missions are revised to others while they run: no token is left without a place."""

from collections import Counter
from collections.abc import Callable
from random import Random

import pytest
from hypothesis import HealthCheck, given, note, settings
from hypothesis import strategies as st

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.revision import RevisionPlan, plan_revision
from m2pem.engine.state import RunStatus
from m2pem.mission.elements import ErrorPolicy
from m2pem.mission.mission import Mission
from tests.engine.invariants import check_bound
from tests.engine.kit import Play
from tests.engine.notation import mission, xml
from tests.engine.random_missions import graph, structured
from tests.engine.random_play import RandomPlay
from tests.engine.random_revisions import changed
from tests.engine.snapshot import snapshot
from tests.engine.test_random import BATCHES, GRAPH_BATCH, run_seeds
from tests.engine.ways_out import check_ways_out
from tests.seeds import examples, seeds_for

DICE = st.randoms(use_true_random=False)
QUICK = settings(
    max_examples=examples(30, 100),
    deadline=None,
    suppress_health_check=list(HealthCheck),
    database=None,
)
FEW = 150
LONG_S = 600.0
ROUNDS = 6
OFFERED: Counter[str] = Counter()
"""How many ways out were tried: to go elsewhere, and to end."""


def another(dice: Random, text: str, now: Mission) -> Mission | None:
    """Another version: a changed one, or quite another mission."""
    if dice.random() < 0.15:
        return mission(graph(dice) if "n1" in text else structured(dice))
    return changed(now.source if dice.random() < 0.8 else xml(text).encode(), dice)


def with_moves(game: RandomPlay, new: Mission, dice: Random) -> tuple[RevisionPlan, dict[str, str]]:
    """A plan of a revision; tokens that it refuses are moved as it says, if that helps."""
    moves: dict[str, str] = {}
    state, now_us = game.play.run.state, game.play.now_us
    if state.tokens and dice.random() < 0.2:
        token = dice.choice(list(state.tokens.values()))
        moves[token.node.id] = dice.choice(list(new.elements))
    for _ in range(ROUNDS):
        plan = plan_revision(state, new, moves, now_us)
        again = plan_revision(state, new, moves, now_us)
        assert again == plan or again.digest == plan.digest
        if not plan.refusals:
            return plan, moves
        OFFERED.update(check_ways_out(state, new, plan, moves, now_us))
        for refusal in plan.refusals:
            assert refusal.text
            if refusal.token and refusal.element not in moves:
                moves[refusal.element] = dice.choice((*refusal.candidates[:3], ""))
            elif refusal.element in moves and not refusal.token:
                del moves[refusal.element]
            elif refusal.element in moves:
                moves[refusal.element] = ""
    return plan, moves


def revised(game: RandomPlay, new: Mission, dice: Random) -> bool:
    """Revise the run. False: it was refused, and nothing has changed."""
    play = game.play
    before = snapshot(play.run.state)
    plan, moves = with_moves(game, new, dice)
    assert snapshot(play.run.state) == before, "a plan changes nothing"
    item = i.Revise(plan.version, "new.bpmn", new.source, plan.digest, new.library, moves, "ann")
    game.give(item)
    state = play.run.state
    if plan.refusals or plan.version == plan.previous:
        if plan.refusals:
            step = next(each for each in reversed(play.steps) if each.input is item)
            why = [each.reason for each in step.records if isinstance(each, r.InputIgnored)]
            assert any("refused" in each or "while the run" in each for each in why), step.records
        return False
    check_bound(state)
    assert state.mission.source == new.source
    return True


def one(make: Callable[[Random], str], dice: Random, say: Callable[[str], object] = str) -> int:
    """Play a mission that is revised up to three times. Returns how often it was."""
    text = make(dice)
    say(text)
    Play.made.clear()
    on_error = dice.choice((ErrorPolicy.END, ErrorPolicy.INCIDENT))
    batch = GRAPH_BATCH if make is graph else dice.choice(BATCHES)
    game = RandomPlay(text, batch, on_error)
    game.go([dice.randrange(10_000) for _ in range(dice.randrange(15))])
    state = game.play.run.state
    done = 0
    for _ in range(3):
        if state.status is RunStatus.ENDED:
            break
        new = another(dice, text, state.mission)
        if new is not None:
            say(new.source.decode())
            done += revised(game, new, dice)
        game.go_on([dice.randrange(10_000) for _ in range(dice.randrange(8))])
    game.finish()
    game.end()
    game.play.verify()
    return done


@given(DICE)
@QUICK
def test_structured_missions_are_revised(dice: Random) -> None:
    one(structured, dice, note)


@given(DICE)
@QUICK
def test_graphs_are_revised(dice: Random) -> None:
    one(graph, dice, note)


MAKES = pytest.mark.parametrize("make", [structured, graph])


@MAKES
def test_some_missions_of_all_sizes_are_revised(make: Callable[[Random], str]) -> None:
    done: list[int] = []
    OFFERED.clear()
    run_seeds(lambda dice: done.append(one(make, dice)), range(FEW))
    assert sum(done) > FEW / 3, "most revisions are carried out"
    assert min(OFFERED["go"], OFFERED["end"]) > FEW / 3, "most refusals have ways out"


@pytest.mark.long
@pytest.mark.timeout(3600)
@MAKES
def test_many_missions_of_all_sizes_are_revised(make: Callable[[Random], str]) -> None:
    done: list[int] = []
    run_seeds(lambda dice: done.append(one(make, dice)), seeds_for(LONG_S))
