"""`m2pem journal`: what it says of a journal, its backup, and its smaller file."""

import json
import sqlite3
import stat
from contextlib import closing
from pathlib import Path

import pytest

from m2pem.journal.migrations import MIGRATIONS
from tests.cli.conftest import Invoke
from tests.command_line import ANSWERS, FLEET, MISSION, CommandLine, Program

ABORT = ("--answers", ANSWERS / "vignette1_abort.yaml", "--ocu", "none")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "own.db"


def with_runs(invoke: Invoke, path: Path, count: int) -> None:
    for _ in range(count):
        assert invoke("run", MISSION, "--fleet", FLEET, *ABORT, "--journal", path)[0] == 0


def running(m2pem: CommandLine, path: Path) -> Program:
    program = m2pem.start(
        "run", MISSION, "--fleet", FLEET, "--journal", path, "--format", "json", "--ocu", "plain"
    )
    program.until_record("PromptOpened")
    return program


def damage(path: Path, statement: str) -> None:
    with closing(sqlite3.connect(path)) as connection, connection:
        assert connection.execute(statement).rowcount > 0


def found(invoke: Invoke, path: Path, status: int = 0) -> dict[str, object]:
    ended, out, _ = invoke("journal", "info", path, "--format", "json")
    assert ended == status
    content: dict[str, object] = json.loads(out)
    return content


def test_the_state_of_a_journal(invoke: Invoke, path: Path) -> None:
    with_runs(invoke, path, 2)
    invoke("runs", "--delete", "r1", "--journal", path)
    content = found(invoke, path)
    assert content["path"] == str(path)
    assert content["runs"] == {"ended": 1, "driven": 0, "interrupted": 0, "deleted": 1}
    (listed,) = json.loads(invoke("runs", "--journal", path, "--format", "json")[1])
    assert content["records"] == listed["records"]
    assert content["problems"] == []
    assert content["executives"] == {}
    status, out, _ = invoke("journal", "info", path)
    assert status == 0
    assert f"format      {len(MIGRATIONS)} (this m2pem writes {len(MIGRATIONS)})" in out
    assert "integrity   all entries are there and unchanged" in out
    assert "written by  no executive" in out
    assert "1; r1 was deleted on" in out


def test_a_journal_of_which_entries_were_changed(invoke: Invoke, path: Path) -> None:
    with_runs(invoke, path, 1)
    damage(path, "UPDATE entries SET at_us = at_us + 1 WHERE seq = 1")
    (problem,) = found(invoke, path, status=1)["problems"]  # type: ignore[misc]
    assert "r1, record 1: it does not follow from what was before it" in problem


def test_the_executive_that_writes_is_named(invoke: Invoke, m2pem: CommandLine, path: Path) -> None:
    program = running(m2pem, path)
    content = found(invoke, path)
    assert content["executives"] == {str(program.process.pid): "mehds-vignette-1"}
    assert content["runs"] == {"ended": 0, "driven": 1, "interrupted": 0, "deleted": 0}


def test_a_backup_while_an_executive_writes_is_whole(
    invoke: Invoke, m2pem: CommandLine, path: Path, tmp_path: Path
) -> None:
    program = running(m2pem, path)
    copy = tmp_path / "copy.db"
    assert invoke("journal", "backup", path, "--to", copy) == (0, f"{copy}\n", "")
    program.type("abort")
    program.until_record("RunEnded")
    assert program.rest()[0] == 0
    content, original = found(invoke, copy), found(invoke, path)
    assert content["identity"] == original["identity"]
    assert content["runs"] == {"ended": 0, "driven": 0, "interrupted": 1, "deleted": 0}
    records = invoke("replay", "r1", "--journal", copy, "--format", "json")[1].splitlines()
    later = invoke("replay", "r1", "--journal", path, "--format", "json")[1].splitlines()
    assert 0 < len(records) < len(later)
    assert records == later[: len(records)]
    assert {stat.S_IMODE(file.stat().st_mode) for file in tmp_path.glob("copy.db*")} == {0o600}


def test_a_backup_has_a_name_with_the_time(invoke: Invoke, path: Path) -> None:
    with_runs(invoke, path, 1)
    status, out, _ = invoke("journal", "backup", path)
    copy = Path(out.strip())
    assert status == 0
    assert copy.match(f"{path.parent}/own-20*.db")
    assert found(invoke, copy)["records"] == found(invoke, path)["records"]


def test_a_backup_replaces_no_file(invoke: Invoke, path: Path) -> None:
    with_runs(invoke, path, 1)
    before = path.read_bytes()
    status, _, err = invoke("journal", "backup", path, "--to", path)
    assert (status, err) == (1, f"m2pem: {path} exists already; name a new file\n")
    assert path.read_bytes() == before


def test_a_backup_keeps_what_the_journal_has_lost(
    invoke: Invoke, path: Path, tmp_path: Path
) -> None:
    with_runs(invoke, path, 1)
    damage(path, "DELETE FROM standings")
    status, _, err = invoke("journal", "backup", path, "--to", tmp_path / "copy.db")
    assert status == 1
    assert "r1: the journal has lost the run" in err


