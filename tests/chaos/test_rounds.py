"""Rounds of chaos: some kill points in `make test`, all and many by chance in `make test-long`."""

import random
from pathlib import Path

import pytest

from m2pem.journal import open_journal
from tests.chaos.journals import downgrade, make
from tests.chaos.kill_points import (
    JOURNALS,
    POSTGRES,
    RANDOM,
    SQLITE,
    JournalKind,
    install,
    place_of,
    points_of,
)
from tests.chaos.rounds import STATEMENTS_OF_AN_UPGRADE, plan_round, play_round
from tests.chaos.worlds import MavlinkVehicles, SimulatedVehicles

SEED = 1
WORLD = SimulatedVehicles.name
POINTS = [
    (kind.name, point)
    for kind in JOURNALS.values()
    for point in (RANDOM, *points_of(kind, SimulatedVehicles.arbiter))
]
SHORT = [(SQLITE.name, point) for point in (RANDOM, *points_of(SQLITE, SimulatedVehicles.arbiter))]
SHORT += [(POSTGRES.name, each.name) for each in POSTGRES.points]
SHORT = SHORT[::6]  # a round takes more than a second of a processor


@pytest.mark.parametrize(
    ("journal", "point"),
    [each if each in SHORT else pytest.param(*each, marks=pytest.mark.long) for each in POINTS],
)
def test_nothing_is_lost_when_the_executive_dies(journal: str, point: str) -> None:
    number = POINTS.index((journal, point))
    played = play_round(plan_round(SEED, number, WORLD, journal, point))
    assert not played.verdict.faults, f"{played.plan}: {played.verdict.faults}"
    assert played.reached


@pytest.mark.long
@pytest.mark.parametrize("journal", JOURNALS)
@pytest.mark.parametrize("number", range(1, 101))
def test_nothing_is_lost_in_a_round_by_chance(number: int, journal: str) -> None:
    seed = random.SystemRandom().randrange(10**6)
    played = play_round(plan_round(seed, number, WORLD, journal))
    assert not played.verdict.faults, f"seed {seed}, {played.plan}: {played.verdict.faults}"


@pytest.mark.long
@pytest.mark.parametrize("journal", JOURNALS)
@pytest.mark.parametrize("point", ["started, not reported", "resume: after a query"])
def test_autopilots_begin_nothing_twice(point: str, journal: str) -> None:
    seed = random.SystemRandom().randrange(10**6)
    played = play_round(plan_round(seed, 1, MavlinkVehicles.name, journal, point))
    assert not played.verdict.faults, f"seed {seed}, {played.plan}: {played.verdict.faults}"


def test_a_round_can_be_played_again_by_its_number() -> None:
    first, second = (plan_round(7, 12, WORLD, SQLITE.name) for _ in range(2))
    assert first == second
    assert first != plan_round(8, 12, WORLD, SQLITE.name)


@pytest.mark.parametrize("kind", JOURNALS.values(), ids=lambda kind: kind.name)
async def test_a_journal_can_be_made_one_of_an_older_format(
    kind: JournalKind, tmp_path: Path
) -> None:
    file = make(kind, tmp_path)
    point = next(each for each in kind.points if each.name == "migration")
    place = place_of(point.target)
    passages: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(place.owner, place.name, place.function)  # put back in the end
        install(point, lambda: passages.append(""))
        await open_journal(str(file)).close()
        downgrade(kind, file)
        passages.clear()
        await open_journal(str(file)).close()
    assert len(passages) >= STATEMENTS_OF_AN_UPGRADE
