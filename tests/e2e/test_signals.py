"""SIGINT and SIGTERM, and a reader who goes away."""

import signal
from contextlib import suppress
from pathlib import Path

import pytest

from m2pem.simulation.state_file import recorded_effects
from tests.command_line import (
    ANSWERS,
    BLOCKING,
    FLEET,
    MISSION,
    CommandLine,
    Program,
    fleet_with_state,
    install_plugin,
)

ABORTED = ANSWERS / "vignette1_detection.yaml"


def driving(m2pem: CommandLine, fleet: Path, *words: str, **environment: str) -> Program:
    """The mission, with evsg1 on its route."""
    program = m2pem.start(
        "run", MISSION, "--fleet", fleet, "--format", "json", "--ocu", "none",
        "--answers", ABORTED, *words, **environment,
    )  # fmt: skip
    program.until_record("BehaviorProgressed", state="RUNNING")
    return program


@pytest.mark.parametrize(
    "number", [pytest.param(signal.SIGINT, marks=pytest.mark.long), signal.SIGTERM]
)
def test_a_signal_stops_the_run_and_releases_its_vehicles(
    m2pem: CommandLine, tmp_path: Path, number: signal.Signals
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    program = driving(m2pem, fleet, "--speed", "2")  # the mission itself stops it after 9 s
    program.send(number)
    assert program.until_record("RunEnded")["detail"] == f"stopped by {number.name}"
    program.until_record("BehaviorEnded", state="CANCELLED")
    assert program.rest()[0] == 130
    assert [each.kind.value for each in recorded_effects(state)] == ["start", "cancel", "end"]
    assert "stopped" in m2pem.run("runs")[1]


def slow_fleet(tmp_path: Path) -> Path:
    """Vehicles that take an hour to stop."""
    fleet, _ = fleet_with_state(tmp_path)
    text = fleet.read_text(encoding="utf-8")
    fleet.write_text(text.replace("connection: {", "connection: {deceleration: 0.0001, "))
    return fleet


def test_a_second_signal_says_what_is_waited_for_and_a_third_gives_up(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    program = driving(m2pem, slow_fleet(tmp_path), "--speed", "20")
    program.until_record("ServiceEnded")  # some seconds later: it is moving
    program.send(signal.SIGINT)
    program.until_record("RunEnded", outcome="stopped")
    program.send(signal.SIGINT)
    assert "stopping; waiting for evsg1" in program.stderr.readline()
    assert "still waiting for evsg1" in program.stderr.readline()
    program.send(signal.SIGTERM)
    status, errors = program.rest()
    assert status == 130
    assert "gave up; not released: evsg1" in errors


CLOSING = """
import asyncio, os, sys
from m2pem.journal.sqlite import SqliteJournal

close = SqliteJournal.close

async def slowly(self):
    print("it is closing", file=sys.stderr, flush=True)
    while not os.path.exists("go on"):
        await asyncio.sleep(0.01)
    await close(self)

SqliteJournal.close = slowly
"""


@pytest.mark.parametrize("gives_up", [False, True], ids=["waits", "gives up"])
@pytest.mark.parametrize("standby", [False, pytest.param(True, marks=pytest.mark.long)])
def test_signals_while_it_closes_end_nothing_before_the_third(
    m2pem: CommandLine, tmp_path: Path, gives_up: bool, standby: bool
) -> None:
    words = ("serve", "--fleet", fleet_with_state(tmp_path)[0], "--ocu", "none")
    if standby:
        owner = m2pem.start(*words)
        owner.until_said("serving")
    plugin = install_plugin(tmp_path, "closing", CLOSING)
    program = m2pem.start(*words, *(("--standby",) if standby else ()), **plugin)
    program.until_said("standing by" if standby else "serving")
    program.send(signal.SIGTERM)
    program.until_said("it is closing")
    program.send(signal.SIGTERM)
    program.until_said("SIGTERM: still waiting for the journal; once more to give up")
    if gives_up:
        program.send(signal.SIGINT)
    else:
        (tmp_path / "go on").touch()
    status, errors = program.rest()
    assert status == (130 if gives_up else 0), errors
    assert ("SIGINT: gave up; not released: nothing" in errors) is gives_up


def test_a_third_signal_ends_an_executive_that_a_plugin_blocks(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    plugin = install_plugin(tmp_path, "blocking", BLOCKING)
    program = driving(m2pem, FLEET, **plugin)
    program.send(signal.SIGUSR1)
    program.until_said("blocks the executive")
    program.send(signal.SIGTERM)
    program.until_said("SIGTERM: stopping; waiting for evsg1")
    while program.process.poll() is None:
        program.send(signal.SIGINT)
        with suppress(TimeoutError):  # one that comes just before it sleeps on is not seen
            program.process.wait(0.2)
    status, errors = program.rest()
    assert status == 130
    assert "SIGINT: gave up; not released: evsg1" in errors


def test_a_run_whose_reader_goes_away_is_stopped(m2pem: CommandLine, tmp_path: Path) -> None:
    fleet, state = fleet_with_state(tmp_path)
    program = driving(m2pem, fleet, "--speed", "20")
    program.stdout.close()
    program.process.wait()
    assert program.process.returncode == 130
    assert program.stderr.read() == ""
    assert [each.kind.value for each in recorded_effects(state)][-1] == "end"
    assert "the reader of its output has ended" in m2pem.run("runs")[1]


def test_a_reader_who_stands_still_does_not_hold_the_mission_up(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    loop = tmp_path / "loop.bpmn"
    loop.write_text(LOOP, encoding="utf-8")
    program = m2pem.start("run", loop, "--fleet", FLEET, "--format", "json", "--ocu", "none")
    program.until(lambda _: True)
    # A pipe holds 64 KiB; the journal goes on growing far beyond that while nobody reads.
    journal = m2pem.folder / ".local" / "state" / "m2pem" / "journal.db"
    while sum(file.stat().st_size for file in journal.parent.glob("journal.db*")) < 2_000_000:
        assert program.process.poll() is None
    program.send(signal.SIGINT)
    assert program.rest()[0] == 130
    assert program.records[-1]["record"] == "RunEnded"
    assert [each["seq"] for each in program.records] == list(range(1, len(program.records) + 1))


LOOP = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="x">
  <process id="P" isExecutable="true">
    <startEvent id="Start"/>
    <sequenceFlow id="F1" sourceRef="Start" targetRef="Merge"/>
    <exclusiveGateway id="Merge"/>
    <sequenceFlow id="F0" sourceRef="Merge" targetRef="End">
      <conditionExpression>over</conditionExpression>
    </sequenceFlow>
    <endEvent id="End"/>
    <sequenceFlow id="F2" sourceRef="Merge" targetRef="Work"/>
    <task id="Work"/>
    <sequenceFlow id="F3" sourceRef="Work" targetRef="Merge"/>
  </process>
</definitions>
"""
