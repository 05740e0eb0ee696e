"""Missions on real autopilots, to their ends: `m2pem sitl` and `m2pem run` as a user calls them."""

import json
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mavlink_sitl
import pytest
from test_mavlink_demo import FLEETS, ends

SPEED = 5
MISSIONS = FLEETS.parent / "missions"

pytestmark = [pytest.mark.timeout(900), pytest.mark.sitl("M2PEM_ARDUCOPTER", "M2PEM_ARDUROVER")]

Fly = Callable[..., list[dict[str, Any]]]


@pytest.fixture
def programs(tmp_path: Path) -> Path:
    return mavlink_sitl.programs_folder(tmp_path / "bin", "arducopter", "ardurover")


@pytest.fixture
def fly(programs: Path, tmp_path: Path) -> Fly:
    """Start the autopilots of a fleet, run a mission, and return its records."""

    def run(mission: str, fleet: str, *words: object) -> list[dict[str, Any]]:
        for name in ("geo", "routes"):
            (tmp_path / name).symlink_to(FLEETS / name)
        file = tmp_path / "fleet.yaml"
        text = (FLEETS / f"{fleet}.yaml").read_text(encoding="utf-8")
        # Tests share their processors: 10 s of simulated time are soon over.
        text = text.replace("lost_after: 10 s", "lost_after: 60 s")
        text = text.replace("FS_GCS_TIMEOUT: 10", "FS_GCS_TIMEOUT: 60")
        file.write_text(text.replace("14550", str(mavlink_sitl.free_port())), encoding="utf-8")
        with subprocess.Popen(
            _m2pem("sitl", "--ardupilot", programs, "--fleet", file, "--speed", SPEED),
            stdout=subprocess.PIPE,
            text=True,
        ) as autopilots:
            try:
                mavlink_sitl.until_ready(autopilots)
                done = subprocess.run(
                    _m2pem(
                        *("run", MISSIONS / f"{mission}.bpmn", "--fleet", file, "--speed", SPEED),
                        *("--journal", tmp_path / "journal.db", "--format", "json"),
                        *("--ocu", "none", *words),
                    ),
                    capture_output=True,
                    text=True,
                    check=False,
                )
            finally:
                autopilots.send_signal(signal.SIGINT)
        assert autopilots.returncode == 0
        assert done.returncode == 0, done.stdout + done.stderr
        assert "fleet says" not in done.stderr  # the autopilots are set to what it says
        return [json.loads(line) for line in done.stdout.splitlines()]

    return run


def _m2pem(*words: object) -> list[str]:
    return [sys.executable, "-m", "m2pem", *map(str, words)]


def test_two_copters_survey_a_field_and_a_rover_drives_to_its_gate(fly: Fly) -> None:
    records = fly("survey_pair", "survey_pair")
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


@pytest.mark.parametrize(
    ("mission", "answers", "outcome", "last"),
    [
        ("vignette1", "vignette1_route", "terminated", "single_vehicle_routing"),
        ("mehds_vignette_1", "mehds_vignette_1_swept", "completed", "road_sweep"),
        ("mehds_vignette_2", "mehds_vignette_2_rejoined", "completed", "formation"),
        ("mehds_vignette_3", "mehds_vignette_3_crossed", "completed", "bridge_crossing"),
        ("mehds_vignette_4", "mehds_vignette_4_route_driven", "completed", "return_to_launch"),
    ],
)
def test_the_vehicles_of_the_field_tests_reach_the_end_of_a_vignette(
    fly: Fly, mission: str, answers: str, outcome: str, last: str
) -> None:
    records = fly(mission, "mehds_sitl", "--answers", MISSIONS / "answers" / f"{answers}.yaml")
    assert (records[-1]["record"], records[-1]["outcome"]) == ("RunEnded", outcome)
    ended = ends(records)
    assert {state for _, _, state in ended} <= {"SUCCEEDED", "CANCELLED"}
    assert any(name == last and state == "SUCCEEDED" for name, _, state in ended)
