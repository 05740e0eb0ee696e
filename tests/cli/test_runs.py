import asyncio
import json
import re
from pathlib import Path

import pytest

from m2pem.fleet.fleet import restore
from m2pem.journal.base import RunHeader
from m2pem.journal.sqlite import SqliteJournal
from tests.cli.conftest import Invoke
from tests.command_line import ANSWERS, FLEET, MISSION, CommandLine

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


@pytest.mark.parametrize("url", ["postgresql://me:secret@host/a/b", "ftp://host/db"])
def test_a_journal_that_nothing_opens_is_told(invoke: Invoke, url: str) -> None:
    status, _, err = invoke("runs", "--journal", url)
    assert status == 2
    assert "secret" not in err
    assert "Traceback" not in err


def two_runs(invoke: Invoke) -> None:
    for _ in range(2):
        invoke("run", MISSION, "--fleet", FLEET, *ABORT)


def test_named_runs_are_listed_alone(invoke: Invoke) -> None:
    two_runs(invoke)
    listed = json.loads(invoke("runs", "r2", "--format", "json")[1])
    assert [each["run"] for each in listed] == ["r2"]


def test_runs_are_deleted(invoke: Invoke) -> None:
    two_runs(invoke)
    assert invoke("runs", "--delete", "r1") == (0, "deleted: r1\n", "")
    assert [each["run"] for each in json.loads(invoke("runs", "--format", "json")[1])] == ["r2"]
    assert invoke("replay", "r2", "--verify")[0] == 0
    for words in (("replay", "r1"), ("runs", "--delete", "r1"), ("resume", "r1")):
        status, _, err = invoke(*words)
        assert status == 2
        assert re.match(r"m2pem: r1 was deleted on .* UTC by ", err)


def test_runs_are_deleted_together_or_not_at_all(invoke: Invoke) -> None:
    two_runs(invoke)
    status, _, err = invoke("runs", "--delete", "r1", "r7")
    assert (status, err) == (2, "m2pem: the journal has no run 'r7'; it has r1, r2\n")
    assert len(json.loads(invoke("runs", "--format", "json")[1])) == 2


def test_an_interrupted_run_is_deleted_with_force_alone(m2pem: CommandLine) -> None:
    program = m2pem.start("run", MISSION, "--fleet", FLEET, *ABORT[:0], "--format", "json")
    program.until_record("PromptOpened")
    status, _, err = m2pem.run("runs", "--delete", "r1", "--force")
    assert status == 1
    assert f"r1 is not deleted: it is driven by process {program.process.pid}" in err
    program.kill()
    status, _, err = m2pem.run("runs", "--delete", "r1")
    assert status == 1
    assert "not deleted: r1" in err
    assert "`m2pem resume r1 --stop` stops it; --force deletes it all the same" in err
    status, out, err = m2pem.run("runs", "--delete", "--force", "r1")
    assert (status, out) == (0, "deleted: r1\n")
    assert "deleted although r1" in err
    assert m2pem.run("runs") == (0, "no runs yet\n", "")


def test_an_exported_run_has_its_mission_fleet_and_records(invoke: Invoke) -> None:
    invoke("run", MISSION, "--fleet", FLEET, *ABORT)
    status, out, _ = invoke("runs", "--export", "r1")
    assert status == 0
    head, *records = out.splitlines()
    assert records == invoke("replay", "r1", "--format", "json")[1].splitlines()
    exported = json.loads(head)
    assert (exported["export"], exported["run"], exported["outcome"]) == (1, "r1", "terminated")
    assert exported["records"] == len(records)
    assert exported["mission"] == {"name": str(MISSION), "text": MISSION.read_text("utf-8")}
    fleet = restore(json.dumps({"version": 1, "fleet": exported["fleet"]}).encode())
    assert "evsg1" in fleet.vehicles


@pytest.mark.parametrize(
    "words", [("--delete",), ("--export",), ("--force", "r1"), ("--delete", "--export", "r1")]
)
def test_options_that_do_not_go_together_are_refused(invoke: Invoke, words: tuple[str]) -> None:
    assert invoke("runs", *words)[0] == 2
