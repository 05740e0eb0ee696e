"""Rounds of chaos with ROS rovers over DDS; `make chaos CHAOS="--vehicles ros"` is for many."""

import random

import pytest

from tests.chaos.kill_points import JOURNALS, POINTS_OF_ARBITERS, KillPoint, place_of
from tests.chaos.rounds import plan_round, play_round
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
