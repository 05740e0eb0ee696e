"""`m2pem approve`, and what `m2pem run` says of a mission that nobody has approved."""

import asyncio
import json
from pathlib import Path

import pytest

from m2pem.cli.journals import journal_at, url_of
from m2pem.executive.drawings import Drawings
from m2pem.fleet.fleet_file import load_fleet
from m2pem.testing import scenarios
from tests.cli.conftest import Invoke

FLEET = """version: 1
name: north
approval: {persons: 1}
vehicles:
  ugv1: {domain: ground, arbiter: sim}
"""


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    mission, fleet = tmp_path / "drive.bpmn", tmp_path / "north.yaml"
    mission.write_bytes(scenarios.one_behavior("drive_stop", "ugv1"))
    fleet.write_text(FLEET)
    return mission, fleet


def test_a_mission_runs_once_persons_have_approved_it(
    invoke: Invoke, files: tuple[Path, Path]
) -> None:
    mission, fleet = files
    run = ("run", mission, "--fleet", fleet, "--speed", 100, "--ocu", "none")
    status, _, err = invoke(*run)
    assert status == 2
    assert "2 persons (one more than the fleet says" in err
    assert f"m2pem approve drive.bpmn --fleet {fleet}" in err
    approve = ("approve", mission, "--fleet", fleet)
    status, out, _ = invoke(*approve, "--by", "bob")
    assert (status, "not approved: bob" in out, "1 more person" in out) == (0, True, True)
    status, out, _ = invoke(*approve, "--by", "carla@gcs1", "--format", "json")
    state = json.loads(out)
    assert (state["may_start"], state["needed"], state["missing"]) == (True, 2, 0)
    assert invoke(*run)[0] == 0
    status, out, _ = invoke(*approve, "--by", "bob", "--withdraw")
    assert (status, "not approved" in out) == (0, True)
    assert invoke(*run)[0] == 2
    mission.write_bytes(mission.read_bytes() + b"\n")
    status, out, _ = invoke(*approve, "--show")
    assert (status, "before these changed: the mission file" in out) == (0, True)


def test_without_an_executive_the_geometries_of_operators_are_approved_too(
    invoke: Invoke, files: tuple[Path, Path], tmp_path: Path
) -> None:
    mission, fleet_file = files
    journal = tmp_path / "journal.db"
    approve = ("approve", mission, "--fleet", fleet_file, "--journal", journal, "--by")
    fleet = load_fleet(str(fleet_file))
    digests = []
    for north in (50.0, 51.0):

        async def hand_over(latitude: float = north) -> None:
            async with journal_at(url_of(str(journal))) as opened:
                drawings = Drawings(fleet, opened, lambda: 1)
                await drawings.load()
                point = {"type": "Point", "coordinates": [7.0, latitude]}
                drawings.change("drive_stop", point, "bob")  # the mission has that word
                await drawings.write("done")

        asyncio.run(hand_over())
        status, out, _ = invoke(*approve, "carla", "--format", "json")
        digests.append(json.loads(out)["digest"])
        assert (status, json.loads(out)["editors"]) == (0, ["bob"])
    assert len(set(digests)) == 2
    status, _, err = invoke(*approve, "bob")
    assert (status, "bob edited it" in err) == (1, True)


def test_what_cannot_be_approved_is_said(invoke: Invoke, files: tuple[Path, Path]) -> None:
    mission, fleet = files
    status, _, err = invoke("approve", mission, "--fleet", fleet, "--by", "bob", "--withdraw")
    assert (status, "bob has not approved this content" in err) == (1, True)
    assert invoke("approve", mission, "--fleet", fleet, "--show", "--withdraw")[0] == 2
    assert invoke("approve", mission, "--fleet", fleet, "--journal", "memory:")[0] == 2
    fleet.write_text(FLEET.replace("approval: {persons: 1}\n", ""))
    status, _, err = invoke("approve", mission, "--fleet", fleet, "--by", "bob")
    assert (status, "asks for no approval" in err) == (1, True)


def test_a_simulation_needs_no_approval(invoke: Invoke, files: tuple[Path, Path]) -> None:
    mission, fleet = files
    run = ("run", mission, "--fleet", fleet, "--speed", 100, "--ocu", "none", "--simulate")
    assert invoke(*run)[0] == 0
    assert invoke("simulate", mission, "--fleet", fleet)[0] == 0
