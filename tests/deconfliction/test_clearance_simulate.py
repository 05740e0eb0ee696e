"""A rehearsal keeps aircraft apart as a run does, and shows who was refused."""

import json
from pathlib import Path

import pytest

from m2pem.cli.group import run_command_line
from tests.executive.conftest import mission, sequence

from .conftest import task

FLEET = """\
version: 1
origin: {lat: 38.0, lon: -77.0, alt: 60}
vehicles:
  one: {domain: air, arbiter: sim, connection: {home: [38.0, -77.0]}}
  two: {domain: air, arbiter: sim, connection: {home: [38.0, -76.999]}}
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
