import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest

from m2pem.cli.group import COMMANDS, built_in, cli
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
        (["check", "--fleet", str(FLEET)], ["m2pem.executive.executive"]),
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
        "import sys\nfrom m2pem.cli.entry import run_command_line\n"
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
    assert "dock  Bring all boats home." in m2pem.run("--help", **installed)[1]
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
