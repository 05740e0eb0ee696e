"""Estimates of missions, beside rehearsals of the same."""

import json
from pathlib import Path

import pytest

from m2pem.api.estimates import MissionEstimate
from m2pem.api.runs import RunStatus
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import rehearse
from m2pem.scripting.checking import check
from m2pem.scripting.sources import load_mission
from m2pem.simulation.estimates import estimate_mission

FLEET = """version: 1
origin: {lat: 38.10, lon: -77.30}
vehicles:
  rover: {domain: ground, arbiter: sim, cruise_speed: 4 m/s, endurance: 2 h}
  uav: {domain: air, arbiter: sim, cruise_speed: 8 m/s, endurance: ENDURANCE,
        connection: {altitude: 30 m}}
"""
HEAD = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
 xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="t"><process id="p" isExecutable="true">
 <extensionElements><m2pem:geometry name="lane">{"type": "LineString", "coordinates":
 [[-77.30, 38.101, 40], [-77.297, 38.101, 40], [-77.297, 38.103, 60]]}</m2pem:geometry>
 </extensionElements>"""
TAIL = "</process></definitions>"


def task(name: str, behavior: str, vehicle: str, **parameters: str) -> str:
    written = "".join(
        f'<m2pem:property name="{key}" value="{value}"/>' for key, value in parameters.items()
    )
    return (
        f'<scriptTask id="{name}"><extensionElements>'
        f'<m2pem:behavior type="vehicle" name="{behavior}">'
        f"<m2pem:properties>{written}</m2pem:properties><m2pem:resources>"
        f'<m2pem:role name="r" vehicle="{vehicle}"/></m2pem:resources></m2pem:behavior>'
        "</extensionElements></scriptTask>"
    )


def flows(*ways: tuple[str, str]) -> str:
    return "".join(f'<sequenceFlow id="{a}-{b}" sourceRef="{a}" targetRef="{b}"/>' for a, b in ways)


TOGETHER = (
    '<startEvent id="s"/><parallelGateway id="fork"/><parallelGateway id="join"/>'
    '<endEvent id="e"/>'
    + task("Fly", "single_vehicle_routing", "uav", route="lane")
    + task("Back", "return_to_launch", "uav")
    + task("Drive", "single_vehicle_routing", "rover", route="lane", speed="3 m/s")
    + '<intermediateCatchEvent id="pause"><timerEventDefinition>'
    "<timeDuration>PT90S</timeDuration></timerEventDefinition></intermediateCatchEvent>"
    + flows(("s", "fork"), ("fork", "Fly"), ("Fly", "pause"), ("pause", "Back"), ("Back", "join"))
    + flows(("fork", "Drive"), ("Drive", "join"), ("join", "e"))
)


def fleet(folder: Path, endurance: str = "30 min") -> Fleet:
    path = folder / "fleet.yaml"
    path.write_text(FLEET.replace("ENDURANCE", endurance))
    return load_fleet(path)


def estimate(folder: Path, process: str, endurance: str = "30 min") -> MissionEstimate:
    mission = load_mission((HEAD + process + TAIL).encode())
    return estimate_mission(mission, fleet(folder, endurance))


def test_an_estimate_is_what_a_rehearsal_takes(tmp_path: Path) -> None:
    found = estimate(tmp_path, TOGETHER)
    assert found.left_out == ()
    source = (HEAD + TOGETHER + TAIL).encode()
    played = rehearse(source, fleet(tmp_path), plugins=PluginManager(), telemetry_every_s=1.0)
    assert found.time_s == pytest.approx(played.summary.took_s, rel=0.02)
    last = played.telemetry[-1].vehicles
    assert [each.vehicle for each in found.vehicles] == ["rover", "uav"]
    for each in found.vehicles:
        charge = next(
            state.battery_fraction for name, state in last.items() if name == each.vehicle
        )
        assert each.battery_left == pytest.approx(charge, abs=0.01)
        assert each.stated
    drive = next(each for each in found.tasks if each.element == "Drive")
    assert drive.distance_m == pytest.approx(111 + 263 + 222, rel=0.05)
    assert drive.time_s == pytest.approx(drive.distance_m / 3, rel=0.1)


def test_a_battery_that_does_not_last_is_below_zero(tmp_path: Path) -> None:
    (_, found) = estimate(tmp_path, TOGETHER, "2 min").vehicles
    assert found.battery_left < 0
    (_, enough) = estimate(tmp_path, TOGETHER, "60 min").vehicles
    assert enough.battery_left > 0.8


def test_what_cannot_be_estimated_is_said_and_the_rest_is_counted(tmp_path: Path) -> None:
    process = (
        '<startEvent id="s"/><exclusiveGateway id="again"/><exclusiveGateway id="which"/>'
        '<endEvent id="e"/><userTask id="Ask"/><serviceTask id="Look" m2pem:class="Detector"/>'
        + task("Fly", "single_vehicle_routing", "uav", route="lane")
        + task("Escort", "follow", "uav", target="rover")
        + task("Aim", "goto", "uav", target="${mission.place}")
        + flows(("s", "again"), ("again", "Ask"), ("Ask", "Look"), ("Look", "Fly"))
        + flows(("Fly", "Aim"), ("Aim", "Escort"), ("Escort", "which"))
        + flows(("which", "again"), ("which", "e"))
    )
    found = estimate(tmp_path, process)
    reasons = {(each.element, each.reason.split(":")[0]) for each in found.left_out}
    assert reasons == {
        ("Ask", "how long an operator takes is not known"),
        ("Look", "how long its service takes is not known"),
        ("Aim", "'target' is known only when it starts"),
        ("Escort", "it does not end by itself"),
        ("again", "a loop"),
    }
    assert [each.element for each in found.tasks] == ["Fly"]


def test_of_two_ways_the_longer_one_counts(tmp_path: Path) -> None:
    process = (
        '<startEvent id="s"/><exclusiveGateway id="which"/><exclusiveGateway id="merge"/>'
        '<endEvent id="e"/>'
        + task("Far", "single_vehicle_routing", "rover", route="lane")
        + task("Near", "goto", "rover", target="[38.1001, -77.30]")
        + flows(("s", "which"), ("which", "Near"), ("which", "Far"))
        + flows(("Near", "merge"), ("Far", "merge"), ("merge", "e"))
    )
    found = estimate(tmp_path, process)
    far = next(each for each in found.tasks if each.element == "Far")
    assert found.vehicles[0].time_s == pytest.approx(far.time_s)
    assert found.time_s == pytest.approx(far.time_s, abs=0.01)


def test_the_check_warns_where_a_stated_endurance_is_not_enough(tmp_path: Path) -> None:
    (tmp_path / "m.bpmn").write_text(HEAD + TOGETHER + TAIL)
    fleet(tmp_path, "3 min")
    [finding] = check(tmp_path / "m.bpmn", tmp_path / "fleet.yaml")
    assert (finding.rule, finding.element) == ("endurance", "Back")
    assert "the battery of uav is empty before the mission's end" in finding.message
    fleet(tmp_path, "30 min")
    assert check(tmp_path / "m.bpmn", tmp_path / "fleet.yaml") == ()


@pytest.mark.parametrize("vehicle", ["rover", "uav"])
def test_a_return_around_a_hole_takes_what_its_rehearsal_takes(
    tmp_path: Path, vehicle: str
) -> None:
    """The straight way home leads through the hole, which is 400 m wide."""
    rings = [
        [[east / 87_500 - 77.3, north / 111_000 + 38.1] for east, north in ring]
        for ring in (
            [(-300, -100), (300, -100), (300, 700), (-300, 700), (-300, -100)],
            [(-200, 200), (200, 200), (200, 300), (-200, 300), (-200, 200)],
        )
    ]
    (tmp_path / "yard.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": rings}))
    fenced = tmp_path / "fenced.yaml"
    fleet(tmp_path, "20 min")
    text = (tmp_path / "fleet.yaml").read_text().replace("2 h", "20 min")
    fenced.write_text(text + "areas: {yard: yard.geojson}\nfence: yard\n")
    process = (
        '<startEvent id="s"/><endEvent id="e"/>'
        + task("Side", "goto", vehicle, target="[38.10225, -77.2968]")
        + task("Far", "goto", vehicle, target="[38.1045, -77.3]")
        + task("Back", "return_to_launch", vehicle)
        + flows(("s", "Side"), ("Side", "Far"), ("Far", "Back"), ("Back", "e"))
    )
    source = (HEAD + process + TAIL).encode()
    found = estimate_mission(load_mission(source), load_fleet(fenced))
    played = rehearse(source, load_fleet(fenced), plugins=PluginManager(), telemetry_every_s=1.0)
    assert played.summary.status is RunStatus.COMPLETED
    assert found.time_s == pytest.approx(played.summary.took_s, rel=0.02)
    back = next(each for each in found.tasks if each.element == "Back")
    assert back.distance_m > 640  # 500 m straight on
    charge = next(
        state.battery_fraction
        for name, state in played.telemetry[-1].vehicles.items()
        if name == vehicle
    )
    (only,) = found.vehicles
    assert only.battery_left == pytest.approx(charge, abs=0.02)
