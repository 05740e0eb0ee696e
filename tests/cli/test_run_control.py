"""The one-shot commands: what they ask, and what they say when nobody can be asked."""

from pathlib import Path
from typing import Any

import pytest

from m2pem.control_socket import client
from m2pem.errors import OperatorError
from tests.cli.conftest import Invoke

CALLS = [
    ("answer r1 p1 go", "answer", {"prompt": "p1", "decision": "go"}),
    ("signal r1 Home --data a.b=3", "signal", {"id": "Home", "data": {"a.b": 3}}),
    ("pause r1", "pause", {}),
    ("continue r1", "resume", {}),
    ("stop r1 --reason rain", "stop", {"reason": "rain"}),
]


@pytest.mark.parametrize(("words", "method", "params"), CALLS)
def test_a_command_asks_the_executive_of_its_journal(
    invoke: Invoke,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: str,
    method: str,
    params: dict[str, Any],
) -> None:
    asked: list[Any] = []
    monkeypatch.setattr(client, "ask_driver", lambda *args, **more: asked.append((args, more)))
    journal = tmp_path / "j.db"
    assert invoke(*words.split(), "--journal", journal, "--by", "anna") == (0, "", "")
    assert asked == [((journal, "r1", method), {"by": "anna", **params})]


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


@pytest.mark.parametrize("words", [*(words for words, _, _ in CALLS), "attach r1", "attach"])
def test_where_nobody_runs_the_journal_is_named(invoke: Invoke, tmp_path: Path, words: str) -> None:
    status, _, err = invoke(*words.split(), "--journal", tmp_path / "j.db")
    assert status == 1
    assert f"no executive with the journal {tmp_path / 'j.db'}" in err


@pytest.mark.parametrize("words", ["pause r1", "attach"])
def test_an_executive_with_a_journal_in_memory_cannot_be_found(invoke: Invoke, words: str) -> None:
    status, _, err = invoke(*words.split(), "--journal", "memory:")
    assert status == 2
    assert "in memory" in err
