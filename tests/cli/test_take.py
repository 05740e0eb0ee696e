"""`m2pem take`: what it ends is said and asked before. tests/e2e/test_take.py has a real one."""

import io
import sys
from pathlib import Path
from typing import Any

import msgspec
import pytest

from m2pem.api.allocation import TakeEffect
from m2pem.control_socket import client
from tests.cli.conftest import Invoke

FAILS = TakeEffect("r1", "r1.b1", "Drive", "DRIVE")
CAUGHT = TakeEffect("r1", "r1.b2", "Scan", "SCAN", caught_by="BY HAND")


@pytest.fixture
def executive(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Two executives; the second one has the vehicle. `effects`: the previews, one after another;
    `asked`: what was changed."""
    state: dict[str, Any] = {"effects": [[]], "asked": []}

    def ask(path: Path, method: str, **params: Any) -> Any:
        if method == "holders":
            return {"scout": "r1.b1"} if path.name == "b" else {"uav": ""}
        if method == "preview_take":
            found = state["effects"].pop(0) if len(state["effects"]) > 1 else state["effects"][0]
            return msgspec.to_builtins(found)
        state["asked"].append((path.name, method, params))
        return None

    monkeypatch.setattr(client, "executives", lambda _: [Path("a"), Path("b")])
    monkeypatch.setattr(client, "ask", ask)
    return state


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Any:
    def types(text: str) -> None:
        typed = io.StringIO(text)
        typed.isatty = lambda: True  # type: ignore[method-assign]
        monkeypatch.setattr(sys, "stdin", typed)

    return types


TAKEN = [("b", "take", {"resource": "scout", "by": "anna"})]


def test_what_no_mission_commands_is_taken_unasked(
    invoke: Invoke, executive: dict[str, Any]
) -> None:
    status, out, err = invoke("take", "scout", "--by", "anna")
    assert (status, out) == (0, "")
    assert err == "scout is taken; `m2pem give-back scout` gives it back to the missions\n"
    assert executive["asked"] == TAKEN


def test_on_a_terminal_the_operator_reads_what_it_ends_and_confirms(
    invoke: Invoke, executive: dict[str, Any], terminal: Any
) -> None:
    executive["effects"] = [[FAILS]]
    terminal("y\n")
    status, out, _ = invoke("take", "scout", "--by", "anna")
    assert status == 0
    assert "TAKEN_OVER is not handled: the mission will fail" in out
    assert "Take scout? [y/N]" in out
    assert executive["asked"] == TAKEN


def test_without_a_yes_nothing_is_taken(
    invoke: Invoke, executive: dict[str, Any], terminal: Any
) -> None:
    executive["effects"] = [[FAILS]]
    terminal("n\n")
    assert invoke("take", "scout")[0] == 1
    assert executive["asked"] == []


def test_what_has_changed_while_it_was_asked_is_asked_again(
    invoke: Invoke, executive: dict[str, Any], terminal: Any
) -> None:
    executive["effects"] = [[CAUGHT], [FAILS], [FAILS]]
    terminal("y\ny\n")
    status, out, _ = invoke("take", "scout", "--by", "anna")
    assert status == 0
    assert "the mission goes on at BY HAND" in out
    assert out.count("Take scout?") == 2
    assert executive["asked"] == TAKEN


def test_a_script_must_say_yes_before(invoke: Invoke, executive: dict[str, Any]) -> None:
    executive["effects"] = [[FAILS]]
    status, out, err = invoke("take", "scout")
    assert (status, err) == (1, "m2pem: scout is not taken. --yes takes it all the same\n")
    assert "the mission will fail" in out
    assert executive["asked"] == []
    assert invoke("take", "scout", "--yes", "--by", "anna")[0] == 0
    assert executive["asked"] == TAKEN


def test_a_vehicle_that_no_fleet_has_is_refused_with_a_like_name(
    invoke: Invoke, executive: dict[str, Any]
) -> None:
    for command in ("take", "give-back"):
        status, _, err = invoke(command, "scot")
        assert status == 1
        assert err == "m2pem: no fleet of an executive here has scot; did you mean 'scout'?\n"
