import json
from pathlib import Path

from tests.cli.conftest import Invoke
from tests.command_line import FLEET, REPOSITORY


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
