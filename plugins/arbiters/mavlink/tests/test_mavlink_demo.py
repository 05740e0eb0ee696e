"""`make demo-air`: the mission of two copters and a rover, with real processes over real UDP."""

import json
import shlex
import socket
import subprocess
import sys
from collections import Counter
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.command_line import command_line

REPOSITORY = Path(__file__).parents[4]
MISSION = REPOSITORY / "missions" / "survey_pair.bpmn"
FLEETS = REPOSITORY / "fleet_configs"
SPEED = "30"
LOST_AFTER = "40 s"
"""More than a second of the wall clock: at this speed a busy computer is soon silent for 20 s."""

HALF_A_FIELD = ("38.1093", "38.1086")
"""The northern edge of both fields, in degrees: a survey takes half the time."""

ENDED_WITHIN_S = 100


@pytest.fixture
def port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        free: int = taken.getsockname()[1]
        return free


@pytest.fixture
def fleet(tmp_path: Path, port: int) -> Path:
    text = (FLEETS / "survey_pair.yaml").read_text(encoding="utf-8")
    (tmp_path / "geo").mkdir()
    for place in (FLEETS / "geo").glob("*.geojson"):
        north = place.read_text(encoding="utf-8").replace(*HALF_A_FIELD)
        (tmp_path / "geo" / place.name).write_text(north, encoding="utf-8")
    file = tmp_path / "fleet.yaml"
    text = text.replace("14550", str(port)).replace("lost_after: 10 s", f"lost_after: {LOST_AFTER}")
    file.write_text(text, encoding="utf-8")
    return file


def m2pem(*words: object) -> list[str]:
    return [sys.executable, "-m", "m2pem", *map(str, words)]


def test_the_second_copter_takes_over_what_the_first_one_leaves(
    fleet: Path, port: int, tmp_path: Path
) -> None:
    with contextmanager(command_line)(tmp_path) as forked:
        forked.start(
            *("sim", "mavlink", "--copters", "2", "--rovers", "1", "--speed", SPEED, "--ekf", "6s"),
            *("--home", "38.1075,-77.3192,60", "--to", f"udp://127.0.0.1:{port}"),
            *("--set", "FS_GCS_ENABLE=1", "--set", "FS_GCS_TIMEOUT=20"),
            *("--fault", "1: cut link at 60 s for 900 s"),
        )
        status, output, errors = forked.run(
            *("run", MISSION, "--fleet", fleet, "--speed", SPEED, "--ocu", "none"),
            *("--journal", tmp_path / "journal.db", "--format", "json"),
        )
    assert status == 0, errors
    records = [json.loads(line) for line in output.splitlines()]
    assert records[-1]["record"] == "RunEnded"
    assert records[-1]["outcome"] == "completed"
    assert ends(records) == Counter(
        {
            ("takeoff", "uav1", "SUCCEEDED"): 1,
            ("takeoff", "uav2", "SUCCEEDED"): 1,
            ("goto", "rover1", "SUCCEEDED"): 1,
            ("return_to_launch", "rover1", "SUCCEEDED"): 1,
            ("area_survey", "uav1", "LOST"): 1,
            ("area_survey", "uav2", "SUCCEEDED"): 2,
            ("return_to_launch", "uav2", "SUCCEEDED"): 1,
        }
    )


@pytest.mark.long
def test_the_folder_that_init_makes_runs_on_the_autopilots_of_its_readme(
    port: int, tmp_path: Path
) -> None:
    folder = tmp_path / "made"
    subprocess.run(m2pem("init", folder, "--for", "mavlink"), check=True)
    fleet = folder / "fleet.yaml"
    fleet.write_text(fleet.read_text(encoding="utf-8").replace("14550", str(port)))
    readme = (folder / "README.md").read_text(encoding="utf-8").replace("\\\n", " ")
    lines = [line for line in readme.splitlines() if line.startswith("m2pem ")]
    typed = [shlex.split(line, comments=True) for line in lines]
    (simulate,) = [words for words in typed if words[:3] == ["m2pem", "sim", "mavlink"]]
    run = next(words for words in typed if words[:2] == ["m2pem", "run"])
    autopilots = subprocess.Popen(
        m2pem(*simulate[1:], "--to", f"udp://127.0.0.1:{port}"), stdout=subprocess.DEVNULL
    )
    try:
        done = subprocess.run(
            m2pem(*run[1:], "--journal", "memory:", "--ocu", "none", "--format", "json"),
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=ENDED_WITHIN_S,
            check=False,
        )
    finally:
        autopilots.terminate()
        autopilots.wait()
    assert done.returncode == 0, done.stderr
    records = [json.loads(line) for line in done.stdout.splitlines()]
    assert ends(records) == Counter(
        {
            ("single_vehicle_routing", "rover", "SUCCEEDED"): 1,
            ("goto", "rover", "SUCCEEDED"): 1,
            ("takeoff", "uav1", "SUCCEEDED"): 1,
            ("area_survey", "uav1", "SUCCEEDED"): 1,
            ("return_to_launch", "uav1", "SUCCEEDED"): 1,
        }
    )


def ends(records: list[dict[str, Any]]) -> Counter[tuple[str, str, str]]:
    """How each behavior of each vehicle has ended."""
    asked = {each["behavior"]: each for each in records if each["record"] == "BehaviorRequested"}
    return Counter(
        (asked[each["behavior"]]["name"], asked[each["behavior"]]["resources"][0], each["state"])
        for each in records
        if each["record"] == "BehaviorEnded"
    )
