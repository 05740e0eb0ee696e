"""`m2pem geometries`, with an executive and without one."""

import json
from pathlib import Path

import msgspec
import pytest

from m2pem.api import Point, as_geojson
from m2pem.testing import scenarios
from tests.cli.conftest import Invoke

FLEET = """version: 1
name: north
origin: {lat: 50.0, lon: 7.0, alt: 0.0}
vehicles:
  ugv1: {domain: ground, arbiter: sim}
points:
  gate: gate.geojson
"""
GATE, OTHER = Point((50.001, 7.0, None)), Point((50.002, 7.0, None))


@pytest.fixture
def fleet(tmp_path: Path) -> Path:
    file = tmp_path / "north.yaml"
    file.write_text(FLEET)
    (tmp_path / "gate.geojson").write_bytes(msgspec.json.encode(as_geojson(GATE)))
    return file


def features(*named: tuple[str, Point]) -> str:
    each = [as_geojson(geometry) | {"properties": {"name": name}} for name, geometry in named]
    return json.dumps({"type": "FeatureCollection", "features": each})


def test_a_drawing_is_imported_listed_exported_deleted_and_restored(
    invoke: Invoke, fleet: Path, tmp_path: Path
) -> None:
    def geometries(command: str, *arguments: object) -> str:
        status, out, err = invoke("geometries", command, *arguments, "--fleet", fleet)
        assert status == 0, err
        return out

    site = tmp_path / "site.geojson"
    site.write_text(features(("gate", OTHER), ("lane", GATE)))
    assert "gate is handed over\nlane is handed over" in geometries("import", site, "--by", "anna")
    listed = json.loads(geometries("list", "--format", "json"))
    assert [(each["name"], each["from"], each["by"]) for each in listed] == [
        ("gate", "operator", "anna"),
        ("lane", "operator", "anna"),
    ]
    shown = json.loads(geometries("show", "gate"))
    assert shown["geometry"]["coordinates"] == [7.0, 50.002]
    written = tmp_path / "out.geojson"
    assert geometries("export", written, "gate").startswith("1 in ")
    assert [each["properties"]["name"] for each in json.loads(written.read_text())["features"]] == [
        "gate"
    ]
    assert "gate is deleted" in geometries("delete", "gate", "--by", "ben")
    listed = json.loads(geometries("list", "--format", "json"))
    assert listed[0]["from"] == "fleet"
    versions = json.loads(geometries("versions", "gate", "--format", "json"))
    assert [(each["by"], each["geometry"] is None) for each in versions] == [
        ("anna", False),
        ("ben", True),
    ]
    geometries("restore", "gate", versions[0]["number"], "--by", "carla")
    assert "carla" in geometries("versions", "gate")
    mission = tmp_path / "drawn.bpmn"
    mission.write_bytes(scenarios.drawn(scenarios.question(), gate=GATE))
    assert "mission" in geometries("list", "--mission", mission)


@pytest.mark.parametrize(
    ("arguments", "status", "says"),
    [
        (("show", "gat"), 1, "did you mean 'gate'?"),
        (("versions", "gate"), 1, "is not a geometry that operators have handed over"),
        (("delete", "gate"), 1, "is not a geometry that operators have handed over"),
        (("restore", "gate", 3), 1, "gate has no version 3"),
        (("export", "a.txt"), 2, "has none of these suffixes: .geojson"),
        (("import", "far.geojson"), 1, "from the fleet's origin"),
        (("import", "bad.geojson"), 1, "not all of it can be read"),
        (("import", "bad.geojson", "bad"), 1, "'bad' is not a route, area or point"),
        (("import", "link.kml"), 1, "link.kml: has no route, area or point"),
        (("import", "link.kml", "gate"), 1, "'gate' is not a route, area or point"),
    ],
)
def test_what_cannot_be_done_is_said_and_changes_nothing(
    invoke: Invoke,
    fleet: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[object, ...],
    status: int,
    says: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "far.geojson").write_text(features(("near", GATE), ("far", Point((0, 0, None)))))
    bad = features(("lane", GATE)).replace('"features": [', '"features": [{"type": "Feature"}, ')
    (tmp_path / "bad.geojson").write_text(bad)
    (tmp_path / "link.kml").write_text("<kml><NetworkLink><name>more</name></NetworkLink></kml>")
    found, _, err = invoke("geometries", *arguments, "--fleet", fleet)
    assert (found, says in err) == (status, True), err
    _, out, _ = invoke("geometries", "list", "--fleet", fleet, "--format", "json")
    assert [each["from"] for each in json.loads(out)] == ["fleet"]
