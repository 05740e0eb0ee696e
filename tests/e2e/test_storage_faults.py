"""What happens when the storage of the journal fails: each fault at each moment.

The moments: the journal is opened; the first write for a mission; while a vehicle drives; when an
interrupted run is resumed. Whatever fails, operators read at once what is wrong, and no traceback;
vehicles are held; STOP reaches them; nothing that was acknowledged is lost unsaid.
"""

import asyncio
import errno
import shutil
import signal
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import pytest

from m2pem.journal.sqlite import SqliteJournal
from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.command_line import CommandLine, Program, fleet_with_state
from tests.faults import Faults, with_faults
from tests.wal import commits

from .test_full_disk import DRIVE, wait_until_recorded

START, HOLD, CANCEL, END = EffectKind.START, EffectKind.HOLD, EffectKind.CANCEL, EffectKind.END


@dataclass
class World:
    """m2pem with a fleet of simulated vehicles, whose state is in a file, and a journal."""

    m2pem: CommandLine
    faults: Faults
    journal: Path
    fleet: Path
    state: Path

    def have(self, error: int, *calls: str) -> None:
        """Let calls on the journal's files fail from now on."""
        self.faults.fail(error, *calls, name=f"{self.journal.parent.name}/{self.journal.name}")

    def kinds(self) -> list[EffectKind]:
        """What vehicles were commanded, and did."""
        if not self.state.exists():
            return []
        return [effect.kind for effect in recorded_effects(self.state)]

    def run(self, *words: str | Path) -> tuple[int, str]:
        """The exit status of a command on the journal, and what it printed."""
        status, out, errors = self.m2pem.run(*words, "--journal", self.journal)
        assert "Traceback" not in errors
        return status, out + errors

    def serve(self) -> Program:
        return self.m2pem.start(
            "serve", "--fleet", self.fleet, "--ocu", "plain", "--journal", self.journal
        )

    def driving(self) -> Program:
        """A service in which evsg1 drives in r1."""
        program = self.serve()
        program.type("start drive.bpmn")
        program.until_text("evsg1 begins goto")
        wait_until_recorded(self.state, START)
        return program

    def killed(self) -> None:
        """Leave r1 interrupted."""
        program = self.driving()
        program.until_text("Noted")
        program.kill()

    def beside(self, suffix: str) -> Path:
        return self.journal.with_name(self.journal.name + suffix)


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    faults = Faults(tmp_path)
    m2pem = CommandLine(tmp_path, faults.variables, with_faults())
    (tmp_path / "drive.bpmn").write_bytes(DRIVE)
    fleet, state = fleet_with_state(tmp_path)
    journal = tmp_path / "journals" / "journal.db"
    journal.parent.mkdir()

    async def make() -> None:
        await SqliteJournal.open(journal).close()

    asyncio.run(make())
    yield World(m2pem, faults, journal, fleet, state)
    m2pem.end()


def ended(program: Program) -> str:
    """End a service, and return all that it printed."""
    program.send(signal.SIGTERM)
    status, errors = program.rest()
    assert status == 0
    assert "Traceback" not in errors
    return "\n".join(program.lines) + errors


FULL = (errno.ENOSPC, "write")
READ_ONLY = (errno.EROFS, "write", "open")
WRITE = (errno.EIO, "write")
FLUSH = (errno.EIO, "sync")
READ = (errno.EIO, "read")

Calls = tuple[int, *tuple[str, ...]]

OPENED: dict[str, tuple[Calls, str]] = {
    "full disk": (FULL, "make room"),
    "read-only": (READ_ONLY, "check the permissions of it and its folder"),
    "write fails": (WRITE, "the disk is full or failed"),
    "flush fails": (FLUSH, "the disk failed to read or write; look at it"),
    "read fails": (READ, "Input/output error"),
}


@pytest.mark.parametrize("fault", OPENED)
def test_a_fault_when_the_journal_is_opened_starts_nothing_and_is_told(
    world: World, fault: str
) -> None:
    calls, said = OPENED[fault]
    world.have(*calls)
    status, printed = world.run("run", "drive.bpmn", "--fleet", world.fleet, "--ocu", "none")
    assert (status, world.kinds()) == (1, [])
    assert said in printed


