"""One executive commands a vehicle: the second one on this machine is refused by name."""

from pathlib import Path

import pytest

from tests.command_line import FLEET, MISSION, CommandLine, Program, fleet_with_state


def serving(m2pem: CommandLine, fleet: Path, journal: str) -> Program:
    program = m2pem.start("serve", "--fleet", fleet, "--ocu", "none", "--journal", journal)
    assert "serving" in program.stderr.readline()
    return program


def assert_refused(found: tuple[int, str, str], first: Program) -> None:
    status, printed, errors = found
    assert (status, printed) == (2, "")
    assert "evsg1" in errors
    assert f"process {first.process.pid} commands it already: m2pem serve" in errors
    assert f"kill {first.process.pid}" in errors


def test_a_run_beside_serve_with_the_same_fleet_and_journal_is_refused(m2pem: CommandLine) -> None:
    first = serving(m2pem, FLEET, "journal.db")
    run = ("run", MISSION, "--fleet", FLEET, "--ocu", "none")
    assert_refused(m2pem.run(*run, "--journal", "journal.db"), first)
    assert m2pem.run("runs", "--journal", "journal.db")[1] == "no runs yet\n"
    first.kill()
    second = m2pem.start(*run[:-1], "plain", "--journal", "journal.db")
    second.until_text("[p1] UserSendRoute")


def test_two_journals_on_one_state_file_share_its_vehicles(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, _ = fleet_with_state(tmp_path)
    first = serving(m2pem, fleet, "one.db")
    run = ("run", MISSION, "--fleet", fleet, "--ocu", "none", "--journal", "two.db")
    assert_refused(m2pem.run(*run), first)


@pytest.mark.long
def test_simulations_with_journals_of_their_own_run_side_by_side(m2pem: CommandLine) -> None:
    serving(m2pem, FLEET, "one.db")
    serving(m2pem, FLEET, "two.db")
    assert m2pem.run("check", MISSION, "--fleet", FLEET)[0] == 0


@pytest.mark.long
def test_a_killed_executive_keeps_no_vehicle(m2pem: CommandLine) -> None:
    run = ("run", MISSION, "--fleet", FLEET, "--ocu", "plain", "--journal", "journal.db")
    first = m2pem.start(*run)
    first.until_text("[p1] UserSendRoute")
    first.kill()
    again = m2pem.start("resume", "r1", "--ocu", "plain", "--journal", "journal.db")
    again.until_text("[p1] UserSendRoute")
