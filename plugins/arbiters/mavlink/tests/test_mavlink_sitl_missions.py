"""Missions on real autopilots, to their ends: `m2pem sitl` and `m2pem run` as a user calls them."""

import json
import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import mavlink_sitl
import pytest
from test_mavlink_demo import FLEETS, MISSION, ends

SPEED = 5


@pytest.fixture
def fleet(tmp_path: Path) -> Path:
    text = (FLEETS / "survey_pair.yaml").read_text(encoding="utf-8")
    (tmp_path / "geo").symlink_to(FLEETS / "geo")
    file = tmp_path / "fleet.yaml"
    file.write_text(text.replace("14550", str(mavlink_sitl.free_port())), encoding="utf-8")
    return file


@pytest.fixture
def programs(tmp_path: Path) -> Path:
    """A folder with links to the programs."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for variable, name in (("M2PEM_ARDUCOPTER", "arducopter"), ("M2PEM_ARDUROVER", "ardurover")):
        program = mavlink_sitl.program(variable)
        assert program is not None
        (folder / name).symlink_to(program)
    return folder


@pytest.mark.timeout(600)
@pytest.mark.sitl("M2PEM_ARDUCOPTER", "M2PEM_ARDUROVER")
def test_two_copters_survey_a_field_and_a_rover_drives_to_its_gate(
    fleet: Path, programs: Path, tmp_path: Path
) -> None:
    with subprocess.Popen(
        _m2pem("sitl", "--ardupilot", programs, "--fleet", fleet, "--speed", SPEED),
        stdout=subprocess.PIPE,
        text=True,
    ) as autopilots:
        try:
            lines = mavlink_sitl.until_ready(autopilots)
            done = subprocess.run(
                _m2pem(
                    *("run", MISSION, "--fleet", fleet, "--speed", SPEED, "--ocu", "none"),
                    *("--journal", tmp_path / "journal.db", "--format", "json"),
                ),
                capture_output=True,
                text=True,
                check=False,
            )
        finally:
            autopilots.send_signal(signal.SIGINT)
    assert len(lines) == 4
    assert autopilots.returncode == 0
    assert done.returncode == 0, done.stdout + done.stderr
    assert "fleet says" not in done.stderr  # the autopilots are set to what it says
    records = [json.loads(line) for line in done.stdout.splitlines()]
    assert (records[-1]["record"], records[-1]["outcome"]) == ("RunEnded", "completed")
    assert ends(records) == Counter(
        {
            ("takeoff", "uav1", "SUCCEEDED"): 1,
            ("takeoff", "uav2", "SUCCEEDED"): 1,
            ("goto", "rover1", "SUCCEEDED"): 1,
            ("return_to_launch", "rover1", "SUCCEEDED"): 1,
            ("area_survey", "uav1", "SUCCEEDED"): 1,
            ("area_survey", "uav2", "SUCCEEDED"): 1,
            ("return_to_launch", "uav1", "SUCCEEDED"): 1,
            ("return_to_launch", "uav2", "SUCCEEDED"): 1,
        }
    )


def _m2pem(*words: Any) -> list[str]:
    return [sys.executable, "-m", "m2pem", *map(str, words)]
