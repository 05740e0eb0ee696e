"""A vehicle is lost in a rehearsal, and another flies the rest of its route."""

import json
from pathlib import Path
from typing import Any

from tests.cli.conftest import Invoke
from tests.command_line import CommandLine

FLEET = """
version: 1
origin: {lat: 38.1075, lon: -77.3192, alt: 60.0}
vehicles:
  uav1:
    domain: air
    arbiter: sim
    connection: {home: [38.1080, -77.3192], altitude: 30 m}
    cruise_speed: 5 m/s
  uav2:
    domain: air
    arbiter: sim
    connection: {home: [38.1070, -77.3192], altitude: 30 m}
    cruise_speed: 5 m/s
routes: {along: along.geojson}
"""

ROUTE = [[-77.3192, 38.1080 + 0.0005 * number] for number in range(1, 9)]

MISSION = """
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="urn:t"
             xmlns:m2pem="https://m2pem.org/schema/1">
  <process id="P" isExecutable="true">
    <startEvent id="S"/>
    <scriptTask id="Fly"><extensionElements>
      <m2pem:behavior type="vehicle" name="single_vehicle_routing">
        <m2pem:properties><m2pem:property name="route" value="along"/></m2pem:properties>
        <m2pem:resources><m2pem:role name="scout" requires="true" onLoss="reassign"/>
        </m2pem:resources>
      </m2pem:behavior>
    </extensionElements></scriptTask>
    <endEvent id="E"/>
    <sequenceFlow id="f" sourceRef="S" targetRef="Fly"/>
    <sequenceFlow id="g" sourceRef="Fly" targetRef="E"/>
  </process>
</definitions>
"""


def files(folder: Path) -> tuple[Path, Path]:
    fleet, mission = folder / "fleet.yaml", folder / "m.bpmn"
    fleet.write_text(FLEET)
    mission.write_text(MISSION)
    line = {"type": "LineString", "coordinates": ROUTE}
    (folder / "along.geojson").write_text(json.dumps(line))
    return mission, fleet


def test_a_rehearsal_with_a_lost_vehicle_shows_another_one_that_flies_the_rest(
    invoke: Invoke, tmp_path: Path
) -> None:
    mission, fleet = files(tmp_path)
    answers = tmp_path / "answers.yaml"
    answers.write_text("behaviors: {Fly: [{after: 60 s, end: lost}]}")
    chart = tmp_path / "chart.svg"
    words = ("simulate", mission, "--fleet", fleet, "--answers", answers, "--gantt", chart)
    status, out, err = invoke(*words, "--format", "json")
    assert status == 0, err
    records: list[dict[str, Any]] = [json.loads(line) for line in out.splitlines()]
    asked = [each for each in records if each["record"] == "BehaviorRequested"]
    assert [each["resources"] for each in asked] == [["uav1"], ["uav2"]]
    left = asked[1]["parameters"]["route"]["geometry"]["coordinates"]
    assert 1 < len(left) < len(ROUTE)
    assert left[-1][:2] == ROUTE[-1]
    drawn = chart.read_text()
    assert drawn.count("single_vehicle_routing") >= 2
    assert "uav2" in drawn


def test_after_a_kill_between_the_loss_and_the_new_choice_the_rest_is_done(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    """The only vehicle is lost, and its executive is killed. The next one holds the vehicle first,
    and has it do what it had left."""
    mission, fleet = files(tmp_path)
    alone = FLEET[: FLEET.index("  uav2:")] + FLEET[FLEET.index("routes:") :]
    fault = "m, faults: ['single_vehicle_routing: cut link at 60 s']}"
    fleet.write_text(alone.replace("m}", fault))
    mission.write_text(MISSION.replace("onLoss", 'wait="unlimited" onLoss'))
    words = ("--speed", "50", "--ocu", "none", "--format", "json")
    program = m2pem.start("run", mission, "--fleet", fleet, *words)
    program.until_record("AllocationDelayed")
    program.kill()
    status, out, err = m2pem.run("resume", "r1", "--ocu", "none", "--format", "json")
    assert status == 0, err
    status, out, _ = m2pem.run("replay", "r1", "--format", "json")
    records = [json.loads(line) for line in out.splitlines()]
    names = [each["record"] for each in records]
    first, again = (n for n, name in enumerate(names) if name == "BehaviorRequested")
    assert first < names.index("RunClaimed") < names.index("ResourceReturned") < again
    (lost,) = [each for each in records if each["record"] == "WorkReassigned"]
    assert records[again]["parameters"] == lost["parameters"]
    left = lost["parameters"]["route"]["geometry"]["coordinates"]
    assert 1 < len(left) < len(ROUTE)
    assert records[-1]["outcome"] == "completed"
