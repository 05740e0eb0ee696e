"""Examples of the repository on real autopilots, to their ends: ArduPilots are in the place of the
vehicles that m2pem simulates."""

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import mavlink_sitl
import pytest
import yaml
from test_mavlink_demo import REPOSITORY

SPEED = 5

pytestmark = [pytest.mark.timeout(900), pytest.mark.sitl("M2PEM_ARDUCOPTER", "M2PEM_ARDUROVER")]


@pytest.fixture
def programs(tmp_path: Path) -> Path:
    return mavlink_sitl.programs_folder(tmp_path / "bin", "arducopter", "ardurover")


def real_vehicles(example: Path, folder: Path) -> Path:
    """The fleet of an example with ArduPilots; what they carry is still simulated by m2pem."""
    for file in example.glob("*.geojson"):
        (folder / file.name).symlink_to(file)
    fleet = yaml.safe_load((example / "fleet.yaml").read_text(encoding="utf-8"))
    url = f"udpin://127.0.0.1:{mavlink_sitl.free_port()}"
    for system, vehicle in enumerate(fleet["vehicles"].values(), 1):
        simulated = vehicle.get("connection", {})
        start = {name: simulated[name] for name in ("home", "heading") if name in simulated}
        vehicle |= {"arbiter": "mavlink", "sitl": True, "lost_after": "60 s"}
        vehicle["connection"] = {"url": url, "system_id": system, "sitl": start}
        for payload in vehicle.get("payloads", {}).values():
            payload["arbiter"] = "sim"
    file = folder / "fleet.yaml"
    file.write_text(yaml.safe_dump(fleet), encoding="utf-8")
    return file


def _m2pem(*words: object) -> list[str]:
    return [sys.executable, "-m", "m2pem", *map(str, words)]


def run(mission: Path, fleet: Path, *words: object) -> list[dict[str, Any]]:
    """What the run of a mission printed, record by record."""
    done = subprocess.run(
        _m2pem(
            *("run", mission, "--fleet", fleet, "--speed", SPEED, "--ocu", "none"),
            *("--journal", fleet.parent / f"{mission.stem}.db", "--format", "json", *words),
        ),
        capture_output=True,
        text=True,
        check=False,
        cwd=mission.parent,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("t03_two_vehicles", ()),
        ("t07_data", ("--data", "mission.laps=2")),
        ("t08_reuse", ()),
        ("t10_payloads", ()),
        ("t11_teams", ()),
        ("t17_rehearse_many", ()),
        ("t20_loops", ("--answers", "answers.yaml")),
        ("t21_processes_in_files", ()),
    ],
)
def test_an_example_reaches_its_end(
    programs: Path, tmp_path: Path, name: str, words: tuple[str, ...]
) -> None:
    example = REPOSITORY / "examples" / name
    fleet = real_vehicles(example, tmp_path)
    with subprocess.Popen(
        _m2pem("sitl", "--ardupilot", programs, "--fleet", fleet, "--speed", SPEED),
        stdout=subprocess.PIPE,
        text=True,
    ) as autopilots:
        try:
            mavlink_sitl.until_ready(autopilots)
            records = run(example / "mission.bpmn", fleet, *words)
        finally:
            autopilots.send_signal(signal.SIGINT)
    assert (records[-1]["record"], records[-1]["outcome"]) == ("RunEnded", "completed")
    ended = [each["state"] for each in records if each["record"] == "BehaviorEnded"]
    assert ended
    assert set(ended) <= {"SUCCEEDED", "CANCELLED"}
