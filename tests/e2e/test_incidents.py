"""An incident outlives the executive: kill -9, resume, resolve, and replay to the same state."""

import asyncio
import itertools
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from m2pem.api.clock import SystemClock
from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.command_line import ANSWERS, MISSION, CommandLine, Program, fleet_with_state
from tests.executive.conftest import flow, mission, task
from tests.incident_rows import CHOICES, SPARE, Provocation, Table, decide_after_kill


def stopped(m2pem: CommandLine, folder: Path, operators: str = "") -> tuple[Program, Path]:
    """The mission, with an incident of its first drive, and the state file of its vehicles.

    `operators`: those who decide about it, "" for all.
    """
    fleet, state = fleet_with_state(folder)
    who = f"incident_role: commander\noperators: {{commander: [{operators}]}}\n"
    text = f"{fleet.read_text()}\non_error: incident\n{who if operators else ''}"
    fleet.write_text(text)
    answers = folder / "answers.yaml"
    answers.write_text(
        (ANSWERS / "vignette1_detection.yaml").read_text()
        + "\nbehaviors:\n  DriveRoute: [{after: 1 s, end: failed, error: ROUTE_BLOCKED}]\n"
    )
    program = m2pem.start(
        "run", MISSION, "--fleet", fleet, "--simulate", "--speed", "20", "--format", "json",
        "--answers", answers,
    )  # fmt: skip
    opened = program.until_record("IncidentOpened", element="DriveRoute")
    assert (opened["code"], opened["resources"]) == ("ROUTE_BLOCKED", ["evsg1"])
    return program, state


