"""The one-shot commands: what they ask, and what they say when nobody can be asked."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from m2pem.api import OPERATIONS
from m2pem.control_socket import client
from m2pem.errors import OperatorError
from tests.cli.conftest import Invoke
from tests.command_line import ANSWERS, FLEET, MISSION

CALLS = [
    ("answer r1 p1 go", "answer", {"prompt": "p1", "decision": "go"}, "r1: p1 is answered: go"),
    (
        "signal r1 Home --data a.b=3",
        "signal",
        {"id": "Home", "data": {"a.b": 3}},
        "r1: signal 'Home' is sent",
    ),
    ("note r1 windy", "add_note", {"text": "windy"}, "r1: the note is written"),
    ("pause r1", "pause", {}, "r1 is paused"),
    ("continue r1", "resume", {}, "r1 goes on"),
    (
        "break r1 Drive Ask --when n>3",
        "set_breakpoints",
        {"elements": ["Drive", "Ask"], "conditions": ["n>3"]},
        "r1: breakpoints: Drive, Ask, when n>3",
    ),
    ("step r1", "step", {}, "r1 makes one step"),
    ("set r1 a=3", "set_data", {"data": {"a": 3}, "scope": 1}, "r1: changed: a"),
    ("stop r1 --reason rain", "stop", {"reason": "rain"}, "stopped: r1"),
]

OTHERWISE = {
    "request_control": "m2pem take --ask",
    "answer_control": "m2pem hand-over",
    "control_requests": "m2pem operators",
    "operators": "m2pem operators",
    "approval": "m2pem approve --show",
    "approve": "m2pem approve, which tests/cli/test_approve.py tries",
    "withdraw_approval": "m2pem approve --withdraw",
    "alerts": "m2pem alerts, which tests/e2e/test_alerts.py tries",
    "acknowledge_alert": "m2pem acknowledge",
    "own_alert": "m2pem own",
    "delete_geometry": "m2pem geometries delete, which tests/cli/test_geometries.py tries",
    "geometry_versions": "m2pem geometries versions reads the journal",
    "geometry_users": "m2pem geometries import asks before it replaces a drawing",
    "start": "m2pem start, which tests/e2e/test_start.py tries",
    "check": "m2pem check asks no executive",
    "missions": "missions in m2pem attach",
    "preview_start": "check in m2pem attach",
    "stop_all": "m2pem stop --all",
    "schedule": "m2pem start --when and its like",
    "scheduled": "m2pem schedule",
    "unschedule": "m2pem schedule cancel",
    "start_scheduled": "m2pem schedule start",
    "hold_schedule": "m2pem schedule hold",
    "release_schedule": "m2pem schedule release",
    "set_geometry": "route, area and point in m2pem attach",
    "take": "m2pem take, which tests/e2e/test_take.py tries",
    "preview_take": "m2pem take asks it first",
    "give_back": "m2pem give-back",
    "holders": "m2pem fleet --running, and who in m2pem attach",
    "holder_labels": "m2pem fleet --running, and who in m2pem attach",
    "unavailable": "m2pem fleet --running, and who in m2pem attach",
    "shared_space": "m2pem fleet --running, and who in m2pem attach",
    "waiting": "m2pem fleet --running, and who in m2pem attach",
    "incidents": "m2pem incidents, which tests/cli/test_incidents.py tries",
    "preview_incident": "m2pem resolve asks it first",
    "resolve_incident": "m2pem resolve",
    "versions": "m2pem runs --versions reads the journal",
    "version_files": "m2pem runs --export has the files of all versions",
    "plan_revision": "m2pem revise asks it first",
    "revise": "m2pem revise, which tests/cli/test_revise.py tries",
    "runs": "m2pem runs, and runs in m2pem attach",
    "prompts": "m2pem attach shows them",
    "subscribe": "m2pem attach shows what comes",
    "records": "m2pem replay reads the journal",
    "mission": "m2pem replay reads the journal",
    "mission_time_s": "m2pem attach finds the executive of a run by it",
    "wait": "m2pem run and m2pem resume wait in the executive",
    "fleet": "m2pem fleet reads the file",
    "catalogue": "m2pem fleet asks the arbiters of the file",
    "telemetry": "the terminal unit in m2pem attach shows it",
    "journal_file": "--journal names it",
    "data": "m2pem data, which a test below tries",
    "health": "m2pem doctor --running",
    "standbys": "m2pem doctor --running",
    "statistics": "face prometheus of m2pem serve and m2pem run",
    "switch_over": "m2pem switchover, which tests/e2e/test_switchover.py tries",
}
NO_COMMAND = {
    "announce_presence": "operator control units announce who is present",
    "end_presence": "operator control units announce who is present",
    "note_edit": "editors note who saves a mission",
    "execute_behavior": "programs command vehicles through faces; an operator starts missions",
    "evaluate": "the page evaluates; m2pem debug does in a rehearsal",
    "message": "programs send messages: over the control socket, REST or ROS",
    "simulated": "the fleet file says it, and m2pem run --simulate",
    "speed": "the person who starts an executive sets it: m2pem run --speed",
}


def test_every_operation_has_a_command_or_a_reason_why_not() -> None:
    commands = {method for _, method, _, _ in CALLS}
    assert commands | {*OTHERWISE} | {*NO_COMMAND} == set(OPERATIONS)


@pytest.mark.parametrize(
    ("method", "params"),
    [
        *((method, {"run": "r1", **more}) for _, method, more, _ in CALLS),
        ("stop_all", {"reason": ""}),
    ],
)
def test_an_operation_accepts_what_a_command_sends(method: str, params: dict[str, Any]) -> None:
    parameters = OPERATIONS[method].parameters
    read = msgspec.convert({"by": "anna", **params}, parameters)
    assert msgspec.to_builtins(read).items() >= params.items()


@pytest.mark.parametrize(("words", "method", "params", "done"), CALLS)
def test_a_command_asks_the_executive_of_its_journal_and_says_what_was_done(
    invoke: Invoke,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: str,
    method: str,
    params: dict[str, Any],
    done: str,
) -> None:
    asked: list[Any] = []
    monkeypatch.setattr(client, "ask_driver", lambda *args, **more: asked.append((args, more)))
    journal = tmp_path / "j.db"
    assert invoke(*words.split(), "--journal", journal, "--by", "anna") == (0, "", f"{done}\n")
    assert asked == [((journal, "r1", method), {"by": "anna", **params})]
    assert invoke("--quiet", *words.split(), "--journal", journal) == (0, "", "")


def test_the_data_of_a_run_is_printed_with_how_it_is_changed(
    invoke: Invoke, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stores = [
        {"process": "", "element": "", "data": {"log": [1]}, "scope": 1},
        {"process": "P", "element": "P", "data": {}, "scope": 1},
        {"process": "P", "element": "Survey", "data": {"field": "north"}, "instance": 1},
    ]
    monkeypatch.setattr(client, "ask_driver", lambda *_, **__: stores)
    journal = tmp_path / "j.db"
    status, printed, _ = invoke("data", "r1", "--journal", journal)
    assert (status, printed.splitlines()) == (
        0,
        [
            "data stores (--scope 1):",
            "  log = [1]",
            "P (--scope 1):",
            "  nothing",
            "Survey, instance 1 (cannot be changed):",
            '  field = "north"',
        ],
    )
    status, printed, _ = invoke("data", "r1", "--format", "json", "--journal", journal)
    assert msgspec.json.decode(printed) == {"data": stores}


@pytest.mark.parametrize(("variable", "by"), [("carol", "carol"), ("", "user@host")])
def test_who_asks_is_named(
    invoke: Invoke, monkeypatch: pytest.MonkeyPatch, variable: str, by: str
) -> None:
    asked: list[Any] = []
    monkeypatch.setattr(client, "ask_driver", lambda *_, **more: asked.append(more["by"]))
    monkeypatch.setattr("getpass.getuser", lambda: "user")
    monkeypatch.setattr("socket.gethostname", lambda: "host.example")
    monkeypatch.setenv("M2PEM_OPERATOR", variable)
    assert invoke("pause", "r1")[0] == 0
    assert asked == [by]


@pytest.mark.parametrize("words", ["stop", "stop r1 --all"])
def test_stop_takes_a_run_or_all_of_them(invoke: Invoke, words: str) -> None:
    status, _, err = invoke(*words.split())
    assert status == 2
    assert "name a run to stop, or --all" in err


def test_a_refusal_ends_with_1(invoke: Invoke, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OperatorError("r1: somebody was first")

    monkeypatch.setattr(client, "ask_driver", refuse)
    assert invoke("answer", "r1", "p1", "go") == (1, "", "m2pem: r1: somebody was first\n")


@pytest.mark.parametrize("words", [*(words for words, _, _, _ in CALLS), "attach r1", "attach"])
def test_where_nobody_runs_the_journal_is_named(invoke: Invoke, tmp_path: Path, words: str) -> None:
    status, _, err = invoke(*words.split(), "--journal", tmp_path / "j.db")
    assert status == 1
    assert f"no executive with the journal {tmp_path / 'j.db'}" in err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("stop r1", "there was nothing to stop"),
        ("answer r1 p1 abort", "no question of it is open"),
        ("attach r1 --ocu plain", "m2pem replay prints what it did"),
    ],
)
def test_of_a_run_that_has_ended_the_journal_says_how(
    invoke: Invoke, words: str, told: str
) -> None:
    abort = ("--answers", ANSWERS / "vignette1_abort.yaml", "--ocu", "none")
    assert invoke("run", MISSION, "--fleet", FLEET, "--simulate", *abort)[0] == 0
    status, _, err = invoke(*words.split())
    assert status == 1
    assert err.startswith("m2pem: r1 has ended on 20")
    assert err.endswith(f" (terminated: terminated by mission ended); {told}\n")


@pytest.mark.parametrize("words", ["pause r1", "attach"])
def test_an_executive_with_a_journal_in_memory_cannot_be_found(invoke: Invoke, words: str) -> None:
    status, _, err = invoke(*words.split(), "--journal", "memory:")
    assert status == 2
    assert "in memory" in err
