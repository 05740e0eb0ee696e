"""The judge finds what must not be."""

import asyncio
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from tests.chaos.judge import End, Verdict, judge
from tests.chaos.kill_points import SQLITE
from tests.chaos.rounds import Evidence, Kill, Plan, Play, play_round
from tests.chaos.worlds import Begun, SimulatedVehicles


@pytest.fixture(scope="module")
def evidence(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Evidence]:
    """Of a round with no kill."""
    plan = Plan(0, SimulatedVehicles.name, SQLITE.name, ())
    play = Play(plan, tmp_path_factory.mktemp("round"))
    try:
        asyncio.run(play.whole())
        yield play.evidence()
    finally:
        play.close()


@dataclass
class Noted:
    """Vehicles that have noted something else."""

    world: SimulatedVehicles
    notes: Sequence[Begun]

    @property
    def missions(self) -> object:
        return self.world.missions

    def begun(self) -> Sequence[Begun]:
        return self.notes


def judged(evidence: Evidence, expected: dict[str, End] | None = None) -> Verdict:
    return asyncio.run(judge(evidence, expected))


def noted(evidence: Evidence, notes: Sequence[Begun]) -> str:
    world = Noted(evidence.world, notes)  # type: ignore[arg-type]
    (fault,) = judged(replace(evidence, world=world)).faults  # type: ignore[arg-type]
    return fault


def test_a_round_with_no_kill_has_no_fault(evidence: Evidence) -> None:
    verdict = judged(evidence)
    assert verdict.faults == []
    assert verdict.begun == verdict.requested == 9
    assert {end for end, _ in verdict.ends.values()} == {"completed"}
    assert judged(evidence, verdict.ends).faults == []


def test_a_behavior_that_began_twice_is_a_fault(evidence: Evidence) -> None:
    first, *others = evidence.world.begun()
    fault = noted(evidence, [first, first, *others])
    assert fault == f"{first.behavior} was begun 2 times, and restarted 0"


def test_a_behavior_that_the_journal_did_not_request_is_a_fault(evidence: Evidence) -> None:
    fault = noted(evidence, [*evidence.world.begun(), Begun("ugv1", "r1.b99")])
    assert fault == "ugv1 began r1.b99, which the journal did not request"


def test_two_behaviors_at_once_on_one_vehicle_are_a_fault(evidence: Evidence) -> None:
    first, *others = evidence.world.begun()
    fault = noted(evidence, [replace(first, overlaps="r2.b1"), *others])
    assert fault == f"{first.vehicle} began {first.behavior} while it did r2.b1"


def test_a_vehicle_that_knows_no_behavior_is_judged_by_the_element(evidence: Evidence) -> None:
    elements = ["Out", "Back", "Up", "Fly", "Home", "Last", "Near", "Shared", "Reverse"]
    notes = [Begun("v1", "", element=each) for each in elements]
    world = Noted(evidence.world, notes)  # type: ignore[arg-type]
    assert judged(replace(evidence, world=world)).faults == []  # type: ignore[arg-type]
    fault = noted(evidence, [*notes, Begun("v1", "", element="Fly")])
    assert fault.endswith("was begun 2 times, and restarted 0")


def test_a_behavior_that_succeeded_without_beginning_is_a_fault(evidence: Evidence) -> None:
    first, *others = evidence.world.begun()
    assert noted(evidence, others) == f"{first.behavior} succeeded, and was never begun"


def test_a_printed_record_that_is_not_in_the_journal_is_a_fault(evidence: Evidence) -> None:
    line = next(each for each in evidence.printed if "record" in json.loads(each))
    other = line.replace('"seq":1', '"seq":901')
    (fault,) = judged(replace(evidence, printed=[*evidence.printed, other])).faults
    assert fault == f"printed, and not in the journal: {other}"


def test_a_start_that_was_acknowledged_and_is_gone_is_a_fault(evidence: Evidence) -> None:
    lost = {**evidence.acknowledged, "two_ways.bpmn": ["r1", "r9"]}
    (fault,) = judged(replace(evidence, acknowledged=lost)).faults
    assert fault == "two_ways.bpmn was started as r9, and the journal has no such run"


def test_an_answer_that_was_acknowledged_and_is_gone_is_a_fault(evidence: Evidence) -> None:
    (fault,) = judged(replace(evidence, answered=[("r1", "p7")])).faults
    assert fault == "the answer to r1.p7 was acknowledged, and is not there"


def test_an_end_other_than_the_undisturbed_one_is_a_fault(evidence: Evidence) -> None:
    ends = judged(evidence).ends
    expected = {**ends, "in_turn.bpmn": ("failed", Counter({"E completed": 1}))}
    (fault,) = judged(evidence, expected).faults
    assert fault.startswith("in_turn.bpmn ended as completed, not failed; more: Counter(")


def test_an_order_that_the_mission_does_not_allow_is_a_fault(evidence: Evidence) -> None:
    world = evidence.world
    missions = [
        replace(each, orders=tuple(order[::-1] for order in each.orders[:1]))
        for each in world.missions
    ]

    class Reversed(SimulatedVehicles):
        def __init__(self) -> None:
            """Its vehicles are those of the round."""

        begun = staticmethod(world.begun)

    other = Reversed()
    other.missions = tuple(missions)  # type: ignore[misc, assignment]
    first, second = judged(replace(evidence, world=other)).faults
    assert "not in the order Last Back Ask Out" in first
    assert "not in the order Reverse Shared Near Wait" in second


def test_an_exception_of_the_executive_is_a_fault(evidence: Evidence) -> None:
    (fault,) = judged(replace(evidence, errors="Traceback (most recent call last)")).faults
    assert fault.startswith("an exception: ")


HASTY = """
import asyncio
from m2pem.journal.sqlite import SqliteJournal

append = SqliteJournal.append

async def hasty(self, entries):
    asyncio.get_running_loop().call_later(600, append, self, entries)

SqliteJournal.append = hasty
"""


def test_an_executive_that_acknowledges_before_it_commits_is_found(tmp_path: Path) -> None:
    kill = Kill("started, not reported", 3)
    plan = Plan(1, SimulatedVehicles.name, SQLITE.name, (kill,), spoil=HASTY)
    played = play_round(plan, tmp_path)
    assert played.reached
    assert any("printed, and not in the journal" in each for each in played.verdict.faults)