def test_a_backup_that_cannot_be_written_leaves_no_file(
    invoke: Invoke, path: Path, tmp_path: Path
) -> None:
    path.write_bytes(b"no journal, but a text that is long enough to be read as one" * 100)
    status, _, err = invoke("journal", "backup", path, "--to", tmp_path / "copy.db")
    assert status == 1
    assert "it is not a journal of m2pem" in err
    assert list(tmp_path.glob("copy.db*")) == []


def test_compacting_gives_the_space_of_deleted_runs_back(invoke: Invoke, path: Path) -> None:
    with_runs(invoke, path, 6)
    invoke("runs", "--delete", "r1", "r2", "r3", "r4", "r5", "--journal", path)
    before = path.stat().st_size
    status, out, _ = invoke("journal", "compact", path)
    assert status == 0
    assert out.startswith(f"{path}: ")
    assert path.stat().st_size < before / 2
    assert invoke("replay", "r6", "--verify", "--journal", path)[0] == 0
    assert found(invoke, path)["problems"] == []


def test_a_journal_is_not_compacted_while_an_executive_writes(
    invoke: Invoke, m2pem: CommandLine, path: Path
) -> None:
    program = running(m2pem, path)
    status, _, err = invoke("journal", "compact", path)
    assert status == 1
    assert f"process {program.process.pid} writes to {path}: end that first" in err


@pytest.mark.parametrize("command", ["info", "check", "backup", "compact"])
def test_a_journal_that_is_missing_is_named(invoke: Invoke, path: Path, command: str) -> None:
    assert invoke("journal", command, path)[0::2] == (2, f"m2pem: there is no journal {path}\n")
    assert not path.exists()
    assert invoke("journal", command, "memory:")[0] == 2


def test_a_whole_journal_is_checked_and_nothing_of_it_changed(invoke: Invoke, path: Path) -> None:
    with_runs(invoke, path, 2)
    before = path.read_bytes()
    status, out, err = invoke("journal", "check", path)
    assert (status, err) == (0, "")
    assert "file, mark  no error is found" in out
    assert "runs        2, all whole" in out
    status, out, _ = invoke("journal", "check", path, "--format", "json")
    assert (status, json.loads(out)["whole"]) == (0, True)
    assert path.read_bytes() == before


def test_a_journal_in_a_folder_that_may_not_be_written_is_checked(
    invoke: Invoke, m2pem: CommandLine, path: Path
) -> None:
    with_runs(invoke, path, 1)
    path.parent.chmod(0o500)
    try:
        status, out, _ = invoke("journal", "check", path)
    finally:
        path.parent.chmod(0o700)
    assert (status, "runs        1, all whole" in out) == (0, True)


def test_a_journal_is_checked_while_an_executive_writes(
    invoke: Invoke, m2pem: CommandLine, path: Path
) -> None:
    running(m2pem, path)
    status, out, _ = invoke("journal", "check", path, "--format", "json")
    (run,) = json.loads(out)["runs"]
    assert (status, run["run"], run["problem"]) == (0, "r1", "")
    assert run["records"] > 0


def test_what_is_intact_is_salvaged_replayed_and_exported(
    invoke: Invoke, path: Path, tmp_path: Path
) -> None:
    with_runs(invoke, path, 3)
    records = invoke("replay", "r2", "--journal", path, "--format", "json")[1].splitlines()
    with closing(sqlite3.connect(path)) as connection, connection:
        (last,) = connection.execute("SELECT max(seq) FROM entries WHERE run = 2").fetchone()
        connection.execute("UPDATE entries SET t_us = 0 WHERE run = 2 AND seq = ?", (last,))
    intact = last - 1
    status, out, _ = invoke("journal", "check", path)
    assert status == 1
    assert f"r2          records 1 to {intact} are intact; record {last}: it does not follow" in out
    before, new = path.read_bytes(), tmp_path / "new.db"
    status, out, _ = invoke("journal", "salvage", path, new)
    assert status == 1
    assert out.endswith(f"salvaged to {new}\n")
    assert path.read_bytes() == before
    for run in ("r1", "r3"):
        assert invoke("replay", run, "--journal", new, "--verify")[0] == 0
    status, out, _ = invoke("replay", "r2", "--journal", new, "--verify")
    assert (status, "the run was salvaged from another journal" in out) == (1, True)
    exported = invoke("runs", "--export", "r2", "--journal", new)[1].splitlines()
    assert exported[1:] == records[:intact]
    assert f"salvaged from {path}" in invoke("journal", "info", new)[1]


def test_a_journal_is_not_salvaged_while_an_executive_writes(
    invoke: Invoke, m2pem: CommandLine, path: Path, tmp_path: Path
) -> None:
    program = running(m2pem, path)
    status, _, err = invoke("journal", "salvage", path, tmp_path / "new.db")
    assert status == 1
    assert f"process {program.process.pid} writes to {path}: end that first" in err
