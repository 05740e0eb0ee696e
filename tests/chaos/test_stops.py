"""STOP while something is wrong: it reaches the vehicles before that is mended.

How soon it does is measured by `make chaos CHAOS=--stop`: here a busy computer may take its time.
"""

from dataclasses import replace

import pytest

from tests.chaos import stops
from tests.chaos.kill_points import POSTGRES, SQLITE
from tests.chaos.stops import StopPlan, plan_stop, play_stop
from tests.chaos.troubles import TROUBLES
from tests.chaos.worlds import OF_ROS, WORLDS, MavlinkVehicles, SimulatedVehicles

PATIENCE_S = 60.0
SHORT = "the disk hangs"
CASES = [
    (world, journal, each.name)
    for each in TROUBLES.values()
    for world in each.worlds
    if world not in OF_ROS  # test_ros_chaos.py plays some of theirs
    for journal in each.journals
]


def plan(trouble: str, world: str = SimulatedVehicles.name, journal: str = SQLITE.name) -> StopPlan:
    """A stop soon after the vehicles have begun: autopilots arm first."""
    after_s = 2.0 if world == MavlinkVehicles.name else 0.2
    speed = min(4.0, WORLDS[world].speed)
    return StopPlan(1, world, journal, trouble, after_s=after_s, lead_s=0.0, speed=speed)


@pytest.mark.parametrize(
    ("world", "journal", "trouble"),
    [
        each
        if each == (SimulatedVehicles.name, SQLITE.name, SHORT)
        else pytest.param(*each, marks=pytest.mark.long)
        for each in CASES
    ],
)
def test_stop_reaches_each_vehicle_while_something_is_wrong(
    world: str, journal: str, trouble: str
) -> None:
    played = play_stop(replace(plan(trouble, world, journal), within_s=PATIENCE_S))
    assert not played.verdict.faults
    assert played.commanded_s or trouble == "paused"  # then they are held already


@pytest.mark.long
@pytest.mark.parametrize(
    ("world", "journal"),
    [
        (SimulatedVehicles.name, SQLITE.name),
        (SimulatedVehicles.name, POSTGRES.name),
        (MavlinkVehicles.name, SQLITE.name),
    ],
)
@pytest.mark.parametrize("number", range(10))
def test_stop_reaches_each_vehicle_at_a_random_moment(
    world: str, journal: str, number: int
) -> None:
    played = play_stop(replace(plan_stop(3, number, world, journal), within_s=PATIENCE_S))
    assert not played.verdict.faults, played.plan


@pytest.mark.long
def test_a_vehicle_that_is_not_commanded_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    name = "cancel never returns"
    monkeypatch.setitem(TROUBLES, name, replace(TROUBLES[name], deaf=None))
    played = play_stop(replace(plan(name), speed=1.0))
    assert any("was commanded" in each for each in played.verdict.faults), played


@pytest.mark.long
def test_that_nothing_was_said_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stops.Stop, "names", lambda *_: False)
    played = play_stop(replace(plan("cancel never returns"), speed=1.0))
    assert any("no operator read it" in each for each in played.verdict.faults), played


def test_a_stop_can_be_played_again_by_its_number() -> None:
    first, second = (plan_stop(7, 12, SimulatedVehicles.name, SQLITE.name) for _ in range(2))
    assert first == second
    assert first != plan_stop(8, 12, SimulatedVehicles.name, SQLITE.name)
