"""An executive is killed while vehicles drive; the next one finds them, whatever steers them."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from ros_e2e_programs import Program, Programs, programs
from ros_e2e_watch import Watch, watching
from ros_e2e_world import ALL_WAYS, convoy, fleet_file

SPEED = 4.0
LENGTH_M = 250.0
ON_BOARD = ("topics", "action", "nav")
"""Those that are steered on board, and need no executive for that."""


@pytest.fixture
def m2pem(tmp_path: Path, ros_domain: int) -> Iterator[Programs]:
    with programs(tmp_path, ros_domain) as started:
        yield started


@pytest.fixture
def watch(ros_domain: int) -> Iterator[Watch]:
    with watching(ALL_WAYS, ros_domain) as heard:
        yield heard


def drive(m2pem: Programs, watch: Watch, length_m: float = LENGTH_M, **fleet: object) -> Program:
    """Vehicles, and an executive that runs a mission in which all drive."""
    file = fleet_file(m2pem.folder, ALL_WAYS, length_m, **fleet)
    m2pem.simulate(file, SPEED)
    watch.until_heard()
    mission = convoy(m2pem.folder, ALL_WAYS)
    return m2pem.m2pem(
        "run", mission, "--fleet", file, "--speed", f"{SPEED:g}", "--ocu", "none", "--format", "json"
    )


def assert_begun_once(watch: Watch) -> None:
    """Each vehicle that is steered on board has got one goal, and has begun to move once."""
    for name in ON_BOARD:
        track = watch[name]
        assert track.motions == 1, name
        assert not track.stood_on_the_way(10.0, LENGTH_M - 20.0), name
    assert len(set(watch["topics"].starts)) == 1
    assert watch["topics"].accepted() == watch["topics"].starts[:1]
    assert len(watch["action"].goals) == 1
    assert len(watch["nav"].goals) == 1


def test_vehicles_drive_on_while_nobody_is_there_and_nothing_is_begun_twice(
    m2pem: Programs, watch: Watch
) -> None:
    first = drive(m2pem, watch)
    first.until_record("BehaviorProgressed", count=len(ALL_WAYS), state="RUNNING")
    watch.until(lambda: all(watch[name].north_m > 10.0 for name in ALL_WAYS))
    first.kill()
    watch.until(lambda: watch["base"].stands)
    assert all(watch[name].moves for name in ON_BOARD)
    second = m2pem.m2pem("resume", "r1", "--ocu", "plain", "--format", "json")
    prompt = second.until_record("PromptOpened")
    print(prompt)
    assert watch["base"].stands
    assert second.those("BehaviorEnded") == []
    second.type("resume")
    print(second.rest())
    print(second.said)
    assert_begun_once(watch)
    assert watch["base"].motions == 2
