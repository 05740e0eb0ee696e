"""The m2pem node of a surveying vehicle is killed (SIGKILL): another does the rest, over DDS."""

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_ros.frames import to_geodetic
from ros_e2e_programs import Program, Programs
from ros_e2e_world import ORIGIN

from m2pem.api import LocalFrame

HERE = Path(__file__).parent
SPEED = 4.0
WIDTH_M, HEIGHT_M, SPACING_M = 60.0, 120.0, 20.0
NAMES = ("first", "second")


def at(east_m: float, north_m: float) -> tuple[float, float]:
    place = to_geodetic(east_m, north_m, 0.0, ORIGIN)
    return place.latitude_deg, place.longitude_deg


def fleet_file(folder: Path) -> Path:
    corners = [(0, 0), (WIDTH_M, 0), (WIDTH_M, HEIGHT_M), (0, HEIGHT_M), (0, 0)]
    ring = [[lon, lat] for lat, lon in (at(*corner) for corner in corners)]
    (folder / "field.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    vehicles = {
        name: {
            "domain": "ground",
            "arbiter": "ros",
            "sitl": True,
            "lost_after": "10 s",
            "connection": {"namespace": f"/{name}", "own_behaviors": {"area_survey": None}},
        }
        for name in NAMES
    }
    content = {
        "version": 1,
        "origin": dict(zip(("lat", "lon", "alt"), ORIGIN, strict=True)),
        "vehicles": vehicles,
        "areas": {"field": "field.geojson"},
    }
    (folder / "fleet.yaml").write_text(json.dumps(content))
    return folder / "fleet.yaml"


def mission(folder: Path) -> Path:
    """One vehicle, the first if it is free, surveys the field; another one if it is lost."""
    file = folder / "survey.bpmn"
    file.write_text(
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
        ' xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="https://m2pem.org/scenarios">'
        '<process id="P" isExecutable="true"><startEvent id="S"/><scriptTask id="Survey">'
        '<extensionElements><m2pem:behavior type="vehicle" name="area_survey"><m2pem:properties>'
        '<m2pem:property name="area" value="field"/><m2pem:property name="speed" value="5 m/s"/>'
        f'<m2pem:property name="spacing" value="{SPACING_M:g} m"/></m2pem:properties>'
        '<m2pem:resources><m2pem:role name="surveyor" requires="true" onLoss="reassign"'
        " prefer=\"vehicle.name == 'first' ? 1000 : 0\"/></m2pem:resources></m2pem:behavior>"
        '</extensionElements></scriptTask><endEvent id="E"/>'
        '<sequenceFlow id="f" sourceRef="S" targetRef="Survey"/>'
        '<sequenceFlow id="g" sourceRef="Survey" targetRef="E"/></process></definitions>'
    )
    return file


def extent_m2(area: Any) -> float:
    """Return the extent of a polygon as a GeoJSON feature, by the shoelace formula."""
    frame = LocalFrame(ORIGIN[:2])
    (places,) = area["geometry"]["coordinates"]
    ring = [frame.to_local((lat, lon)) for lon, lat, *_ in places]
    return abs(sum(x * v - u * y for (x, y), (u, v) in pairwise(ring))) / 2


@pytest.mark.long
def test_another_vehicle_does_the_rest_of_a_survey_whose_node_is_killed(m2pem: Programs) -> None:
    nodes: dict[str, Program] = {}
    for east_m, name in zip((-10.0, -30.0), NAMES, strict=True):
        place = at(east_m, 0.0)
        nodes[name] = m2pem.python(HERE / "ros_survey_peer.py", SPEED, name, *place)
        nodes[name].until_line("ready")
    program = m2pem.run(mission(m2pem.folder), fleet_file(m2pem.folder), SPEED)

    def left() -> list[Any]:
        seen = program.those("BehaviorProgressed", behavior="r1.b1")
        return [each["remaining"]["area"] for each in seen if each.get("remaining")]

    whole_m2 = WIDTH_M * HEIGHT_M
    program.until(lambda: left() and extent_m2(left()[-1]) < 0.7 * whole_m2)
    nodes["first"].kill()
    lost = program.until_record("WorkReassigned")
    assert (lost["code"], lost["excluded"]) == ("LINK_LOST", ["first"])
    assert program.until_record("RunEnded")["outcome"] == "completed", program.said
    assert program.rest() == 0
    begun, again = program.those("BehaviorRequested")
    assert (begun["resources"], again["resources"]) == (["first"], ["second"])
    assert again["parameters"]["area"] == left()[-1] == lost["remaining"]["area"]
    assert 0.1 * whole_m2 < extent_m2(again["parameters"]["area"]) < 0.7 * whole_m2
    assert again["parameters"]["spacing"] == pytest.approx(SPACING_M, rel=0.1)
