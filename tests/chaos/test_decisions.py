"""Decisions around kills: a few rounds in `make test`, 200 in `make test-long`."""

import pytest
from msgspec.structs import replace

from m2pem.engine import records as r
from m2pem.engine.records import TokenOutcome
from tests.chaos.decision_missions import Decision, Reader
from tests.chaos.decisions import differences, faults_of, play_round, way_of

SHORT = (2, 3, 8, 14, 106, 107)
"""With few kills each: `way_of` has both ways to go on, and both kinds of journals among them."""


@pytest.mark.parametrize(
    "seed",
    [each if each in SHORT else pytest.param(each, marks=pytest.mark.long) for each in range(201)],
)
def test_each_decision_around_a_kill_is_in_force_once(seed: int) -> None:
    played = play_round(seed, *way_of(seed))
    assert not played.faults, f"{played.kills}: {played.faults}"


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


def test_the_judge_finds_what_was_acknowledged_and_is_lost_or_was_done_twice() -> None:
    skip = Decision("resolve", "Job", "skip")
    once, again = (
        r.IncidentResolved(1, "P", "Job", 1, "r1.i1", "skip", by) for by in ("d0a0", "d0a1")
    )
    assert faults_of(skip, [("d0a0", "done")], [once]) == []
    assert faults_of(skip, [("d0a0", "lost"), ("d0a1", "refused: late")], [once]) == []
    assert faults_of(skip, [("d0a0", "lost"), ("d0a1", "done")], [again]) == []
    assert "0 records" in faults_of(skip, [("d0a0", "done")], [])[0]
    assert "2 records" in faults_of(skip, [("d0a0", "lost"), ("d0a1", "done")], [once, again])[0]
    assert "1 records" in faults_of(skip, [("d0a0", "refused: no")], [once])[0]


def test_the_judge_compares_with_the_run_without_kills() -> None:
    claimed = r.RunClaimed(2)
    assert differences([ENTERED, claimed, LEFT], [ENTERED, LEFT]) == []
    assert "1 times more" in differences([ENTERED, LEFT, ENTERED], [ENTERED, LEFT])[0]
    assert "1 times less" in differences([ENTERED], [ENTERED, LEFT])[0]
