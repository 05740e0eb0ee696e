"""m2pem is killed again and again while a real copter and a real rover move (`mavlink_kills`)."""

import asyncio
import json
import math
from contextlib import closing, contextmanager
from pathlib import Path

import mavlink_revised_copters as revised
import mavlink_sitl
import pytest
import shapely
from mavlink_kills import fly
from test_mavlink_sitl_places import HOME, UP, geojson, track

from tests.command_line import command_line

KILLS = 8
"""In one mission at most."""

pytestmark = [pytest.mark.timeout(600), pytest.mark.sitl("M2PEM_ARDUCOPTER", "M2PEM_ARDUROVER")]


@pytest.mark.parametrize(
    "seed", [1, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(2, 17))]
)
@pytest.mark.tried_with(
    "ArduCopter and ArduRover",
    "the executive is killed in a mission, and resumes it",
    kind="Autopilots",
    result="nothing is commanded twice",
    version="4.7.0-dev",
    on="2026-11",
)
def test_after_each_kill_nothing_is_commanded_twice_and_no_failsafe_is_interrupted(
    seed: int, tmp_path: Path
) -> None:
    copter = mavlink_sitl.program("M2PEM_ARDUCOPTER")
    rover = mavlink_sitl.program("M2PEM_ARDUROVER")
    assert copter is not None
    assert rover is not None
    flight = fly({"uav1": copter, "rover1": rover}, seed, KILLS, tmp_path)
    print(f"\nseed {seed}: {flight}")
    assert flight.faults == []
    assert flight.kills > 0


POND = shapely.box(35, 35, 65, 65)


def test_a_return_around_a_hole_goes_on_without_a_question(tmp_path: Path) -> None:
    file, printed = tmp_path / "mission.bpmn", ("--format", "json", "--ocu", "none")
    way = revised.lane((90, 0), (90, 90))
    file.write_bytes(revised.drawn([UP, revised.flies("lane", "20 m"), HOME], lane=way))
    with (
        closing(revised.Copters(tmp_path / "world")) as copters,
        contextmanager(command_line)(tmp_path) as m2pem,
    ):
        copter = copters.all[0]
        yard = geojson(shapely.box(-15, -15, 110, 110).difference(POND))
        (copters.fleet.parent / "yard.geojson").write_text(json.dumps(yard))
        with copters.fleet.open("a", encoding="utf-8") as fleet:
            fleet.write("areas: {yard: yard.geojson}\nfence: yard\n")
        run = m2pem.start("run", file, *copters.of_fleet, *printed)
        begun = run.until_record("BehaviorRequested", element="A3")["behavior"]
        run.until_record("BehaviorProgressed", behavior=begun, state="RUNNING")
        asyncio.run(revised.until(lambda: math.dist(copter.now.place, (90, 90)) > 10.0))
        run.kill()
        resumed = m2pem.start("resume", "r1", *printed)
        assert resumed.until_record("RunEnded")["outcome"] == "completed"
        assert "PromptOpened" not in {each["record"] for each in resumed.records}
        asyncio.run(revised.landed(copters))
    assert not track(copter).intersects(POND)
    assert math.hypot(*copter.now.place) < 3.0
