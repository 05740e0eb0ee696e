import asyncio
import json
import re
from pathlib import Path

import pytest

from m2pem.journal.base import RunHeader
from m2pem.journal.sqlite import SqliteJournal
from tests.cli.conftest import Invoke
from tests.command_line import ANSWERS, FLEET, MISSION

ABORT = ("--answers", ANSWERS / "vignette1_abort.yaml", "--ocu", "none")


def test_a_user_without_a_journal_has_no_runs(invoke: Invoke, tmp_path: Path) -> None:
    assert invoke("runs") == (0, "no runs yet\n", "")
    assert invoke("runs", "--format", "json") == (0, "[]\n", "")
    assert list(tmp_path.rglob("*.db")) == []


def test_a_run_is_listed(invoke: Invoke) -> None:
    assert invoke("run", MISSION, "--fleet", FLEET, *ABORT)[0] == 0
    status, out, _ = invoke("runs")
    assert status == 0
    header, line = out.splitlines()
    assert header.split()[:2] == ["RUN", "STATUS"]
    assert header.index(" TOOK ") == re.search(r" \d+\.\d s ", line).start()  # type: ignore[union-attr]
    assert line.split()[:2] == ["r1", "terminated"]
    assert str(MISSION) in line


def test_runs_as_json(invoke: Invoke, tmp_path: Path) -> None:
    journal = ("--journal", tmp_path / "own.db")
    invoke("run", MISSION, "--fleet", "sim", *ABORT, *journal)
    invoke("run", MISSION, "--fleet", "sim", *ABORT, *journal)
    listed = json.loads(invoke("runs", *journal, "--format", "json")[1])
    assert [(each["run"], each["status"], each["process"]) for each in listed] == [
        ("r1", "terminated", "VIGNETTE1"),
        ("r2", "terminated", "VIGNETTE1"),
    ]
    assert listed[0]["records"] > 0
    assert listed[0]["started_us"] <= listed[0]["ended_us"] <= listed[1]["started_us"]
    took_us = [each["ended_us"] - each["started_us"] for each in listed]
    assert [each["took_s"] for each in listed] == [each / 1_000_000 for each in took_us]


def test_a_run_that_has_not_ended_has_taken_no_time(invoke: Invoke, tmp_path: Path) -> None:
    async def interrupted() -> None:
        written = SqliteJournal.open(tmp_path / "journal.db")
        await written.create(RunHeader("m.bpmn", b"", "P", created_us=1_000_000))
        await written.close()

    asyncio.run(interrupted())
    journal = ("--journal", tmp_path / "journal.db")
    assert invoke("runs", *journal)[1].splitlines()[1].split()[4:] == ["-", "0", "P", "m.bpmn"]
    (run,) = json.loads(invoke("runs", *journal, "--format", "json")[1])
    assert run["took_s"] is None


def test_a_journal_that_is_named_must_exist(invoke: Invoke, tmp_path: Path) -> None:
    missing = tmp_path / "missing.db"
    status, _, err = invoke("runs", "--journal", missing)
    assert (status, err) == (2, f"m2pem: there is no journal {missing}\n")
    assert not missing.exists()


@pytest.mark.parametrize("url", ["postgresql://me:secret@host/db", "ftp://host/db"])
def test_a_journal_that_nothing_opens_is_told(invoke: Invoke, url: str) -> None:
    status, _, err = invoke("runs", "--journal", url)
    assert status == 1
    assert "secret" not in err
    assert "Traceback" not in err
