"""m2pem is killed again and again while a real copter and a real rover move (`mavlink_kills`)."""

from pathlib import Path

import mavlink_sitl
import pytest
from mavlink_kills import fly

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