def test_an_incident_is_resolved_after_kill_9_and_the_replay_is_equal(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    program, state = stopped(m2pem, tmp_path, "anna")
    program.type("resolve i1 skip")
    refused = "r1.i1: only operators with the role 'commander' may: anna; 'plain' is not"
    while refused not in program.stderr.readline():
        pass
    program.kill()
    assert "INCIDENT" in m2pem.run("replay", "r1", "--state")[1]
    resumed = m2pem.start("resume", "r1", "--format", "json")
    resumed.until_record("RunClaimed")
    status, listed, _ = m2pem.run("incidents")
    assert status == 0
    assert "r1.i1: " in listed
    assert "held for it: evsg1; for commander" in listed
    held = [each for each in recorded_effects(state) if each.kind is EffectKind.HOLD]
    assert held
    status, _, errors = m2pem.run("resolve", "r1", "i1", "move", "--to", "nowhere")
    assert status == 1
    assert "the token cannot move to 'nowhere'" in errors
    status, foreseen, _ = m2pem.run("resolve", "r1", "i1", "skip", "--preview")
    assert status == 0
    assert "the mission" in foreseen
    status, _, errors = m2pem.run("resolve", "r1", "i1", "retry", "--by", "ben")
    assert status == 1
    assert "r1.i1: only operators with the role 'commander' may: anna; 'ben' is not" in errors
    assert m2pem.run("resolve", "r1", "i1", "retry", "--by", "anna@here")[0] == 0
    assert m2pem.run("resolve", "r1", "i1", "skip", "--by", "ben")[0] == 1
    again = resumed.until_record("BehaviorRequested", element="DriveRoute")
    assert again["resources"] == ["evsg1"]
    assert m2pem.run("stop", "r1")[0] == 0
    assert resumed.rest()[0] == 130
    assert m2pem.run("replay", "r1", "--verify")[0] == 0


def test_an_operator_at_the_plain_unit_decides(m2pem: CommandLine, tmp_path: Path) -> None:
    program, _ = stopped(m2pem, tmp_path)
    program.type("incidents")
    program.type("resolve i1 end")
    ended = program.until_record("RunEnded", outcome="failed")
    assert "error ROUTE_BLOCKED from DriveRoute" in ended["detail"]
    resolved = [each for each in program.records if each["record"] == "IncidentResolved"]
    assert [(each["choice"], each["by"]) for each in resolved] == [("end", "plain")]
    assert program.rest()[0] == 1


def test_stop_ends_a_run_with_an_open_incident(m2pem: CommandLine, tmp_path: Path) -> None:
    program, _ = stopped(m2pem, tmp_path)
    program.type("stop")
    program.until_record("IncidentClosed")
    assert program.rest()[0] == 130


JOINED = """<?xml version="1.0" encoding="UTF-8"?>
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
             xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="test">
  <process id="P" isExecutable="true" m2pem:onError="incident">
    <startEvent id="S"/> <parallelGateway id="Fork"/> <parallelGateway id="Join"/>
    <scriptTask id="Bad"><script>throw error BAD</script></scriptTask>
    <userTask id="Ask"/> <task id="Home"/> <endEvent id="E"/>
    <sequenceFlow id="a" sourceRef="S" targetRef="Fork"/>
    <sequenceFlow id="b" sourceRef="Fork" targetRef="Bad"/>
    <sequenceFlow id="c" sourceRef="Fork" targetRef="Ask"/>
    <sequenceFlow id="d" sourceRef="Bad" targetRef="Join"/>
    <sequenceFlow id="e" sourceRef="Ask" targetRef="Join"/>
    <sequenceFlow id="f" sourceRef="Join" targetRef="Home"/>
    <sequenceFlow id="g" sourceRef="Home" targetRef="E"/>
  </process>
</definitions>
"""


def test_a_choice_after_which_the_mission_cannot_complete_must_be_confirmed(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    mission = tmp_path / "joined.bpmn"
    mission.write_text(JOINED)
    program = m2pem.start("run", mission, "--fleet", "sim", "--format", "json")
    program.until_record("IncidentOpened", element="Bad")
    move = ("resolve", "r1", "i1", "move", "--to", "Home")
    assert "cannot complete from there: stuck" in m2pem.run(*move, "--preview")[1]
    assert "completes on all paths" in m2pem.run("resolve", "r1", "i1", "skip", "--preview")[1]
    status, _, errors = m2pem.run(*move)
    assert status == 1
    assert "--even-if-stuck does it all the same" in errors
    program.type("resolve i1 move Home")
    program.type("resolve! i1 move Home")
    program.until_record("IncidentResolved", choice="move", by="plain")
    program.type("stop")
    assert program.rest()[0] == 130


TARGET = '<m2pem:property name="target" value="[0.01, 0.0]"/>'


def test_what_an_incident_blocks_is_listed(m2pem: CommandLine, tmp_path: Path) -> None:
    fleet, blocking = tmp_path / "fleet.yaml", tmp_path / "blocking.bpmn"
    rover = {"domain": "ground", "arbiter": "sim", "connection": {"faults": ["goto: fail at 1 s"]}}
    fleet.write_text(json.dumps({"version": 1, "vehicles": {"rover1": rover}}))
    tasks = {"Drive": "vehicle='rover1'", "Fetch": "requires='true' wait='unlimited'"}
    blocking.write_bytes(
        mission(
            '<process id="P" isExecutable="true" m2pem:onError="incident"><startEvent id="S"/>'
            + "".join(task(name, role, "goto", TARGET) for name, role in tasks.items())
            + '<parallelGateway id="Fork"/><endEvent id="E"/><endEvent id="F"/>'
            '<intermediateCatchEvent id="Later"><timerEventDefinition><timeDuration>PT2S'
            "</timeDuration></timerEventDefinition></intermediateCatchEvent>"
            + "".join(itertools.starmap(flow, itertools.pairwise(("S", "Fork", "Drive", "E"))))
            + "".join(itertools.starmap(flow, itertools.pairwise(("Fork", "Later", "Fetch", "F"))))
            + "</process>"
        )
    )
    program = m2pem.start(
        "run", blocking, "--fleet", fleet, "--simulate", "--speed", "10", "--format", "json"
    )
    program.until_record("AllocationDelayed", holders={"rover1": "r1.i1"})
    blocked = "blocked: Fetch of r1 waits since "
    status, listed, _ = m2pem.run("incidents")
    assert status == 0
    assert blocked in listed
    (incident,) = json.loads(m2pem.run("incidents", "--format", "json")[1])["incidents"]
    assert [(each["run"], each["element"]) for each in incident["blocks"]] == [("r1", "Fetch")]
    program.type("incidents")
    while blocked not in program.stderr.readline():
        pass
    program.type("resolve i1 skip")
    program.until_record("BehaviorRequested", element="Fetch")
    assert "no incident is open" in m2pem.run("incidents")[1]
    program.type("stop")
    assert program.rest()[0] == 130


# --- every error and every choice, with a kill while the incidents are open -----------------------

SPEED = 50.0
HOME = (38.1075, -77.3192)
LANE_DEG = 0.001
"""Of longitude between the lanes of two vehicles: 90 m."""
NEAR_DEG, FAR_DEG = 0.0005, 0.1
"""Of latitude to a target in a vehicle's own lane: 50 m, and 10 km."""
BLOCKED = (38.1100, -77.3192)
BLOCKER = "blocker1"
"""A vehicle that stands there."""
IN_THE_WAY = "another vehicle is in the way"
FAULTS = {
    "FAILED": "goto: fail at 1 s",
    "REJECTED": "goto: refuse",
    "TIMEOUT": "goto: fail TIMEOUT at 1 s",
    "LINK_LOST": "goto: cut link at 1 s",
    "BATTERY_LOW": "goto: fail BATTERY_LOW at 1 s",
    "ROUTE_BLOCKED": "goto: fail ROUTE_BLOCKED at 1 s",
}
ERRORS = (
    *FAULTS,
    "an operator has it",
    "an operator takes over",
    "a task takes it",
    IN_THE_WAY,
)


class Simulated(Table):
    """A vehicle of the simulated arbiter, which fails once, in a lane of its own."""

    def __init__(self, error: str, choice: str, lane: int) -> None:
        self.error, self.vehicle = error, f"{error}_{choice}".lower().replace(" ", "_")
        self.home = (HOME[0], HOME[1] + lane * LANE_DEG)

    def data(self) -> dict[str, Any]:
        return {"speed": 5, "target": [self.home[0] + NEAR_DEG, self.home[1]]}

    def far(self) -> dict[str, Any]:
        return {"target": [self.home[0] + FAR_DEG, self.home[1]]}

    def provocations(self) -> dict[str, Provocation]:
        async def available(_: str) -> None:
            await self.available()

        faults = {code: Provocation(code, mend=available) for code in FAULTS}
        blocked = Provocation("REJECTED", {"target": list(BLOCKED)}, mend=self.set_right)
        return {**self.common(), **faults, IN_THE_WAY: blocked}

    def connection(self, state: Path) -> dict[str, Any]:
        faults = [FAULTS[self.error]] if self.error in FAULTS else []
        return {"state": str(state), "home": list(self.home), "faults": faults}


def simulated_rows(m2pem: CommandLine, folder: Path, rows: Sequence[tuple[str, str]]) -> None:
    """Play rows: all come to their incidents, then the executive is killed."""
    tables = [Simulated(*row, lane) for lane, row in enumerate(rows, 1)]
    state = folder / "vehicles.state"
    connections = {each.vehicle: each.connection(state) for each in tables}
    connections[SPARE] = {"state": str(state), "home": list(HOME)}
    connections[BLOCKER] = {"state": str(state), "home": list(BLOCKED)}
    fleet = folder / "fleet.yaml"
    content: dict[str, Any] = {
        "version": 1,
        "origin": {"lat": HOME[0], "lon": HOME[1], "alt": 60.0},
        "allocation": {"preemption": True},
        "vehicles": {
            name: {"domain": "ground", "arbiter": "sim", "connection": connection}
            for name, connection in connections.items()
        },
    }
    if IN_THE_WAY in dict(rows):
        content["deconfliction"] = {"ground": {"horizontal": "3 m"}}
    fleet.write_text(json.dumps(content), encoding="utf-8")
    journal = folder / "journal.db"

    def serve() -> Program:
        words = ("--fleet", fleet, "--journal", journal, "--speed", f"{SPEED:g}", "--ocu", "none")
        program = m2pem.start("serve", *words)
        assert "serving" in program.stderr.readline()
        return program

    played = [(table, error, choice) for table, (error, choice) in zip(tables, rows, strict=True)]
    asyncio.run(decide_after_kill(serve, journal, SystemClock(SPEED), played))
    held = {each.resource for each in recorded_effects(state) if each.kind is EffectKind.HOLD}
    assert held >= {each.vehicle for each in tables if each.error in ("FAILED", "ROUTE_BLOCKED")}


def test_each_choice_is_made_after_kill_9_and_the_replay_is_equal(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    errors = (
        "ROUTE_BLOCKED",
        IN_THE_WAY,
        "REJECTED",
        "an operator has it",
        "FAILED",
        "BATTERY_LOW",
    )
    simulated_rows(m2pem, tmp_path, list(zip(errors, CHOICES, strict=True)))


@pytest.mark.long
@pytest.mark.parametrize("error", ERRORS)
def test_every_choice_about_every_error_is_made_after_kill_9(
    m2pem: CommandLine, tmp_path: Path, error: str
) -> None:
    simulated_rows(m2pem, tmp_path, [(error, choice) for choice in CHOICES])
