"""A copter's route is interrupted, and goes on where it was: simulated autopilots, real UDP."""

import json
from contextlib import contextmanager
from pathlib import Path

import pytest
from mavlink_copters import ROUND, simulated, task, write
from mavlink_sitl import free_port
from test_mavlink_reassigning import of_kind

from tests.command_line import command_line
from tests.executive.conftest import flow, mission

SPEED = "30"
ROUNDS = 2
UAV = "vehicle='uav1'"
TASKS = (
    task("Up", "takeoff", UAV, altitude="10"),
    task("Fly", "single_vehicle_routing", UAV, route="around", speed="8 m/s"),
    task("Detour", "goto", UAV, target="[38.1070, -77.3190, 10]"),
    task("Rest", "single_vehicle_routing", UAV, route="${Fly.remaining}", speed="8 m/s"),
    task("Down", "land", UAV),
)
FLOWS = (
    *(("S", "Up"), ("Up", "Fly"), ("Fly", "Down"), ("Down", "E")),
    *(("Away", "Detour"), ("Detour", "Rest"), ("Rest", "Down")),
)
MISSION = mission(
    '<signal id="Look"/><process id="P" isExecutable="true"><startEvent id="S"/><endEvent id="E"/>'
    + "".join(xml for _, xml in TASKS)
    + '<boundaryEvent id="Away" attachedToRef="Fly"><signalEventDefinition signalRef="Look"/>'
    + "</boundaryEvent>"
    + "".join(flow(*pair) for pair in FLOWS)
    + "</process>"
)


def test_a_route_that_a_signal_has_interrupted_goes_on_where_it_was(tmp_path: Path) -> None:
    port = free_port()
    file, fleet = write(tmp_path, port, MISSION, lost_after="40 s", rounds=ROUNDS)
    with contextmanager(command_line)(tmp_path) as m2pem:
        m2pem.start(*simulated(port, SPEED))
        words = ("--speed", SPEED, "--ocu", "none", "--format", "json")
        program = m2pem.start("run", file, "--fleet", fleet, *words)
        begun = program.until_record("BehaviorRequested", element="Fly")["behavior"]
        while not of_kind(program.records, "BehaviorProgressed", behavior=begun) or not any(
            "remaining" in each and each["remaining"] for each in program.records
        ):
            program.until_record("BehaviorProgressed")
        assert m2pem.run("signal", "r1", "Look")[0] == 0
        status, errors = program.rest()
    assert status == 0, errors
    (interrupted,) = of_kind(program.records, "TokenLeft", element="Fly")
    assert interrupted["outcome"] == "interrupted"
    (rest,) = of_kind(program.records, "BehaviorRequested", element="Rest")
    left = json.loads(rest["parameters"]["route"])["geometry"]["coordinates"]
    assert left[0][:2] != pytest.approx(ROUND[0], abs=1e-6)
    assert 1 <= len(left) <= len(ROUND * ROUNDS)
    assert left[-1][:2] == pytest.approx(ROUND[-1], abs=1e-6)
    written = [each["value"] for each in of_kind(program.records, "DataWritten")]
    assert written[-1] == ""
