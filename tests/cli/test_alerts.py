"""`m2pem alerts` and `m2pem operators` at a terminal: names and texts do not control it."""

from pathlib import Path

import msgspec
import pytest

from m2pem.api.alerts import AlertSeverity, OperatorAlert
from m2pem.api.people import OperatorPresence
from m2pem.cli import alerts, operators
from tests.cli.conftest import Invoke

CLEARS_THE_SCREEN = "\x1b[2J"


def test_what_a_vehicle_says_does_not_control_the_terminal(
    invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = f"uav1 says: {CLEARS_THE_SCREEN}\nall is well"
    alert = OperatorAlert("a1", AlertSeverity.WARNING, "LOGGED", text, 1, 1)
    answers = {
        "alerts": [alert],
        "operators": [OperatorPresence(f"anna{CLEARS_THE_SCREEN}", "page", "", "", "", 1)],
    }

    def answer(_: Path, method: str, **__: object) -> object:
        return msgspec.to_builtins(answers.get(method, []))

    for command in (alerts, operators):
        monkeypatch.setattr(command, "executives_here", lambda _: [Path("socket")])
    monkeypatch.setattr("m2pem.control_socket.client.ask", answer)
    status, out, _ = invoke("alerts")
    assert (status, out) == (0, "a1: warning: uav1 says: ?[2J all is well\n")
    status, out, _ = invoke("operators")
    assert status == 0
    assert out.startswith("anna?[2J")
