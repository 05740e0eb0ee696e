"""The disk of the journal is full while a vehicle drives: it is held, and the run can go on."""

import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.command_line import CommandLine, fleet_with_state
from tests.e2e.test_held import TARGET
from tests.executive.conftest import behavior, flow, mission

DRIVE = mission(
    '<process id="P" isExecutable="true"><startEvent id="S"/>'
    f"{behavior('Drive', 'goto', 'evsg1', parameters=TARGET)}"
    '<boundaryEvent id="Often" attachedToRef="Drive" cancelActivity="false">'
    "<timerEventDefinition><timeCycle>R200/PT0.1S</timeCycle></timerEventDefinition>"
    f'</boundaryEvent><endEvent id="Noted"/><endEvent id="E"/>{flow("S", "Drive")}'
    f"{flow('Often', 'Noted')}{flow('Drive', 'E')}</process>"
)
"""A drive of some 80 m, in which a timer has more written than a small disk takes."""

QUICK = (
    '<process id="P" isExecutable="true"><startEvent id="S"/><endEvent id="E"/>'
    f"{flow('S', 'E')}</process>"
)
WITHIN_S = 60.0


def wait_until_recorded(state: Path, kind: EffectKind) -> None:
    """Until the vehicles' file has it."""
    ends = time.monotonic() + WITHIN_S
    while kind not in {effect.kind for effect in recorded_effects(state)}:
        assert time.monotonic() < ends, kind
        time.sleep(0.05)


class SmallDisk:
    """A file system of its own, in memory, with room for the first entries of a journal."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir()

    def mount(self, size: str, *more: str) -> bool:
        words = ["mount", "-t", "tmpfs", "-o", ",".join((*more, f"size={size}"))]
        done = subprocess.run([*words, "none", self.folder], capture_output=True, check=False)
        return done.returncode == 0


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[SmallDisk]:
    disk = SmallDisk(tmp_path / "disk")
    if shutil.which("mount") is None or not disk.mount("256k"):
        pytest.skip("no file system may be mounted here")
    yield disk
    subprocess.run(["umount", "--lazy", disk.folder], check=True)


def test_a_full_disk_holds_the_vehicles_and_after_room_is_made_the_run_goes_on(
    m2pem: CommandLine, tmp_path: Path, small_disk: SmallDisk
) -> None:
    (tmp_path / "drive.bpmn").write_bytes(DRIVE)
    fleet, state = fleet_with_state(tmp_path)
    journal = small_disk.folder / "journal.db"
    status, _, errors = m2pem.run(
        "run", "drive.bpmn", "--fleet", fleet, "--ocu", "none", "--speed", "10",
        "--journal", journal, M2PEM_MIN_FREE_MB="0",
    )  # fmt: skip
    assert (status, "the disk is full; make room" in errors) == (1, True), errors
    assert "Commanded to hold: evsg1." in errors
    assert "go on with `m2pem resume r1`" in errors
    assert [effect.kind for effect in recorded_effects(state)][-1] is EffectKind.HOLD
    status, _, errors = m2pem.run("resume", "r1", "--journal", journal, "--ocu", "none")
    assert (status, "the disk is full; make room" in errors) == (1, True), errors
    status, printed, errors = m2pem.run("fleet", fleet, "--journal", journal)
    assert (status, "it has evsg1 (goto), which may go on or be held" in printed) == (0, True)
    assert "r1   interrupted" in m2pem.run("runs", "--journal", journal)[1]
    assert "evsg1 begins goto" in m2pem.run("replay", "r1", "--journal", journal)[1]
    status, _, errors = m2pem.run("stop", "r1", "--journal", journal)
    assert "`m2pem resume r1 --stop`" in errors
    assert small_disk.mount("16m", "remount")
    program = m2pem.start("resume", "r1", "--journal", journal, "--ocu", "plain")
    program.until_text("held, and the journal does not say why")
    program.type("resume")
    program.until_text("r1 completed")
    assert program.rest()[0] == 0
    assert [effect.kind for effect in recorded_effects(state)].count(EffectKind.START) == 1


def test_a_stop_of_a_service_on_a_full_disk_reaches_its_vehicles_and_the_run_stays_stopped(
    m2pem: CommandLine, tmp_path: Path, small_disk: SmallDisk
) -> None:
    (tmp_path / "drive.bpmn").write_bytes(DRIVE)
    fleet, state = fleet_with_state(tmp_path)
    serve = ("serve", "--fleet", fleet, "--ocu", "plain")
    serve += ("--journal", small_disk.folder / "journal.db")
    program = m2pem.start(*serve, M2PEM_MIN_FREE_MB="0")
    program.type("start drive.bpmn")
    program.until_text("evsg1 begins goto")
    wait_until_recorded(state, EffectKind.HOLD)
    program.type("stop all")
    program.until_text("r1: the stop went to its vehicles, but was not recorded")
    wait_until_recorded(state, EffectKind.END)
    program.type("start! drive.bpmn")
    program.until_text("the disk is full; make room")
    program.send(signal.SIGTERM)
    assert program.rest()[0] == 0
    assert small_disk.mount("16m", "remount")
    again = m2pem.start(*serve)
    again.until_text("r1 stopped")
    again.send(signal.SIGTERM)
    assert again.rest()[0] == 0
    assert [effect.kind for effect in recorded_effects(state)].count(EffectKind.START) == 1


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("runs", "--journal", "{}"), "r1   completed"),
        (("replay", "r1", "--journal", "{}"), "r1 completed"),
        (("schedule", "--journal", "{}"), "nothing is scheduled"),
        (("journal", "info", "{}"), "all entries are there and unchanged"),
        (("journal", "backup", "{}", "--to", "copy.db"), "copy.db"),
    ],
)
def test_a_journal_on_a_read_only_file_system_is_read(
    m2pem: CommandLine, tmp_path: Path, small_disk: SmallDisk, words: tuple[str, ...], says: str
) -> None:
    assert small_disk.mount("16m", "remount")
    (tmp_path / "quick.bpmn").write_bytes(mission(QUICK))
    fleet, _ = fleet_with_state(tmp_path)
    journal = small_disk.folder / "journal.db"
    run = ("run", "quick.bpmn", "--fleet", fleet, "--ocu", "none", "--journal", journal)
    status, _, errors = m2pem.run(*run, M2PEM_MIN_FREE_MB="0")
    assert status == 0, errors
    assert small_disk.mount("16m", "remount", "ro")
    status, printed, errors = m2pem.run(*(word.format(journal) for word in words))
    assert (status, says in printed) == (0, True), errors
    assert "backup" in words or "a copy of it is read" in errors
    status, _, errors = m2pem.run("journal", "backup", journal)
    assert (status, "Read-only file system" in errors) == (1, True), errors
