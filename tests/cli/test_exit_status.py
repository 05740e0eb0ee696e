"""The exit status of every command for the same kinds of input (docs/cli.md)."""

from pathlib import Path

import pytest

from tests.cli.conftest import Invoke
from tests.command_line import FLEET, MISSION

OF_MISSIONS = {
    "run": ("--fleet", FLEET, "--ocu", "none"),
    "check": ("--fleet", FLEET),
    "verify": ("--fleet", FLEET),
    "simulate": ("--fleet", FLEET),
}
OF_JOURNALS = (
    ("runs",),
    ("runs", "--export", "r1"),
    ("runs", "--delete", "r1"),
    ("replay", "r1"),
    ("explain", "r1", "DriveRoute"),
    ("resume", "r1"),
    ("fleet", FLEET),
    ("run", MISSION, "--fleet", FLEET, "--ocu", "none"),
    ("serve", "--fleet", FLEET, "--ocu", "none"),
)
OF_EXECUTIVES = (
    ("answer", "r1", "p1", "continue"),
    ("signal", "r1", "Stop"),
    ("pause", "r1"),
    ("continue", "r1"),
    ("stop", "r1"),
    ("stop", "--all"),
    ("start", MISSION),
    ("attach",),
    ("fleet", "--running"),
)


@pytest.mark.parametrize("command", OF_MISSIONS)
@pytest.mark.parametrize(
    "fault",
    ["mission missing", "no BPMN", "process", "fleet missing", "bad fleet", "data", "path"],
)
def test_unusable_input_ends_each_command_of_missions_with_2(
    invoke: Invoke, tmp_path: Path, command: str, fault: str
) -> None:
    text, bad_fleet = tmp_path / "text.bpmn", tmp_path / "bad.yaml"
    text.write_text("no BPMN")
    bad_fleet.write_text("vehicles: 3")
    mission, added, replaced = {
        "mission missing": (tmp_path / "missing.bpmn", (), FLEET),
        "no BPMN": (text, (), FLEET),
        "process": (MISSION, ("--process", "X"), FLEET),
        "fleet missing": (MISSION, (), tmp_path / "missing.yaml"),
        "bad fleet": (MISSION, (), bad_fleet),
        "data": (MISSION, ("--data", "speed"), FLEET),
        "path": (MISSION, ("--path", tmp_path / "missing"), FLEET),
    }[fault]
    options = [replaced if word == FLEET else word for word in OF_MISSIONS[command]]
    assert invoke(command, mission, *options, *added)[0] == 2


@pytest.mark.parametrize("words", OF_JOURNALS, ids=lambda words: " ".join(map(str, words[:2])))
@pytest.mark.parametrize("journal", ["ftp://host/db", "postgresql://host/a/b", "", "/no/such.db"])
def test_what_is_no_journal_ends_each_command_of_journals_with_2(
    invoke: Invoke, tmp_path: Path, words: tuple[object, ...], journal: str
) -> None:
    url = journal or tmp_path  # a folder
    status, out, err = invoke(*words, "--journal", url)
    assert (status, out) == (2, "")
    assert err.startswith("m2pem: ")


@pytest.mark.parametrize("command", ["info", "backup", "compact"])
@pytest.mark.parametrize("journal", ["ftp://host/db", "", "/no/such.db"])
def test_what_is_no_journal_ends_its_commands_with_2(
    invoke: Invoke, tmp_path: Path, command: str, journal: str
) -> None:
    assert invoke("journal", command, journal or tmp_path)[0] == 2


@pytest.mark.parametrize("words", OF_EXECUTIVES, ids=lambda words: " ".join(map(str, words[:2])))
def test_without_an_executive_each_request_ends_with_1(
    invoke: Invoke, words: tuple[object, ...]
) -> None:
    status, _, err = invoke(*words)
    assert status == 1
    assert "no executive with the journal" in err


@pytest.mark.parametrize(
    "words",
    [
        ("replay", "r9"),
        ("explain", "r9", "DriveRoute"),
        ("explain", "r9"),
        ("resume", "r9"),
        ("runs", "r9"),
        ("runs", "--export", "r9"),
        ("runs", "--delete", "r9"),
        ("replay",),
        ("stop",),
        ("fleet",),
        ("fleet", "missing.yaml"),
        ("fleet", FLEET, "--running"),
        ("serve", "--fleet", "sim"),
        ("serve", "--fleet", "missing.yaml"),
        ("serve", "--fleet", FLEET, "--ocu", "nothing"),
        ("run", MISSION, "--fleet", FLEET, "--ocu", "nothing"),
        ("run", MISSION, "--fleet", FLEET, "--answers", "missing.yaml"),
        ("run", MISSION, "--fleet", FLEET, "--speed", "0"),
        ("simulate", MISSION, "--fleet", FLEET, "--answers", "missing.yaml"),
        ("simulate", MISSION, "--fleet", FLEET, "--gantt", "/no/such.svg"),
        ("simulate", MISSION, "--start", "now"),
        ("verify", MISSION, "--spec", "missing.yaml"),
        ("verify", MISSION, "--report", "report.pdf"),
        ("verify", MISSION, "--report", "/no/such.md"),
        ("verify", MISSION, "--emit", "promela=/no/such"),
        ("replay", "--counterexample", "missing.json"),
        ("demo", "nothing"),
        ("completion", "tcsh"),
        ("journal", "burn"),
    ],
    ids=lambda words: " ".join(map(str, words)),
)
def test_unusable_arguments_end_with_2(invoke: Invoke, words: tuple[object, ...]) -> None:
    assert invoke(*words)[0] == 2