WRITTEN: dict[str, tuple[Calls, str]] = {
    **OPENED,
    "full disk": (FULL, "the disk is full; make room"),
    "write fails": (WRITE, "the disk failed to read or write; look at it"),
    "read-only": (READ_ONLY, "the disk failed to read or write; look at it"),
    "read fails": (READ, "the disk failed to read or write; look at it"),
}


@pytest.mark.parametrize("fault", WRITTEN)
def test_a_fault_at_the_first_write_starts_nothing_and_is_told(world: World, fault: str) -> None:
    calls, said = WRITTEN[fault]
    program = world.serve()
    program.type("start nothing.bpmn")
    program.until_text("nothing.bpmn")
    while "no executive serves" in world.m2pem.run("schedule", "--journal", world.journal)[2]:
        assert program.process.poll() is None, program.rest()
    world.have(*calls)
    program.type("start drive.bpmn")
    program.until_text(said)
    ended(program)
    assert world.kinds() == []
    world.faults.clear()
    assert world.run("runs")[0] == 0


@pytest.mark.parametrize("fault", ["full disk", "read-only", "write fails", "flush fails"])
def test_a_fault_during_a_run_holds_its_vehicles_and_stop_reaches_them(
    world: World, fault: str
) -> None:
    calls, said = WRITTEN[fault]
    program = world.driving()
    world.have(*calls)
    wait_until_recorded(world.state, HOLD)
    program.type("stop all")
    program.until_text("r1: the stop went to its vehicles, but was not recorded")
    wait_until_recorded(world.state, END)
    printed = ended(program)
    assert "r1: held: " in printed
    # Which file failed first is chance: the mark's may say of a read-only disk what it is.
    other = "can only be read; allow writing" if fault == "read-only" else said
    assert said in printed or other in printed
    assert "Commanded to hold: evsg1. Mend the cause" in printed
    assert world.kinds() == [START, HOLD, CANCEL, END]


def test_a_run_goes_on_while_nothing_can_be_read_and_stop_is_recorded(world: World) -> None:
    """What is written needs nothing of the disk but room: all that counts is in memory."""
    program = world.driving()
    world.have(*READ)
    program.type("stop all")
    program.until_text("r1 stopped")
    wait_until_recorded(world.state, END)
    ended(program)
    assert world.kinds() == [START, CANCEL, END]


RESUMED: dict[str, tuple[Calls, str]] = {
    **OPENED,
    "read-only": (READ_ONLY, "can only be read; allow writing"),
}


@pytest.mark.parametrize("fault", RESUMED)
def test_a_fault_at_resume_starts_nothing_and_once_it_is_mended_the_run_is_resumed(
    world: World, fault: str
) -> None:
    calls, said = RESUMED[fault]
    world.killed()
    world.have(*calls)
    status, printed = world.run("resume", "r1", "--ocu", "none")
    assert (status, said in printed) == (1, True), printed
    if fault != "read fails":
        status, printed = world.run("runs")
        assert (status, "r1   interrupted" in printed) == (0, True), printed
        assert "a copy of it is read" in printed
        assert world.m2pem.run("journal", "check", world.journal)[0] == 0
    assert world.kinds() == [START]
    world.faults.clear()
    status, printed = world.run("resume", "r1", "--stop", "--ocu", "none")
    assert (status, "r1 stopped" in printed) == (130, True)
    assert world.kinds() == [START, CANCEL, END]


# --- another program has the journal locked -------------------------------------------------------


def test_a_journal_that_another_program_keeps_locked_is_told_at_open_and_during_a_run(
    world: World,
) -> None:
    program = world.driving()
    with closing(sqlite3.connect(world.journal, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        opening = world.m2pem.start("resume", "r1", "--ocu", "none", "--journal", world.journal)
        wait_until_recorded(world.state, HOLD)
        program.type("stop all")
        wait_until_recorded(world.state, END)
        status, errors = opening.rest()
        assert (status, "another program has kept it locked" in errors) == (1, True)
    printed = ended(program)
    assert "another program has kept it locked for 5 s; end that" in printed
    assert world.kinds() == [START, HOLD, CANCEL, END]


# --- files that are damaged, replaced or removed --------------------------------------------------


def flip(place: Callable[[bytes], int]) -> Callable[[Path], None]:
    def harm(file: Path) -> None:
        content = bytearray(file.read_bytes())
        content[place(bytes(content))] ^= 0x10
        file.write_bytes(content)

    return harm


def cut(file: Path) -> None:
    """Leave out the last commit of the log, as a flipped bit in it would."""
    content = file.read_bytes()
    file.write_bytes(content[: commits(content)[-2]])
    file.with_name(file.name.replace("-wal", "-shm")).unlink()


def half(file: Path) -> None:
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])


