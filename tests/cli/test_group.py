import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click
import pytest

from m2pem.cli.group import COMMANDS, built_in, cli, run_command_line
from m2pem.errors import InternalError, JournalError, M2pemError
from tests.cli.conftest import Invoke
from tests.command_line import FLEET, REPOSITORY, CommandLine, install_plugin

SLOW = ("asyncio", "lxml", "pydantic", "ruamel", "msgspec", "rustworkx")
WAIT = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="x">
  <process id="P" isExecutable="true"><startEvent id="Start"/></process>
</definitions>
"""

BOAT = """
@hookimpl
def m2pem_register_commands(cli):
    @cli.command()
    def dock():
        \"\"\"Bring all boats home.\"\"\"
        print("home")
"""


@pytest.mark.parametrize(
    ("words", "may"), [(["--help"], []), (["--version"], []), (["run", "--help"], ["asyncio"])]
)
def test_help_imports_nothing_slow(words: list[str], may: list[str]) -> None:
    assert imported(words, SLOW) == may


@pytest.mark.parametrize(
    ("words", "unneeded"),
    [
        (["check"], ["asyncio", "m2pem.simulation.arbiters", "pydantic"]),
        (["check", "--fleet", str(FLEET)], ["m2pem.executive.executive", "pyproj", "shapely"]),
        (["simulate"], ["m2pem.fleet.fleet_file", "numpy"]),
        (["run", "--fleet", "sim", "--ocu", "none", "--journal", "memory:"], ["numpy", "pydantic"]),
    ],
)
def test_a_command_imports_nothing_slow_that_it_does_not_use(
    words: list[str], unneeded: list[str], tmp_path: Path
) -> None:
    mission = tmp_path / "wait.bpmn"
    mission.write_text(WAIT, encoding="utf-8")
    assert imported([words[0], str(mission), *words[1:]], unneeded) == []


def imported(words: list[str], names: Iterable[str]) -> list[str]:
    """Those of the modules that a command imports."""
    code = (
        "import sys\nfrom m2pem.cli.group import run_command_line\n"
        f"assert run_command_line({words!r}) == 0\n"
        f"print(*(name for name in {tuple(names)!r} if name in sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True, text=True, check=True
    )
    return done.stdout.splitlines()[-1].split()


def test_the_list_of_commands_says_what_each_says_of_itself() -> None:
    for name, said in COMMANDS.items():
        command = built_in(name)
        assert command.help.splitlines()[0] == said


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_shows_an_example_in_its_help(invoke: Invoke, name: str) -> None:
    status, out, _ = invoke(name, "--help")
    assert status == 0
    assert f"m2pem {name}" in out.partition("Example:")[2]


def test_every_option_says_what_it_is_for() -> None:
    for name in COMMANDS:
        command = cli.get_command(cli.make_context("m2pem", [], resilient_parsing=True), name)
        assert command is not None
        silent = [p.name for p in command.params if p.param_type_name == "option" and not p.help]  # type: ignore[attr-defined]
        assert silent == []


def test_an_unknown_command_is_told_with_what_was_meant(invoke: Invoke) -> None:
    status, _, err = invoke("chek")
    assert status == 2
    assert "there is no command 'chek'; did you mean 'check'?" in err


def test_a_plugins_command_is_listed_and_runs(m2pem: CommandLine, tmp_path: Path) -> None:
    installed = install_plugin(tmp_path, "boat", BOAT)
    assert re.search(r"dock +Bring all boats home\.", m2pem.run("--help", **installed)[1])
    assert m2pem.run("dock", **installed) == (0, "home\n", "")


def test_a_plugin_cannot_take_a_built_in_command(m2pem: CommandLine, tmp_path: Path) -> None:
    installed = install_plugin(tmp_path, "boat", BOAT.replace("dock", "runs"))
    assert m2pem.run("runs", **installed) == (0, "no runs yet\n", "")
    assert "there is a command runs already" in m2pem.run("plugins", **installed)[1]


def test_a_broken_plugin_stops_nothing_and_is_named_where_it_may_matter(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    installed = install_plugin(tmp_path, "boat", "import no_such_library")
    assert m2pem.run("runs", **installed) == (0, "no runs yet\n", "")
    status, _, err = m2pem.run("dock", **installed)
    assert status == 2
    assert "plugin 'boat' (m2pem-plugin-boat 1.0): ModuleNotFoundError" in err


def test_the_version_is_printed(invoke: Invoke) -> None:
    from m2pem import __version__

    assert invoke("--version") == (0, f"m2pem, version {__version__}\n", "")


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
    monkeypatch.setattr("m2pem.cli.group.ignore_closed_stdout", lambda: closed.append(True))
    raising(BrokenPipeError())
    assert invoke("boom") == (1, "", "")
    assert closed == [True]


def test_the_module_can_be_run(m2pem: CommandLine) -> None:
    assert m2pem.run("--version")[0] == 0
    assert m2pem.run("run")[0] == 2
