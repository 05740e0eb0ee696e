"""`m2pem start`: a mission in an executive that serves, from another process."""

import re
import shlex
from pathlib import Path

from tests.command_line import FLEET, MISSION, CommandLine, Program

JOURNAL = ("--journal", "journal.db")


def serving(m2pem: CommandLine, *more: str | Path) -> Program:
    program = m2pem.start("serve", "--fleet", FLEET, "--ocu", "none", *JOURNAL, *more)
    assert "serving" in program.stderr.readline()
    return program


def test_a_mission_is_started_where_an_executive_serves(m2pem: CommandLine, tmp_path: Path) -> None:
    server = serving(m2pem)
    copied = tmp_path / "copied.bpmn"
    copied.write_bytes(Path(MISSION).read_bytes())
    assert m2pem.run("start", copied, *JOURNAL) == (0, "r1\n", "")
    copied.unlink()
    assert m2pem.run("answer", "r1", "p1", "continue", *JOURNAL)[0] == 0
    while "evsg1 begins" not in m2pem.run("replay", "r1", *JOURNAL)[1]:
        assert server.process.poll() is None
    status, _, errors = m2pem.run("start", MISSION, *JOURNAL)
    assert status == 1
    assert "run r1 uses evsg1" in errors
    assert m2pem.run("start", MISSION, *JOURNAL, "--even-if-busy")[:2] == (0, "r2\n")
    assert m2pem.run("stop", "--all", *JOURNAL)[0] == 0


def test_a_mission_that_does_not_fit_the_fleet_ends_with_2_and_its_findings(
    m2pem: CommandLine,
) -> None:
    serving(m2pem)
    unfit = Path(MISSION).with_name("mehds_vignette_1.bpmn")
    status, printed, errors = m2pem.run("start", unfit, *JOURNAL)
    assert (status, printed) == (2, "")
    assert "[unknown-payload]" in errors
    assert m2pem.run("start", "no.bpmn", *JOURNAL)[0] == 2
    assert m2pem.run("start", MISSION, "--process", "X", *JOURNAL)[0] == 2


def test_without_an_executive_nothing_starts(m2pem: CommandLine) -> None:
    status, _, errors = m2pem.run("start", MISSION, *JOURNAL)
    assert status == 1
    assert "no executive with the journal" in errors


def test_a_refused_run_names_the_command_that_starts_the_mission(m2pem: CommandLine) -> None:
    first = serving(m2pem)
    run = ("run", MISSION, "--fleet", FLEET, "--ocu", "none", *JOURNAL)
    status, _, errors = m2pem.run(*run)
    assert status == 2
    found = re.search(r"\(m2pem (start MISSION .*?)\)", errors)
    assert found, errors
    words = shlex.split(found[1])
    assert str(first.process.pid) in words
    assert m2pem.run(*(MISSION if word == "MISSION" else word for word in words))[:2] == (0, "r1\n")
