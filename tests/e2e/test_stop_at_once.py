"""STOP while the journal of a real executive does not write: what the vehicles saw of it."""

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from m2pem.simulation.state_file import recorded_effects
from tests.command_line import (
    ANSWERS,
    MISSION,
    CommandLine,
    Program,
    fleet_with_state,
    install_plugin,
)

BLOCKING_OBSERVER = """
import threading

@hookimpl
def m2pem_records_committed(run_id, records):
    threading.Event().wait()
"""


STALLING = """
import os, time
from m2pem.journal.transaction import WriteTransaction

commit = WriteTransaction.commit

def stalled(self):
    while os.path.exists("stalled"):
        time.sleep(0.01)
    return commit(self)

WriteTransaction.commit = stalled
"""


def driving(m2pem: CommandLine, fleet: Path, journal: Path, **environment: str) -> Program:
    """The mission of the paper, with evsg1 on its route and nothing detected."""
    program = m2pem.start(
        "run", MISSION, "--fleet", fleet, "--format", "json", "--ocu", "none",
        "--journal", journal, "--answers", ANSWERS / "vignette1_route.yaml", **environment,
    )  # fmt: skip
    program.until_record("BehaviorProgressed", state="RUNNING")
    return program


@contextmanager
def stalled(folder: Path) -> Iterator[None]:
    """No commit of an executive with the plugin STALLING comes to its end within the block."""
    file = folder / "stalled"
    file.touch()
    yield
    file.unlink()


def until(true: Callable[[], bool]) -> None:
    end = time.monotonic() + 60
    while not true():
        assert time.monotonic() < end, "it did not come about"
        time.sleep(0.02)


def effects(state: Path) -> list[str]:
    return [each.kind.value for each in recorded_effects(state)]


@pytest.mark.parametrize("how", ["command", pytest.param("all", marks=pytest.mark.long), "signal"])
def test_a_vehicle_is_cancelled_while_the_disk_is_stalled(
    m2pem: CommandLine, tmp_path: Path, how: str
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    journal = tmp_path / "j.db"
    program = driving(m2pem, fleet, journal, **install_plugin(tmp_path, "stalling", STALLING))
    with stalled(tmp_path):
        if how == "signal":
            program.send(signal.SIGTERM)
        else:
            words = ["r1"] if how == "command" else ["--all"]
            status, _, errors = m2pem.run("stop", *words, "--journal", journal)
            assert status == 1
            assert "r1: the stop went to its vehicles at once" in errors
        until(lambda: "cancel" in effects(state))
    assert program.until_record("RunEnded")["outcome"] == "stopped"
    assert program.rest()[0] == 130
    assert effects(state).count("cancel") == 1


def test_a_run_that_was_stopped_before_its_executive_died_stays_stopped(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    journal = tmp_path / "j.db"
    program = driving(m2pem, fleet, journal, **install_plugin(tmp_path, "stalling", STALLING))
    with stalled(tmp_path):
        m2pem.run("stop", "r1", "--reason", "people", "--journal", journal)
        until(lambda: "cancel" in effects(state))
        program.kill()
    starts = effects(state).count("start")
    words = ("--ocu", "none", "--format", "json", "--journal", journal)
    resumed = m2pem.start("resume", "r1", *words)
    ended = resumed.until_record("RunEnded")
    assert (ended["outcome"], ended["detail"]) == ("stopped", "people")
    assert resumed.rest()[0] == 130
    assert effects(state).count("start") == starts
    assert not list(tmp_path.glob("j.db-stopped-*"))


def test_an_observer_that_never_returns_delays_no_stop(m2pem: CommandLine, tmp_path: Path) -> None:
    fleet, state = fleet_with_state(tmp_path)
    journal = tmp_path / "j.db"
    plugin = install_plugin(tmp_path, "blocking", BLOCKING_OBSERVER)
    program = driving(m2pem, fleet, journal, **plugin)
    assert m2pem.run("stop", "--all", "--journal", journal)[:2] == (0, "stopped: r1\n")
    assert program.until_record("RunEnded")["outcome"] == "stopped"
    until(lambda: "end" in effects(state))
    status, errors = program.rest()
    assert status == 130
    assert "plugins that observe records did not end" in errors


def test_stop_with_standard_error_that_nothing_reads(m2pem: CommandLine, tmp_path: Path) -> None:
    """Printing to a full pipe waits for ever: it must not be the event loop that waits."""
    fleet, state = fleet_with_state(tmp_path)
    fill = """
import logging

@hookimpl
def m2pem_records_committed(run_id, records):
    for _ in range(2000):
        logging.getLogger("m2pem").error("x" * 100)
"""
    plugin = install_plugin(tmp_path, "talking", fill)
    program = driving(m2pem, fleet, tmp_path / "j.db", **plugin)
    program.send(signal.SIGTERM)
    until(lambda: "cancel" in effects(state))
    assert program.until_record("RunEnded")["outcome"] == "stopped"
