"""An executive ends while its vehicles are held: the next one asks before they go on."""

import signal
from pathlib import Path

from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.command_line import CommandLine, Program, fleet_with_state, install_plugin
from tests.executive.conftest import behavior, flow, mission

TARGET = '<m2pem:property name="target" value="[38.10822, -77.3192, 60]"/>'
DRIVE = mission(
    '<process id="P" isExecutable="true"><startEvent id="S"/><intermediateCatchEvent id="Soon">'
    "<timerEventDefinition><timeDuration>PT1S</timeDuration></timerEventDefinition>"
    f"</intermediateCatchEvent>{behavior('Drive', 'goto', 'evsg1', parameters=TARGET)}"
    f'<endEvent id="E"/>{flow("S", "Soon")}{flow("S", "Drive")}{flow("Soon", "E")}'
    f"{flow('Drive', 'E')}</process>"
)
"""A drive of some 80 m, in which a timer has something written to the journal."""

LOCKING = """
import os, sqlite3

held = []

@hookimpl
def m2pem_records_committed(run_id, records):
    if any(type(record).__name__ == "BehaviorProgressed" for record in records) and not held:
        held.append(sqlite3.connect(os.environ["LOCKS"], isolation_level=None))
        held[0].execute("BEGIN IMMEDIATE")
"""
"""Another process writes to the journal and does not end: commits fail after a while."""


def held_by_a_dying_executive(m2pem: CommandLine, tmp_path: Path) -> Path:
    """A run whose journal failed while a vehicle drove; returns the state file of the vehicles."""
    (tmp_path / "drive.bpmn").write_bytes(DRIVE)
    fleet, state = fleet_with_state(tmp_path)
    journal = tmp_path / "journal.db"
    installed = install_plugin(tmp_path, "locking", LOCKING)
    status, _, errors = m2pem.run(
        "run", "drive.bpmn", "--fleet", fleet, "--ocu", "none", "--journal", journal,
        LOCKS=str(journal), **installed,
    )  # fmt: skip
    assert (status, "locked" in errors) == (1, True), errors
    assert [effect.kind for effect in recorded_effects(state)][-1] is EffectKind.HOLD
    return state


def resume(m2pem: CommandLine, *words: str) -> Program:
    return m2pem.start("resume", "r1", "--journal", "journal.db", *words)


def test_vehicles_that_a_dying_executive_has_held_are_asked_about(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    state = held_by_a_dying_executive(m2pem, tmp_path)
    program = resume(m2pem, "--ocu", "plain")
    program.until_text("held, and the journal does not say why")
    kinds = [effect.kind for effect in recorded_effects(state)]
    assert EffectKind.RESUME not in kinds
    program.type("resume")
    program.until_text("r1 completed")
    assert program.rest()[0] == 0
    kinds = [effect.kind for effect in recorded_effects(state)]
    assert kinds.count(EffectKind.START) == 1
    assert EffectKind.RESUME in kinds


def test_what_an_interrupted_run_has_left_behind_is_said_and_can_be_stopped(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    state = held_by_a_dying_executive(m2pem, tmp_path)
    fleet = tmp_path / "fleets" / "vignette1.yaml"
    status, _, refused = m2pem.run("stop", "r1", "--journal", "journal.db")
    _, shown, _ = m2pem.run("fleet", fleet, "--journal", "journal.db")
    for text in (refused, shown):
        assert "r1 (drive.bpmn) was interrupted, and no executive drives it" in text
        assert "it has evsg1 (goto), which may go on or be held" in text
        assert "`m2pem resume r1 --stop` stops it" in text
    assert status == 1
    assert m2pem.run("resume", "r1", "--stop", "--journal", "journal.db")[0] == 130
    kinds = [effect.kind for effect in recorded_effects(state)]
    assert (EffectKind.CANCEL in kinds, EffectKind.RESUME in kinds) == (True, False)
    assert "was interrupted" not in m2pem.run("fleet", fleet, "--journal", "journal.db")[1]


def test_what_a_run_left_that_was_deleted_is_ended_before_its_vehicle_is_free(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    (tmp_path / "drive.bpmn").write_bytes(DRIVE)
    fleet, state = fleet_with_state(tmp_path)
    at = ("--journal", "journal.db")
    killed = m2pem.start("run", "drive.bpmn", "--fleet", fleet, "--ocu", "none", *at,
                         "--format", "json")  # fmt: skip
    killed.until_record("BehaviorProgressed", state="RUNNING")
    killed.kill()
    assert m2pem.run("runs", "--delete", "r1", "--force", *at)[0] == 0
    program = m2pem.start("serve", "--fleet", fleet, "--ocu", "plain", *at)
    said = program.stderr
    while "it has ended what it did before, and is free" not in said.readline():
        pass
    shown = m2pem.run("fleet", "--running", *at)[1].splitlines()
    assert [line for line in shown if line.startswith("evsg1 ") and "returned: held" in line]
    kinds = [effect.kind for effect in recorded_effects(state)]
    assert kinds[-3:] == [EffectKind.CANCEL, EffectKind.END, EffectKind.HOLD]
    program.type("start drive.bpmn")
    program.until_text("r2 completed")
    program.send(signal.SIGTERM)
    assert program.rest()[0] == 0
