"""A rehearsal and a check keep vehicles apart as a run does, and show who is refused or waits."""

import json
from pathlib import Path

import pytest

from m2pem.cli.group import run_command_line
from tests.executive.conftest import flow, mission, sequence

from .conftest import task

FLEET = """\
version: 1
origin: {lat: 38.0, lon: -77.0, alt: 60}
vehicles:
  one: {domain: air, arbiter: sim, connection: {home: [38.0, -77.0]}}
  two: {domain: air, arbiter: sim, connection: {home: [38.0, -76.999], altitude: 30 m}}
"""


@pytest.mark.parametrize("said", ["", "deconfliction: {vertical: 10 m}\n"])
def test_a_rehearsal_shows_which_behavior_would_be_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], said: str
) -> None:
    (tmp_path / "fleet.yaml").write_text(FLEET + said, encoding="utf-8")
    tasks = (
        task("Up", "takeoff", "one", altitude="20 m"),
        task("Over", "goto", "two", target="[38.0, -77.0]", altitude="25 m"),
    )
    (tmp_path / "mission.bpmn").write_bytes(mission(sequence(*tasks)))
    words = ["simulate", tmp_path / "mission.bpmn", "--fleet", tmp_path / "fleet.yaml"]
    status = run_command_line([*map(str, words), "--format", "json"])
    records = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    ends = [each for each in records if each["record"] == "BehaviorEnded"]
    assert ends[-1]["state"] == ("REJECTED" if said else "SUCCEEDED")
    assert ("fly at 30 m or more" in ends[-1].get("reason", "")) is bool(said)
    assert (status == 1) is bool(said)


ROVERS = """\
version: 1
origin: {lat: 38.0, lon: -77.0, alt: 60}
vehicles:
  one: {domain: ground, arbiter: sim, connection: {home: [38.0, -77.0]}}
  two: {domain: ground, arbiter: sim, connection: {home: [38.0, -76.999]}}
teams: {crew: {members: [one, two]}}
areas: {bridge: bridge.geojson}
routes: {over: over.geojson}
shared_space: {bridge: 1}
"""


def write_rovers(folder: Path) -> Path:
    west, east, south, north = -76.9996, -76.9994, 37.9999, 38.0001
    ring = [[west, south], [east, south], [east, north], [west, north], [west, south]]
    over = [[-77.001, 38.0], [-76.998, 38.0]]
    for name, kind, coordinates in (("bridge", "Polygon", [ring]), ("over", "LineString", over)):
        content = {"type": kind, "coordinates": coordinates}
        (folder / f"{name}.geojson").write_text(json.dumps(content), encoding="utf-8")
    (folder / "fleet.yaml").write_text(ROVERS, encoding="utf-8")
    return folder / "fleet.yaml"


def both_ways() -> bytes:
    """A mission in which both cross the bridge, from both sides."""
    return mission(
        '<process id="P" isExecutable="true"><startEvent id="S"/><parallelGateway id="F"/>'
        + task("East", "goto", "one", target="[38.0, -76.998]", speed="3 m/s")[1]
        + task("West", "goto", "two", target="[38.0002, -77.0005]", speed="3 m/s")[1]
        + flow("S", "F")
        + flow("F", "East")
        + flow("F", "West")
        + "</process>"
    )


def test_a_rehearsal_shows_who_waits_for_the_bridge_and_when_it_goes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mission.bpmn").write_bytes(both_ways())
    words = ["simulate", tmp_path / "mission.bpmn", "--fleet", write_rovers(tmp_path)]
    assert run_command_line([*map(str, words), "--format", "json"]) == 0
    records = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    named = {name: [e for e in records if e["record"] == name] for name in (REQUESTED, ENDED)}
    first, second = named[REQUESTED]
    assert (first["element"], second["element"]) == ("East", "West")
    assert first["t"] + 10 < second["t"] < named[ENDED][0]["t"] - 10


REQUESTED, ENDED = "BehaviorRequested", "BehaviorEnded"


@pytest.mark.parametrize(
    ("behavior", "said"),
    [
        ("road_following_formation", "error: March (line 4): its team needs 2 places at a time"),
        ("formation", "warning: March (line 4): its team may need 2 places at a time"),
        ("bridge_crossing", "nothing found"),
    ],
)
def test_a_team_that_needs_more_places_than_there_are_is_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], behavior: str, said: str
) -> None:
    (tmp_path / "mission.bpmn").write_bytes(
        mission(sequence(task("March", behavior, "crew", route="over")))
    )
    words = ["check", tmp_path / "mission.bpmn", "--fleet", write_rovers(tmp_path)]
    status = run_command_line(list(map(str, words)))
    captured = capsys.readouterr()
    assert said in captured.out + captured.err
    assert (status != 0) is ("error" in said)
