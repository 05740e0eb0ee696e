import json
from pathlib import Path

import pytest

from tests.cli.conftest import Invoke
from tests.command_line import FLEET, MISSION, REPOSITORY
from tests.fleet.fleets import write_json
from tests.geo.geometry_files.test_mission_plans import item, plan


def test_a_fleet_is_shown(invoke: Invoke) -> None:
    status, out, err = invoke("fleet", FLEET)
    assert (status, err) == (0, "")
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert lines[0] == f"mehds-vignette-1 ({FLEET})"
    assert "lead manned ground vehicle sim" in lines
    assert "evsg1/gpr detector sim" in lines
    assert "section evsg1 evsg1, evsg2, evsg3" in lines
    assert "route_alpha route" in lines
    assert "single_vehicle_routing evsg1, evsg2, evsg3, lead" in lines
    assert "formation section" in lines
    assert "ptz_scan_polygon evsg2/ptz" in lines


def test_a_fleet_as_json(invoke: Invoke) -> None:
    fleet = json.loads(invoke("fleet", FLEET, "--format", "json")[1])
    assert fleet["name"] == "mehds-vignette-1"
    assert list(fleet["vehicles"]) == ["evsg1", "evsg2", "evsg3", "lead"]
    assert "reverse" in fleet["vehicles"]["evsg1"]["behaviors"]
    assert "formation" not in fleet["vehicles"]["evsg1"]["behaviors"]
    assert fleet["payloads"]["evsg1/gpr"]["detector"] is True
    assert fleet["teams"]["section"]["lead"] == "evsg1"
    assert "formation" in fleet["teams"]["section"]["behaviors"]
    assert fleet["geometries"]["inspection_area"] == "area"


def test_the_schema_is_the_one_that_is_published(invoke: Invoke) -> None:
    published = REPOSITORY / "fleet_configs" / "fleet.schema.json"
    status, out, _ = invoke("fleet", "--schema")
    assert status == 0
    assert json.loads(out) == json.loads(published.read_text(encoding="utf-8"))


def test_what_is_wrong_with_a_fleet_is_listed(invoke: Invoke, tmp_path: Path) -> None:
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text("version: 1\nvehicles: {a: {domain: groud, arbiter: sim}}\nteams: 3\n")
    status, out, err = invoke("fleet", fleet)
    assert (status, out) == (2, "")
    assert f"{fleet}:2: vehicles.a.domain" in err
    assert f"{fleet}:3: teams" in err


def test_a_fleet_must_be_named(invoke: Invoke) -> None:
    assert invoke("fleet")[0] == 2
    assert invoke("fleet", "sim")[0] == 2


@pytest.mark.parametrize(
    ("home", "message"),
    [
        ("[9.97, 153.54]", "the fleet's `origin` near its vehicles"),
        ("[-77.319291, 38.107455]", "are latitude and longitude swapped?"),
        ("[38.107455, 253.54]", "is not a position"),
    ],
)
def test_a_vehicle_whose_home_is_far_from_the_origin_is_a_fault_of_the_fleet(
    invoke: Invoke, tmp_path: Path, home: str, message: str
) -> None:
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text(
        "version: 1\norigin: {lat: 38.1075, lon: -77.3192}\nvehicles:\n"
        f"  evsg1: {{domain: ground, arbiter: sim, connection: {{home: {home}}}}}\n"
    )
    mission = tmp_path / "mission.bpmn"
    mission.write_bytes(MISSION.read_bytes())
    where = f"{fleet}:4: evsg1.connection.home: error: "
    journal = tmp_path / "journal.db"
    for command in (("fleet", fleet), ("run", mission, "--fleet", fleet, "--journal", journal)):
        status, _, err = invoke(*command)
        assert (status, "bug" in err, where in err, message in err) == (2, False, True, True), err
    status, out, _ = invoke("check", mission, "--fleet", fleet)
    assert status == 2
    assert where in out
    assert out.splitlines()[-1].startswith(f"{fleet}: 1 error"), out
    assert "mission.bpmn: 1 error" not in out


def test_a_fleet_without_an_origin_is_asked_for_one(invoke: Invoke, tmp_path: Path) -> None:
    fleet = tmp_path / "fleet.yaml"
    settings = "{domain: ground, arbiter: sim, connection: {home: [38.1, -77.3]}}"
    fleet.write_text(f"version: 1\nvehicles:\n  evsg1: {settings}\n")
    status, _, err = invoke("fleet", fleet)
    assert status == 2
    assert "set the fleet's `origin` near its vehicles" in err


def test_what_is_left_out_of_a_plan_is_shown(invoke: Invoke, tmp_path: Path) -> None:
    write_json(tmp_path / "north.plan", plan(item(16, 38.0, -77.0, 30), item(20, 0, 0, 0)))
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text("version: 1\nroutes: {north: north.plan}\n")
    status, out, _ = invoke("fleet", fleet)
    said = (
        f"{fleet}:2: routes.north: warning: north.plan: item 2: MAV_CMD_NAV_RETURN_TO_LAUNCH is "
        "left out; a task `return_to_launch` [geometry]"
    )
    assert (status, out.splitlines()[-1]) == (0, said)
    (warning,) = json.loads(invoke("fleet", fleet, "--format", "json")[1])["warnings"]
    assert warning["element"] == "routes.north"
