"""Decisions around kills: a few rounds in `make test`, 200 in `make test-long`."""

import pytest
from msgspec.structs import replace

from m2pem.engine import records as r
from m2pem.engine.records import TokenOutcome
from tests.chaos.decision_missions import Reader
from tests.chaos.decisions import After, play_round, way_of
from tests.chaos.kill_points import SQLITE

SHORT = (2, 3, 8, 10, 14, 107)
"""With few kills each: `way_of` has both ways to go on, and both kinds of journals among them."""


@pytest.mark.parametrize(
    "seed",
    [each if each in SHORT else pytest.param(each, marks=pytest.mark.long) for each in range(201)],
)
def test_each_decision_around_a_kill_is_in_force_once(seed: int) -> None:
    played = play_round(seed, *way_of(seed))
    assert not played.faults, f"{played.kills}: {played.faults}"


_TOO_EARLY = """
import asyncio
from m2pem.executive.runner import Runner
commit = Runner._commit

async def answers_first(self, steps):
    for step in steps:
        self._answer_asker(step)
    await asyncio.sleep(0.1)  # the answer goes out
    await commit(self, steps)

Runner._commit = answers_first
"""


def test_the_judge_finds_what_was_acknowledged_too_early() -> None:
    played = play_round(9, After.RESTART, SQLITE.name, _TOO_EARLY)
    assert any("set_data" in each and "0 records" in each for each in played.faults), played


ENTERED = r.TokenEntered(1, "P", "Job", 1)
LEFT = r.TokenLeft(1, "P", "Job", 1, TokenOutcome.COMPLETED)
AWAITED = r.EventAwaited(1, "P", "Ev", 1, 1, r.base.Trigger.MESSAGE, "m")
TAKEN = r.EventTriggered(1, kept=True)
THROWN = r.MessageThrown("m", kept=True)


def test_the_reader_finds_what_happens_twice() -> None:
    assert Reader([ENTERED, LEFT, ENTERED]).faults == []
    assert "was on" in Reader([ENTERED, replace(ENTERED, element="Other")]).faults[0]
    assert "was not there" in Reader([ENTERED, LEFT, LEFT]).faults[0]
    assert Reader([THROWN, AWAITED, TAKEN]).faults == []
    assert "was over" in Reader([THROWN, AWAITED, TAKEN, TAKEN]).faults[0]
    again = [replace(each, wait=2) for each in (AWAITED, TAKEN)]
    assert "more often" in Reader([THROWN, AWAITED, TAKEN, *again]).faults[0]
