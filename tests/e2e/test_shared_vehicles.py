"""Runs of one executive that need the same vehicles: they wait, preempt, and wait in a circle."""

import re
from pathlib import Path

import pytest

from tests.command_line import CommandLine, Program
from tests.executive.conftest import flow, mission, sequence, task
from tests.waiting_circle import GO, NONE_GOES_ON, holding_and_waiting, write_fleet


def serving(m2pem: CommandLine, fleet: Path, ocu: str = "none", speed: str = "50") -> Program:
    """An executive that serves and prints the records of all runs."""
    words = ("--fleet", fleet, "--ocu", ocu, "--speed", speed, "--format", "json")
    program = m2pem.start("serve", *words)
    assert "serving" in program.stderr.readline()
    return program


def said(program: Program, text: str) -> str:
    """Wait until the executive says it on standard error."""
    for line in program.stderr:
        if text in line:
            return line
    raise AssertionError(f"it ended before it said {text!r}")


def begin(m2pem: CommandLine, file: Path, content: bytes) -> str:
    """Start a mission by `m2pem start`; the run."""
    file.write_bytes(content)
    status, run, errors = m2pem.run("start", file)
    assert status == 0, errors
    return run.strip()


def until_relieved(role: str) -> bytes:
    """A mission whose task Patrol ends at signal Relief."""
    wait = '<m2pem:property name="timeout" value="3600"/>'
    event = (
        '<boundaryEvent id="B" attachedToRef="Patrol"><signalEventDefinition signalRef="Relief"/>'
        f"</boundaryEvent>{flow('B', 'E')}"
    )
    body = sequence(("Patrol", task("Patrol", role, "teleop", wait)))
    return mission('<signal id="Relief"/>' + body.replace("</process>", f"{event}</process>"))


def test_runs_that_need_one_rover_take_turns_by_priority(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    server = serving(m2pem, write_fleet(tmp_path))
    begin(m2pem, tmp_path / "patrol.bpmn", until_relieved("vehicle='ugv1' wait='unlimited'"))
    server.until_record("BehaviorProgressed", run="r1", state="RUNNING")
    for run, priority in (("r2", "0"), ("r3", "5")):
        role = f"vehicle='ugv1' wait='unlimited' priority='{priority}'"
        back = task("Back", role, "reverse", '<m2pem:property name="distance" value="5 m"/>')
        assert begin(m2pem, tmp_path / f"{run}.bpmn", mission(sequence(("Back", back)))) == run
        delayed = server.until_record("AllocationDelayed", run=run)
        assert delayed["holders"] == {"ugv1": "r1.b1"}
    status, running, _ = m2pem.run("fleet", "--running")
    assert status == 0
    assert re.search(r"^ugv1 +Patrol of r1 \(r1\.b1\)$", running, re.MULTILINE)
    held = "role 'driver': ugv1 is held by Patrol of r1 (r1.b1)"
    waiting = re.findall(r"^(r\d) +Back +\d.* +- +(\d) +(.*)$", running, re.MULTILINE)
    assert waiting == [("r3", "5", held), ("r2", "0", held)]
    assert m2pem.run("signal", "r1", "Relief")[0] == 0
    for run in ("r1", "r3", "r2"):
        ended = server.until_record("RunEnded", run=run)
        assert ended["outcome"] == "completed"
    behaviors = [
        (each["record"], each["run"])
        for each in server.records
        if each["record"] in ("BehaviorRequested", "BehaviorEnded")
    ]
    assert behaviors == [
        (what, run) for run in ("r1", "r3", "r2") for what in ("BehaviorRequested", "BehaviorEnded")
    ]


def test_a_run_goes_on_with_the_rest_after_one_of_greater_priority(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet = write_fleet(tmp_path, "allocation: {preemption: true}\n")
    server = serving(m2pem, fleet, "plain")
    role = "requires=\"vehicle.name == 'ugv1'\" wait='unlimited' onLoss='reassign'"
    route = '<m2pem:property name="route" value="north"/><m2pem:property name="speed" value="5"/>'
    drive = task("Drive", role, "single_vehicle_routing", route)
    begin(m2pem, tmp_path / "low.bpmn", mission(sequence(("Drive", drive))))
    server.until(lambda line: '"remaining"' in line)
    high = tmp_path / "high.bpmn"
    high.write_bytes(mission(sequence(("Halt", task("Halt", "vehicle='ugv1' priority='5'")))))
    server.type(f"start! {high}")  # another command would take longer to begin
    taken = "ugv1 goes to Halt of r2, whose priority 5 is greater than 0"
    assert said(server, "is preempted") == f"m2pem: r1: Drive is preempted: {taken}\n"
    rest = server.until_record("WorkReassigned", run="r1")["parameters"]["route"]
    assert 1 < len(rest["geometry"]["coordinates"]) <= 10
    assert rest["geometry"]["coordinates"][0][1] > 38.001
    assert server.until_record("RunEnded")["run"] == "r2"
    again = server.until_record("BehaviorRequested", run="r1", behavior="r1.b2")
    assert again["parameters"]["route"] == rest
    assert server.until_record("RunEnded", run="r1")["outcome"] == "completed"
    explained = m2pem.run("explain", "r2", "Halt")[1]
    assert "waits: ugv1 is taken from Drive of r1, whose priority is lower" in explained
    assert re.search(r"^ugv1 .* taken from r1\.b1$", explained, re.MULTILINE)
    left = m2pem.run("explain", "r1", "Drive")[1]
    assert "to do what single_vehicle_routing of Drive (r1.b1) left" in left


@pytest.mark.parametrize("stops", ["command", "plain"])
def test_one_of_two_runs_that_wait_for_each_other_is_stopped_and_the_other_completes(
    m2pem: CommandLine, tmp_path: Path, stops: str
) -> None:
    server = serving(m2pem, write_fleet(tmp_path), "plain")
    for run, holds, needs in (("r1", "ugv1", "ugv2"), ("r2", "ugv2", "ugv1")):
        begin(m2pem, tmp_path / f"{run}.bpmn", holding_and_waiting(holds, needs))
        server.until_record("BehaviorProgressed", run=run, state="RUNNING")
    for run in ("r1", "r2"):
        server.type(f"signal {run} {GO}")
    alert = said(server, NONE_GOES_ON)
    assert "Need of r1 (r1) waits for ugv2 (held by Hold of r2 (r2)); Need of r2 (r2)" in alert
    (named,) = re.findall("`m2pem (stop r2)`", alert)
    if stops == "command":
        assert m2pem.run(*named.split()) == (0, "", "stopped: r2\n")
    else:
        server.type(named)
    assert server.until_record("RunEnded", run="r2")["outcome"] == "stopped"
    assert server.until_record("BehaviorEnded", element="Need")["state"] == "SUCCEEDED"
    assert server.until_record("RunEnded", run="r1")["outcome"] == "terminated"
