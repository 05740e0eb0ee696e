"""Missions whose journal is in PostgreSQL, as people run them."""

import json
from pathlib import Path

import pytest

from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.command_line import ANSWERS, FLEET, MISSION, CommandLine, Program, fleet_with_state
from tests.postgres_server import (
    PostgresServer,
    Replicated,
    postgres,
    postgres_url,
    replicated,
)

__all__ = ["postgres", "postgres_url", "replicated"]

SCRIPT = ("--answers", ANSWERS / "vignette1_detection.yaml")
SECRET = "s3cret"


@pytest.fixture
def url(postgres_url: str) -> str:
    """With a password, which nothing may repeat."""
    return postgres_url.replace("m2pem@", f"m2pem:{SECRET}@")


def driving(m2pem: CommandLine, fleet: Path, url: str, **environment: str) -> Program:
    """The mission of the paper, with evsg1 on its route."""
    program = m2pem.start(
        "run", MISSION, "--fleet", fleet, "--format", "json", "--ocu", "none", "--journal", url,
        "--answers", ANSWERS / "vignette1_route.yaml", **environment,
    )  # fmt: skip
    program.until_record("BehaviorProgressed", state="RUNNING")
    return program


def test_a_run_whose_executive_was_killed_is_resumed_and_read(
    m2pem: CommandLine, tmp_path: Path, url: str
) -> None:
    fleet, _ = fleet_with_state(tmp_path)
    journal = ("--journal", url)
    program = m2pem.start(
        "run", MISSION, "--fleet", fleet, "--speed", "50", "--format", "json", "--ocu", "none",
        *SCRIPT, *journal,
    )  # fmt: skip
    for _ in range(24):
        program.until(lambda _: True)
    program.kill()
    (listed,) = json.loads(m2pem.run("runs", *journal, "--format", "json")[1])
    assert (listed["run"], listed["status"]) == ("r1", "interrupted")
    status, out, errors = m2pem.run(
        "resume", "r1", *SCRIPT, "--ocu", "none", "--format", "json", *journal
    )
    assert status == 0
    assert json.loads(out.splitlines()[-1])["record"] == "RunEnded"
    assert SECRET not in errors
    assert m2pem.run("replay", "r1", "--verify", *journal)[0] == 0
    exported = m2pem.run("runs", "--export", "r1", *journal)[1].splitlines()
    assert json.loads(exported[0])["outcome"] is not None
    status, out, _ = m2pem.run("journal", "info", url)
    assert status == 0
    assert "all entries are there and unchanged" in out
    assert "written by  no executive" in out
    assert SECRET not in out
    told = json.loads(m2pem.run("journal", "info", url, "--format", "json")[1])
    assert told["runs"]["ended"] == 1
    for command, instead in {"backup": "pg_dump", "compact": "autovacuum"}.items():
        status, _, errors = m2pem.run("journal", command, url)
        assert (status, instead in errors, SECRET in errors) == (2, True, False)
    assert m2pem.run("runs", "--delete", "r1", *journal)[0] == 0
    assert json.loads(m2pem.run("runs", *journal, "--format", "json")[1]) == []
    assert m2pem.run("doctor", *journal)[0] == 0


def test_an_executive_is_stopped_by_its_journal_while_the_server_is_down(
    m2pem: CommandLine, tmp_path: Path, postgres: PostgresServer, url: str
) -> None:
    fleet, _ = fleet_with_state(tmp_path)
    program = driving(m2pem, fleet, url, M2PEM_LEASE_S="60")
    (file,) = (Path(m2pem.folder) / ".local/state/m2pem").glob("*.postgresql")
    postgres.stop()
    try:
        status, _, errors = m2pem.run("stop", "r1", "--journal", str(file))
        assert status == 1
        assert "the stop went to its vehicles at once" in errors.lower()
    finally:
        postgres.start()
    program.until_record("RunEnded", outcome="stopped")
    program.rest()


def test_a_process_names_its_journal_to_others_without_the_password(
    m2pem: CommandLine, tmp_path: Path, postgres: PostgresServer, url: str
) -> None:
    fleet, _ = fleet_with_state(tmp_path)
    program = driving(m2pem, fleet, url)
    status, _, errors = m2pem.run("resume", "r1", "--ocu", "none", "--journal", url)
    assert status != 0
    assert "driven by an executive that is alive" in errors
    assert SECRET not in errors
    ((command,),) = postgres.execute("SELECT command FROM executives", url)
    assert "postgresql://m2pem@/" in str(command)
    assert SECRET not in str(command)
    for lock in (Path(m2pem.folder)).rglob("*.lock"):
        assert SECRET not in lock.read_text()
    program.kill()


def test_what_is_wrong_with_the_server_is_told_without_a_traceback(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    url = f"postgresql://m2pem:{SECRET}@/x?host={tmp_path}"
    for words in (
        ("runs",),
        ("replay", "r1"),
        ("resume", "r1"),
        ("journal", "info", url),
        ("run", MISSION, "--fleet", FLEET),
        ("doctor",),
    ):
        named = () if url in words else ("--journal", url)
        status, out, errors = m2pem.run(*words, *named)
        assert status != 0
        assert "no PostgreSQL server answers" in out + errors
        assert SECRET not in out + errors
        assert "Traceback" not in errors


def test_a_run_is_held_before_its_lease_ends_and_resumed_when_the_server_is_back(
    m2pem: CommandLine, tmp_path: Path, postgres: PostgresServer, url: str
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    program = driving(m2pem, fleet, url, M2PEM_LEASE_S="1")
    postgres.stop()
    try:
        status, errors = program.rest()
    finally:
        postgres.start()
    assert status != 0
    assert "r1: held: " in errors
    assert "go on with `m2pem resume r1`" in errors
    assert SECRET not in errors
    assert recorded_effects(state)[-1].kind is EffectKind.HOLD
    status, out, _ = m2pem.run("resume", "r1", "--stop", "--ocu", "none", "--journal", url)
    assert "stopped" in out


@pytest.mark.long
@pytest.mark.parametrize("lease_s", ["60", "1"])
def test_a_mission_goes_on_when_a_standby_of_the_server_takes_over(
    m2pem: CommandLine, tmp_path: Path, replicated: Replicated, lease_s: str
) -> None:
    """By itself within the lease of its executive; afterwards by `m2pem resume`."""
    fleet, _ = fleet_with_state(tmp_path)
    journal = ("--journal", replicated.url)
    program = driving(m2pem, fleet, replicated.url, M2PEM_LEASE_S=lease_s)
    programs = [program]
    replicated.primary.kill()
    if lease_s == "1":
        status, errors = program.rest()
        assert (status, "go on with `m2pem resume r1`" in errors) == (1, True), errors
    replicated.standby.promote()
    if lease_s == "1":
        program = m2pem.start("resume", "r1", "--ocu", "none", "--format", "json", *journal)
        program.until_record("RunClaimed", epoch=2)
        programs.append(program)
    status, _, errors = m2pem.run("stop", "r1", *journal)
    assert status == 0, errors
    program.until_record("RunEnded", outcome="stopped")
    program.rest()
    status, out, _ = m2pem.run("replay", "r1", "--format", "json", *journal)
    printed = [line for each in programs for line in each.lines]
    assert set(printed) <= set(out.splitlines())
    assert m2pem.run("replay", "r1", "--verify", *journal)[0] == 0