def older(file: Path) -> None:
    """Put the copy in place that was made before r1 began."""
    shutil.copy(file.with_name("older.db"), file)


def of_text(text: bytes) -> Callable[[bytes], int]:
    return lambda content: content.rindex(text)


NOT_THAT_OF_THE_MARK = "is the mark of another journal"

DAMAGES: dict[str, tuple[str, Callable[[Path], object], int, str]] = {
    "truncated": ("", half, 1, "it is damaged; use a backup, or save what is intact"),
    "header flipped": ("", flip(lambda _: 3), 1, "it is not a journal of m2pem"),
    "entry flipped": ("", flip(of_text(b'"Noted"')), 1, "does not follow from what was before it"),
    "fleet flipped": ("", flip(of_text(b'"domain"')), 1, "`m2pem journal check` says"),
    "emptied": ("", lambda file: file.write_bytes(b""), 1, NOT_THAT_OF_THE_MARK),
    "removed": ("", Path.unlink, 2, "there is no journal"),
    "older": ("", older, 2, "the journal has lost the run: it acknowledged"),
    "mark flipped": ("-mark", flip(lambda _: 20), 1, "is damaged, or not the mark file"),
}


def interrupted(world: World) -> None:
    """r1 with several entries, all of them in the file; its log is gone."""
    shutil.copy(world.journal, world.journal.with_name("older.db"))
    program = world.driving()
    for _ in range(3):
        program.until_text("Noted")
    program.kill()
    with closing(sqlite3.connect(world.journal)) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    for suffix in ("-wal", "-shm"):
        world.beside(suffix).unlink(missing_ok=True)


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_journal_is_told_at_resume_and_nothing_moves(world: World, damage: str) -> None:
    suffix, harm, expected, said = DAMAGES[damage]
    interrupted(world)
    harm(world.beside(suffix))
    status, printed = world.run("resume", "r1", "--ocu", "none")
    assert (status, said in printed) == (expected, True), printed
    assert world.kinds() == [START]
    assert world.m2pem.run("journal", "check", world.journal)[0] == (
        2 if damage == "removed" else 1
    )


def test_a_log_that_was_cut_is_told_at_resume_and_an_operator_asked(world: World) -> None:
    world.killed()
    cut(world.beside("-wal"))
    program = world.m2pem.start("resume", "r1", "--ocu", "plain", "--journal", world.journal)
    program.until_text("[loss]")
    wait_until_recorded(world.state, HOLD)
    program.process.kill()
    _, errors = program.rest()
    assert "the journal has lost records: it acknowledged record" in errors
    assert START not in world.kinds()[1:]


def test_a_mark_that_was_removed_is_told_at_resume(world: World) -> None:
    world.killed()
    world.beside("-mark").unlink()
    status, printed = world.run("runs")
    assert (status, "look at the vehicles before you resume a run" in printed) == (0, True)


@pytest.mark.parametrize("suffix", ["", "-wal", "-lock", "-mark"])
@pytest.mark.parametrize("what", ["removed", "replaced"])
def test_a_file_that_is_removed_or_replaced_during_a_run_holds_the_vehicles_and_stop_reaches_them(
    world: World, suffix: str, what: str
) -> None:
    program = world.driving()
    file = world.beside(suffix)
    if what == "replaced":
        other = file.with_name("other")
        shutil.copy(file, other)
        other.replace(file)
    else:
        file.unlink()
    wait_until_recorded(world.state, HOLD)
    program.type("stop all")
    wait_until_recorded(world.state, END)
    printed = ended(program)
    assert f"{file} was {what} while it was in use" in printed
    assert world.kinds() == [START, HOLD, CANCEL, END]
