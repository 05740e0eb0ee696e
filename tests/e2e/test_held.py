"""An executive ends while its vehicles are held: the next one asks before they go on."""

import errno
import signal
from pathlib import Path

from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.command_line import CommandLine, Program, fleet_with_state
from tests.executive.conftest import behavior, flow, mission
from tests.faults import Faults

TARGET = '<m2pem:property name="target" value="[38.10822, -77.3192, 60]"/>'
DRIVE = mission(
    '<process id="P" isExecutable="true"><startEvent id="S"/><intermediateCatchEvent id="Soon">'
    "<timerEventDefinition><timeDuration>PT1S</timeDuration></timerEventDefinition>"
    f"</intermediateCatchEvent>{behavior('Drive', 'goto', 'evsg1', parameters=TARGET)}"
    f'<endEvent id="E"/>{flow("S", "Soon")}{flow("S", "Drive")}{flow("Soon", "E")}'
    f"{flow('Drive', 'E')}</process>"
)
"""A drive of some 80 m, in which a timer has something written to the journal."""

SPEED = "10"


def held_by_a_dying_executive(faulty: CommandLine, faults: Faults) -> Path:
    """A run whose journal failed while a vehicle drove; returns the state file of the vehicles."""
    (faulty.folder / "drive.bpmn").write_bytes(DRIVE)
    fleet, state = fleet_with_state(faulty.folder)
    program = faulty.start(
        "run", "drive.bpmn", "--fleet", fleet, "--ocu", "none", "--speed", SPEED,
        "--journal", "journal.db",
    )  # fmt: skip
    program.until_text("evsg1 begins goto")
    faults.fail(errno.EIO, "write", name="journal.db")
    status, errors = program.rest()
    assert (status, "the disk failed to read or write" in errors) == (1, True), errors
    assert [effect.kind for effect in recorded_effects(state)][-1] is EffectKind.HOLD
    faults.clear()
    return state


def resume(m2pem: CommandLine, *words: str) -> Program:
    return m2pem.start("resume", "r1", "--journal", "journal.db", *words)


def test_vehicles_that_a_dying_executive_has_held_are_asked_about(
    faulty: CommandLine, faults: Faults
) -> None:
    state = held_by_a_dying_executive(faulty, faults)
    program = resume(faulty, "--ocu", "plain")
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
    faulty: CommandLine, faults: Faults, tmp_path: Path
) -> None:
    state = held_by_a_dying_executive(faulty, faults)
    fleet = tmp_path / "fleets" / "vignette1.yaml"
    status, _, refused = faulty.run("stop", "r1", "--journal", "journal.db")
    _, shown, _ = faulty.run("fleet", fleet, "--journal", "journal.db")
    for text in (refused, shown):
        assert "r1 (drive.bpmn) was interrupted, and no executive drives it" in text
        assert "it has evsg1 (goto), which may go on or be held" in text
        assert "`m2pem resume r1 --stop` stops it" in text
    assert status == 1
    assert faulty.run("resume", "r1", "--stop", "--journal", "journal.db")[0] == 130
    kinds = [effect.kind for effect in recorded_effects(state)]
    assert (EffectKind.CANCEL in kinds, EffectKind.RESUME in kinds) == (True, False)
    assert "was interrupted" not in faulty.run("fleet", fleet, "--journal", "journal.db")[1]


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
    program.until_text("evsg1 begins goto")
    program.type("stop all")
    program.until_text("r2 stopped")
    program.send(signal.SIGTERM)
    assert program.rest()[0] == 0
