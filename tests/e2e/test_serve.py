"""The executive as a service."""

import asyncio
import signal
from dataclasses import replace
from pathlib import Path

from m2pem.journal.sqlite import SqliteJournal
from m2pem.testing.contracts.journal_harness import ENDED, HEADER, entry, opened
from tests.command_line import FLEET, MISSION, CommandLine, Program

DAY_US = 86_400_000_000


def serving(m2pem: CommandLine, *words: str) -> Program:
    program = m2pem.start("serve", "--fleet", FLEET, "--ocu", "plain", *words)
    assert "serving mehds-vignette-1; operators: plain" in program.stderr.readline()
    return program


def test_several_runs_at_once_and_a_clean_end(m2pem: CommandLine) -> None:
    program = serving(m2pem)
    program.type(f"start {MISSION}")
    program.until_text("[p1] UserSendRoute")
    program.type(f"start {MISSION}")
    program.until_text("[r2 p1] UserSendRoute")
    program.type("abort")
    program.until_text("several prompts are open: r1 p1, r2 p1")
    program.type("r2 p1 abort")
    program.until_text("r2 terminated")
    program.type("runs")
    program.until(lambda line: line.startswith("r1 running"))
    program.until(lambda line: line.startswith("r2 terminated"))
    program.send(signal.SIGTERM)
    program.until_text("r1 stopped: stopped by SIGTERM")
    assert program.rest() == (0, "")


def test_a_mission_that_does_not_fit_is_refused_and_the_service_goes_on(
    m2pem: CommandLine,
) -> None:
    program = serving(m2pem)
    program.type("start nothing.bpmn")
    program.until_text("nothing.bpmn cannot be read")
    program.type(f"start {MISSION}")
    program.until_text("[p1] UserSendRoute")
    program.send(signal.SIGINT)
    assert program.rest()[0] == 0


def test_interrupted_runs_with_this_fleet_are_taken_up(m2pem: CommandLine) -> None:
    before = m2pem.start("run", MISSION, "--fleet", "sim")
    before.until_text("[p1] UserSendRoute")
    before.kill()
    program = serving(m2pem)
    program.type(f"start {MISSION}")
    program.until_text("[p1] UserSendRoute")
    program.kill()
    again = m2pem.start("serve", "--fleet", FLEET, "--ocu", "plain")
    again.until_text("[p1] UserSendRoute")
    again.type("abort")
    again.until_text("r2 terminated")
    assert any("r2 taken up again" in line for line in again.lines)
    again.send(signal.SIGTERM)
    status, errors = again.rest()
    assert status == 0
    assert "r1 was interrupted with other vehicles" in errors
    assert "`m2pem resume r1`" in errors


def test_a_run_that_is_driven_cannot_be_resumed(m2pem: CommandLine) -> None:
    program = serving(m2pem)
    program.type(f"start {MISSION}")
    program.until_text("[p1] UserSendRoute")
    status, _, errors = m2pem.run("resume", "r1", "--ocu", "none")
    assert status == 2
    assert "r1 is being driven by an executive that is alive" in errors
    program.send(signal.SIGTERM)
    assert program.rest()[0] == 0


def test_records_of_all_runs_are_printed(m2pem: CommandLine) -> None:
    program = m2pem.start(
        "serve", "--fleet", FLEET, "--ocu", "plain", "--format", "json", "--simulate"
    )
    for _ in range(2):
        program.type(f"start {MISSION}")
    program.until_record("PromptOpened", run="r1")
    program.until_record("PromptOpened", run="r2")
    program.send(signal.SIGTERM)
    assert program.rest()[0] == 0
    ended = [each["run"] for each in program.records if each["record"] == "RunEnded"]
    assert sorted(ended) == ["r1", "r2"]


def test_a_fleet_cannot_be_made_up(m2pem: CommandLine) -> None:
    status, _, errors = m2pem.run("serve", "--fleet", "sim")
    assert status == 2
    assert "a fleet is made up from a mission" in errors


def test_a_run_waits_for_what_operators_started_beside_it(m2pem: CommandLine) -> None:
    program = m2pem.start("run", MISSION, "--fleet", FLEET, "--ocu", "plain")
    program.until_text("[p1] UserSendRoute")
    program.type(f"start {MISSION}")
    program.until_text("[r2 p1] UserSendRoute")
    program.type("r1 p1 abort")
    program.until_text("r1 terminated")
    program.type("abort")
    program.until_text("r2 terminated")
    assert program.rest()[0] == 0


def test_runs_that_ended_long_ago_are_deleted_and_named_and_the_journal_is_copied(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    path, copies = tmp_path / "journal.db", tmp_path / "copies"
    copies.mkdir()

    async def old_runs() -> None:
        async with opened(lambda: SqliteJournal.open(path)) as journal:
            for day in range(2):
                run = await journal.create(HEADER)
                first = entry(run, 1, *ENDED)
                await journal.append([replace(first, at_us=first.at_us + day * DAY_US)])

    asyncio.run(old_runs())
    program = serving(
        m2pem, "--journal", str(path), "--keep", "12h", "--backup-to", str(copies),
        "--backup-every", "1d",
    )  # fmt: skip
    assert "kept: r2. By the clock" in program.stderr.readline()
    assert "deleted what ended longer ago than is kept: r1" in program.stderr.readline()
    program.type(f"start {MISSION}")
    program.until_text("UserSendRoute")
    program.send(signal.SIGTERM)
    assert program.rest()[0] == 0
    assert m2pem.run("runs", "--journal", path)[1].splitlines()[1].startswith("r2")
    (copy,) = copies.glob("journal-*.db")
    assert m2pem.run("journal", "check", copy)[0] == 0


def test_a_journal_that_is_no_file_is_not_copied(m2pem: CommandLine, tmp_path: Path) -> None:
    for url in ("memory:", "postgresql://m2pem@127.0.0.1:1/x"):
        words = ("--journal", url, "--backup-to", tmp_path)
        status, _, err = m2pem.run("serve", "--fleet", FLEET, *words)
        assert (status, "--backup-to copies a journal in a file" in err) == (2, True), err
    status, _, err = m2pem.run("serve", "--fleet", FLEET, "--backup-every", "2h")
    assert (status, "--backup-every needs --backup-to FOLDER" in err) == (2, True), err


def test_a_time_to_keep_runs_that_is_none_is_refused(m2pem: CommandLine) -> None:
    for text in ("30", "0d", "-1d", "month"):
        status, _, err = m2pem.run("serve", "--fleet", FLEET, "--keep", text)
        assert status == 2
        assert f"{text!r} is not a number of days or hours, such as 30d or 12h" in err
