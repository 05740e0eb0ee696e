"""Three copters survey an area as a team, and one is killed: the others survey what it has left."""

import subprocess
import sys
from pathlib import Path

import pytest
from mavlink_sitl import program

ROOT = Path(__file__).parents[4]
WITHIN_S = 280


def measured(*options: str) -> subprocess.CompletedProcess[str]:
    """Run the measurement, which ends with 1 if a bound of docs/teams.md is not kept."""
    command = [sys.executable, "-m", "bench.lost_member", *options]
    return subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=WITHIN_S, check=False
    )


@pytest.mark.long
def test_the_others_survey_what_a_simulated_copter_has_left() -> None:
    done = measured("--speed", "5")
    assert done.returncode == 0, (done.stdout, done.stderr)


@pytest.mark.sitl("M2PEM_ARDUCOPTER")
def test_the_others_survey_what_an_arducopter_has_left() -> None:
    binary = program("M2PEM_ARDUCOPTER")
    assert binary is not None
    done = measured("--speed", "5", "--arducopter", str(binary))
    assert done.returncode == 0, (done.stdout, done.stderr)
