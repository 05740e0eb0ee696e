"""kill -9 in the middle of a time that a requirement asks for: the verdict is that of a run that
was not killed."""

import time
from pathlib import Path

import pytest

from tests.command_line import CommandLine, Program, Record

MISSION = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
    xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="x">
  <process id="P" isExecutable="true">
    <extensionElements>
      <m2pem:requirement id="in-file" pattern="existence">
        <m2pem:arg name="what" value="Long"/> <m2pem:arg name="within" value="{within}"/>
      </m2pem:requirement>
    </extensionElements>
    <startEvent id="Start"/>
    <sequenceFlow id="F1" sourceRef="Start" targetRef="Fork"/>
    <parallelGateway id="Fork"/>
    <sequenceFlow id="F2" sourceRef="Fork" targetRef="Long"/>
    <sequenceFlow id="F3" sourceRef="Fork" targetRef="Short"/>
    <intermediateCatchEvent id="Long"><timerEventDefinition>
      <timeDuration>{long}</timeDuration></timerEventDefinition></intermediateCatchEvent>
    <intermediateCatchEvent id="Short"><timerEventDefinition>
      <timeDuration>{short}</timeDuration></timerEventDefinition></intermediateCatchEvent>
    <sequenceFlow id="F4" sourceRef="Long" targetRef="Ready"/>
    <sequenceFlow id="F5" sourceRef="Short" targetRef="Middle"/>
    <endEvent id="Ready"/> <endEvent id="Middle"/>
  </process>
</definitions>
"""
SPEC = """requirements:
  - {{id: soon, ltl: "[](active(Long) -> <>[0 s, {within}] completed(Long))"}}
  - {{id: later, pattern: response, args: {{when: Short, then: Long, within: {long}}}}}
  - {{id: goes-on, ltl: "<>[0 s, 1 s] [][0 s, {within}] active(Long)"}}
  - {{id: breaks-off, pattern: absence, args: {{what: active(Long), for: {within}}}}}
"""
BATTERY = """requirements:
  - {id: charged, ltl: "[] ![][0 s, 20 s] battery(uav1) > 50 %"}
"""
FLEET = """version: 1
name: one-copter
origin: {lat: 38.1, lon: -77.3}
vehicles:
  uav1: {domain: air, arbiter: sim}
"""


def write(folder: Path, within: str, long: str, short: str, long_s: str) -> tuple[Path, Path]:
    """The mission, and the file with more requirements."""
    mission, spec = folder / "mission.bpmn", folder / "spec.yaml"
    text = MISSION.format(within=within, long=long, short=short)
    mission.write_text(text, encoding="utf-8")
    spec.write_text(SPEC.format(within=within, long=long_s), encoding="utf-8")
    return mission, spec


def begin(m2pem: CommandLine, mission: Path, spec: Path, speed: int, fleet: str = "sim") -> Program:
    return m2pem.start(
        "run", mission, "--fleet", fleet, "--spec", spec, "--speed", str(speed), "--format", "json",
        "--ocu", "none",
    )  # fmt: skip


def verdicts(records: list[Record]) -> dict[str, tuple[str, int]]:
    return {
        each["requirement"]: (each["verdict"], each["decided_us"])
        for each in records
        if each["record"] == "RequirementDecided"
    }


def resumed(m2pem: CommandLine) -> list[Record]:
    """Take the run up, to its end; all of its records, also those from before."""
    status, errors = m2pem.start("resume", "r1", "--ocu", "none").rest()
    assert (status, "bug" in errors) == (0, False), errors
    everything = m2pem.start("replay", "r1", "--format", "json")
    everything.rest()
    assert m2pem.run("replay", "r1", "--verify")[0] == 0
    return everything.records


def undisturbed(m2pem: CommandLine, mission: Path, spec: Path) -> dict[str, tuple[str, int]]:
    """The verdicts of a rehearsal."""
    program = m2pem.start("simulate", mission, "--spec", spec, "--format", "json")
    assert program.rest() == (0, "")
    return verdicts(program.records)


def test_a_run_that_is_killed_within_the_time_has_the_same_verdicts(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    mission, spec = write(tmp_path, "20 s", "PT30S", "PT8S", "30 s")
    program = begin(m2pem, mission, spec, speed=10)
    program.until_record("TokenLeft", element="Short")
    program.kill()
    assert verdicts(program.records) == {}
    found = verdicts(resumed(m2pem))
    expected = undisturbed(m2pem, mission, spec)
    assert set(found) == {"in-file", "soon", "later", "goes-on", "breaks-off"}
    assert expected == {
        "in-file": ("violated", 20_000_000),
        "soon": ("violated", 20_000_000),
        "breaks-off": ("violated", 20_000_000),
        "goes-on": ("satisfied", 20_000_000),
        "later": ("satisfied", 30_000_000),
    }
    assert found["in-file"] == ("violated", 20_000_000)  # from the beginning, so it is exact
    for name, (verdict, decided_us) in found.items():
        assert verdict == expected[name][0]
        assert abs(decided_us - expected[name][1]) < 1_000_000


def test_a_time_that_is_over_while_no_executive_runs_is_violated_when_it_was_over(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    """At the speed of the wall clock mission time goes on, as it does for timers."""
    mission, spec = write(tmp_path, "2 s", "PT3S", "PT0.1S", "4 s")
    program = begin(m2pem, mission, spec, speed=1)
    program.until_record("TokenLeft", element="Short")
    program.kill()
    killed_s = time.monotonic()
    assert verdicts(program.records) == {}
    while time.monotonic() - killed_s < 5.0:
        assert m2pem.run("runs")[0] == 0
    found = resumed(m2pem)
    assert verdicts(found)["in-file"] == ("violated", 2_000_000)
    verdict, decided_us = verdicts(found)["soon"]
    assert (verdict, round(decided_us / 1e6, 1)) == ("violated", 2.0)
    (claimed,) = (each for each in found if each["record"] == "RunClaimed")
    assert claimed["t"] > 4.0


@pytest.mark.parametrize("killed", [False, True])
def test_telemetry_that_no_executive_has_seen_is_no_evidence(
    m2pem: CommandLine, tmp_path: Path, killed: bool
) -> None:
    mission, spec = write(tmp_path, "20 s", "PT200S", "PT8S", "40 s")
    spec.write_text(BATTERY, encoding="utf-8")
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text(FLEET, encoding="utf-8")
    program = begin(m2pem, mission, spec, speed=20, fleet=str(fleet))
    program.until_record("TokenLeft", element="Short")
    if killed:
        program.kill()
        records = resumed(m2pem)
    else:
        assert program.rest()[0] == 0
        records = program.records
    verdict, decided_us = verdicts(records)["charged"]
    assert verdict == "violated"
    # It goes on for 20 s from the beginning, or from when the next executive looks.
    assert decided_us / 1e6 > 28 if killed else decided_us / 1e6 < 22
