"""Rounds of chaos with ROS rovers over DDS; `make chaos CHAOS="--vehicles ros"` is for many."""

import random
from pathlib import Path

import pytest

from tests.chaos.fault_table import PLAYED, Fault, Row, check
from tests.chaos.kill_points import JOURNALS, POINTS_OF_ARBITERS, SQLITE, KillPoint, place_of
from tests.chaos.rounds import plan_round, play_round
from tests.chaos.stops import StopPlan, play_stop
from tests.chaos.troubles import TROUBLES
from tests.chaos.worlds import OF_ROS, RosVehicles

OWN_POINTS = POINTS_OF_ARBITERS[RosVehicles.arbiter]


@pytest.mark.parametrize("point", OWN_POINTS, ids=lambda point: point.name)
def test_the_function_of_a_kill_point_is_there(point: KillPoint) -> None:
    assert callable(place_of(point.target).function)


@pytest.mark.long
@pytest.mark.parametrize("journal", JOURNALS)
@pytest.mark.parametrize(
    "point", ["started, not reported", "resume: after a query", *(each.name for each in OWN_POINTS)]
)
@pytest.mark.parametrize("world", OF_ROS)
def test_rovers_begin_nothing_twice(world: str, point: str, journal: str) -> None:
    seed = random.SystemRandom().randrange(10**6)
    played = play_round(plan_round(seed, 1, world, journal, point))
    assert not played.verdict.faults, f"seed {seed}, {played.plan}: {played.verdict.faults}"


@pytest.mark.long
@pytest.mark.parametrize(
    ("journal", "trouble"),
    [
        (each.journals[0], each.name)
        for each in TROUBLES.values()
        if RosVehicles.name in each.worlds
    ],
)
def test_stop_reaches_each_vehicle_while_something_is_wrong(journal: str, trouble: str) -> None:
    plan = StopPlan(1, RosVehicles.name, journal, trouble, after_s=2.0, lead_s=0.0, within_s=60.0)
    played = play_stop(plan)
    assert not played.verdict.faults
    assert played.commanded_s or trouble == "paused"  # then they are held already


def _case(row: Row) -> object:
    is_short = (row.fault, row.journal) == (Fault.KILLED, SQLITE.name)
    marks = () if is_short else (pytest.mark.long, pytest.mark.timeout(600))
    return pytest.param(row, id=row.id, marks=marks)


@pytest.mark.parametrize("row", [_case(row) for row in PLAYED if row.arbiter in OF_ROS])
def test_a_fault_comes_to_what_the_table_says(row: Row, tmp_path: Path) -> None:
    check(row, tmp_path)
