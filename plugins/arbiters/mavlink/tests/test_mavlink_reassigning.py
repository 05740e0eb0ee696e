"""A copter is cut off in a route, and another flies the rest: simulated autopilots, real UDP."""

import json
import socket
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

SPEED = "15"
ENDED_WITHIN_S = 100

FLEET = """
version: 1
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
vehicles:
  uav1:
    domain: air
    arbiter: mavlink
    connection: {{url: "udpin://127.0.0.1:{port}", system_id: 1}}
    lost_after: 20 s
    sitl: true
  uav2:
    domain: air
    arbiter: mavlink
    connection: {{url: "udpin://127.0.0.1:{port}", system_id: 2}}
    lost_after: 20 s
    sitl: true
routes: {{around: around.geojson}}
"""

ROUND = [[-77.3192, 38.1080], [-77.3182, 38.1080], [-77.3182, 38.1090], [-77.3192, 38.1090]]
AROUND = {"type": "LineString", "coordinates": [*ROUND, *ROUND]}


def task(name: str, behavior: str, parameters: dict[str, str], role: str) -> str:
    given = "".join(
        f'<m2pem:property name="{key}" value="{value}"/>' for key, value in parameters.items()
    )
    return (
        f'<scriptTask id="{name}"><extensionElements>'
        f'<m2pem:behavior type="vehicle" name="{behavior}">'
        f"<m2pem:properties>{given}</m2pem:properties><m2pem:resources>"
        f'<m2pem:role name="pilot" {role}/></m2pem:resources></m2pem:behavior>'
        "</extensionElements></scriptTask>"
    )


def mission() -> str:
    """Both copters take off; one flies the route; uav2 lands."""
    tasks = {
        "Up1": task("Up1", "takeoff", {"altitude": "10"}, 'vehicle="uav1"'),
        "Up2": task("Up2", "takeoff", {"altitude": "10"}, 'vehicle="uav2"'),
        "Fly": task(
            "Fly",
            "single_vehicle_routing",
            {"route": "around", "speed": "8 m/s"},
            'requires="vehicle.domain == \'air\'" onLoss="reassign" store="pilot"'
            " prefer=\"vehicle.name == 'uav1' ? 1000 : 0\"",
        ),
        "Down": task("Down", "land", {}, 'same="pilot"'),
    }
    ids = ["S", *tasks, "E"]
    flows = "".join(
        f'<sequenceFlow id="{a}-{b}" sourceRef="{a}" targetRef="{b}"/>' for a, b in pairwise(ids)
    )
    return (
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="urn:t"'
        ' xmlns:m2pem="https://m2pem.org/schema/1"><process id="P" isExecutable="true">'
        f'<startEvent id="S"/>{"".join(tasks.values())}<endEvent id="E"/>{flows}'
        "</process></definitions>"
    )


@pytest.fixture
def port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        free: int = taken.getsockname()[1]
        return free


def m2pem(*words: object) -> list[str]:
    return [sys.executable, "-m", "m2pem", *map(str, words)]


def test_another_copter_flies_the_rest_and_the_first_one_is_stopped_when_it_returns(
    port: int, tmp_path: Path
) -> None:
    (tmp_path / "fleet.yaml").write_text(FLEET.format(port=port), encoding="utf-8")
    (tmp_path / "around.geojson").write_text(json.dumps(AROUND), encoding="utf-8")
    (tmp_path / "m.bpmn").write_text(mission(), encoding="utf-8")
    autopilots = subprocess.Popen(
        m2pem(
            *("sim", "mavlink", "--copters", 2, "--speed", SPEED, "--ekf", "6s"),
            *("--home", "38.1075,-77.3192,60", "--to", f"udp://127.0.0.1:{port}"),
            *("--set", "FS_GCS_ENABLE=0", "--fault", "1: cut link at 80 s for 50 s"),
        ),
        stdout=subprocess.DEVNULL,
    )
    try:
        done = subprocess.run(
            m2pem(
                *("run", tmp_path / "m.bpmn", "--fleet", tmp_path / "fleet.yaml"),
                *("--speed", SPEED, "--ocu", "none", "--format", "json"),
                *("--journal", tmp_path / "journal.db"),
            ),
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
    flown = of_kind(records, "BehaviorRequested", element="Fly")
    assert [each["resources"] for each in flown] == [["uav1"], ["uav2"]]
    (reassigned,) = of_kind(records, "WorkReassigned")
    assert (reassigned["code"], reassigned["excluded"]) == ("LINK_LOST", ["uav1"])
    assert flown[1]["parameters"] == reassigned["parameters"]
    left = reassigned["parameters"]["route"]["geometry"]["coordinates"]
    assert 1 <= len(left) < len(AROUND["coordinates"])
    assert left[-1][:2] == pytest.approx(AROUND["coordinates"][-1], abs=1e-6)
    (landed,) = of_kind(records, "BehaviorRequested", element="Down")
    assert landed["resources"] == ["uav2"]
    (returned,) = of_kind(records, "ResourceReturned")
    assert returned["resource"] == "uav1"
    assert "uav1: its link is restored, it has ended what it did before, and is free" in done.stderr


def of_kind(records: list[dict[str, Any]], name: str, **fields: str) -> list[dict[str, Any]]:
    return [
        each
        for each in records
        if each["record"] == name and all(each[key] == value for key, value in fields.items())
    ]
