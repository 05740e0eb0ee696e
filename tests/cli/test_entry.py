from typing import Any

import click
import pytest

from m2pem.cli import entry
from m2pem.cli.entry import run_command_line
from m2pem.cli.group import cli
from m2pem.errors import InternalError, JournalError, M2pemError
from tests.cli.conftest import Invoke
from tests.command_line import CommandLine


@pytest.fixture
def raising(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Makes the command `boom` raise something."""

    def prepare(error: BaseException) -> None:
        @click.command()
        def boom() -> None:
            raise error

        monkeypatch.setattr(
            type(cli), "get_command", lambda _, __, name: boom if name == "boom" else None
        )

    return prepare


class _UnusableError(M2pemError):
    exit_status = 2


@pytest.mark.parametrize(
    ("error", "status"),
    [(JournalError("no disk"), 1), (_UnusableError("no file"), 2), (InternalError("oh"), 1)],
)
def test_an_error_of_m2pem_is_a_message_and_the_status_of_its_class(
    invoke: Invoke, raising: Any, error: M2pemError, status: int
) -> None:
    raising(error)
    assert invoke("boom") == (status, "", f"m2pem: {error}\n")


def test_any_other_error_is_a_bug_to_report(invoke: Invoke, raising: Any) -> None:
    raising(ZeroDivisionError("division by zero"))
    status, out, err = invoke("boom")
    assert (status, out) == (1, "")
    assert "this is a bug in m2pem: ZeroDivisionError: division by zero" in err
    assert "report it" in err
    assert "Traceback" not in err


def test_debug_shows_tracebacks(invoke: Invoke, raising: Any) -> None:
    raising(JournalError("no disk"))
    status, _, err = invoke("--debug", "boom")
    assert status == 1
    assert "Traceback" in err
    raising(ZeroDivisionError())
    with pytest.raises(ZeroDivisionError):
        run_command_line(["--debug", "boom"])


@pytest.mark.parametrize("error", [KeyboardInterrupt(), click.Abort()])
def test_an_interrupt_is_no_error(invoke: Invoke, raising: Any, error: BaseException) -> None:
    raising(error)
    status, out, err = invoke("boom")
    assert (status, out, err.strip()) == (130, "", "")


def test_a_closed_output_is_no_error(
    invoke: Invoke, raising: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    closed: list[bool] = []
    monkeypatch.setattr(entry, "ignore_closed_stdout", lambda: closed.append(True))
    raising(BrokenPipeError())
    assert invoke("boom") == (1, "", "")
    assert closed == [True]


def test_the_module_can_be_run(m2pem: CommandLine) -> None:
    assert m2pem.run("--version")[0] == 0
    assert m2pem.run("run")[0] == 2
