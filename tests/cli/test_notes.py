"""Notes and progress on standard error, and `--quiet`."""

import io
from pathlib import Path
from types import SimpleNamespace

import click
import pytest

from m2pem.cli import notes
from m2pem.cli.group import cli
from m2pem.cli.notes import ERASE, progress_line, share
from tests.cli.conftest import Invoke
from tests.command_line import ANSWERS, FLEET, MISSION

ABORT = ("--answers", ANSWERS / "vignette1_abort.yaml")


class FakeTerminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> FakeTerminal:
    """Standard error, as a terminal."""
    made = FakeTerminal()
    monkeypatch.setattr("m2pem.cli.notes.sys", SimpleNamespace(stderr=made))
    return made


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time that progress goes by; a test may change it."""
    now = [100.0]
    monkeypatch.setattr("m2pem.cli.notes.time.monotonic", lambda: now[0])
    return now


def test_work_shows_progress_only_after_two_seconds_and_erases_it(
    terminal: FakeTerminal, clock: list[float]
) -> None:
    with progress_line() as show:
        for clock[0], text in ((101.9, "early"), (102.0, "a"), (102.1, "often"), (102.3, "b")):
            show(lambda text=text: text)  # type: ignore[misc]
    assert terminal.getvalue() == f"{ERASE}a{ERASE}b{ERASE}"


def test_short_work_writes_nothing(terminal: FakeTerminal, clock: list[float]) -> None:
    with progress_line() as show:
        show(lambda: "text")
    assert terminal.getvalue() == ""


def test_progress_is_for_terminals_alone(
    monkeypatch: pytest.MonkeyPatch, clock: list[float]
) -> None:
    pipe = io.StringIO()
    monkeypatch.setattr("m2pem.cli.notes.sys", SimpleNamespace(stderr=pipe))
    with progress_line() as show:
        clock[0] += 60
        show(lambda: "text")
    assert pipe.getvalue() == ""


@pytest.mark.parametrize("quiet", [True, False])
def test_quiet_turns_progress_and_notes_off(
    terminal: FakeTerminal, clock: list[float], quiet: bool
) -> None:
    words = ["--quiet"] if quiet else []
    with click.Context(cli) as context:
        context.params = {"quiet": bool(words)}
        notes.note("m2pem: a note")
        with progress_line() as show:
            clock[0] += 60
            show(lambda: "text")
    assert terminal.getvalue() == ("" if quiet else f"m2pem: a note\n{ERASE}text{ERASE}")


def test_a_share_is_counted(terminal: FakeTerminal) -> None:
    assert share(12_000, 50_000, "records") == "12,000 of 50,000 records (24 %)"
    assert share(0, 0, "records") == "0 of 0 records (0 %)"


@pytest.fixture
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Progress from the first moment on."""
    monkeypatch.setattr("m2pem.cli.notes.AFTER_S", 0.0)
    monkeypatch.setattr("m2pem.cli.notes.BETWEEN_S", 0.0)
    monkeypatch.setattr("m2pem.cli.notes.shows_progress", lambda: not notes.is_quiet())


@pytest.mark.parametrize(
    ("words", "shown"),
    [
        (("simulate", MISSION, "--fleet", FLEET, *ABORT), " s rehearsed, "),
        (("replay", "r1", "--verify"), " records ("),
        (("replay", "r1", "--state"), " records ("),
        (("journal", "info"), " records read ("),
        (("journal", "backup"), " pages copied ("),
    ],
    ids=lambda words: " ".join(map(str, words[:2])) if isinstance(words, tuple) else "",
)
def test_long_commands_show_their_progress(
    invoke: Invoke, at_once: None, tmp_path: Path, words: tuple[object, ...], shown: str
) -> None:
    invoke("run", MISSION, "--fleet", FLEET, "--ocu", "none", *ABORT)
    status, out, err = invoke(*words)
    assert status == 0
    assert ERASE not in out
    assert shown in err
    assert err.endswith(ERASE)
    for copy in tmp_path.glob("m2pem/journal-*"):  # its name is that of the same second
        copy.unlink()
    assert invoke("--quiet", *words)[2] == ""


def test_quiet_prints_no_warnings_of_the_mission(invoke: Invoke, tmp_path: Path) -> None:
    mission = tmp_path / "m.bpmn"
    text = MISSION.read_text(encoding="utf-8")
    mission.write_text(text.replace("isExecutable=", 'nmae="x" isExecutable=', 1), "utf-8")
    words = ("run", mission, "--fleet", FLEET, "--ocu", "none", *ABORT)
    assert "did you mean 'name'?" in invoke(*words)[2]
    assert invoke("--quiet", *words)[2] == ""


def test_quiet_does_not_hide_errors(invoke: Invoke) -> None:
    status, _, err = invoke("--quiet", "run", "missing.bpmn", "--fleet", FLEET)
    assert status == 2
    assert "missing.bpmn" in err
