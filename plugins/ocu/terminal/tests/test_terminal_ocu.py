"""The terminal as a plugin: what it needs, what it uses, and what it tells when it cannot serve."""

import ast
import asyncio
import logging
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import m2pem_plugin_terminal
import pytest
from m2pem_plugin_terminal.ocu import TerminalOcu
from terminal_world import World

from m2pem.errors import OperatorError, PluginError
from m2pem.plugins import PluginManager

OPEN_TO_PLUGINS = ("m2pem.api", "m2pem.hookimpl", "m2pem.errors", "m2pem.testing")


class NoTerminal:
    """Standard input as a script has it."""

    def isatty(self) -> bool:
        return False


def imported(path: Path) -> set[str]:
    """What a module imports of m2pem while it runs; types alone do not count."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = []
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "m2pem":
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names if alias.name.split(".")[0] == "m2pem"}
    return names


def test_the_terminal_unit_uses_only_what_is_open_to_plugins() -> None:
    modules = list(Path(m2pem_plugin_terminal.__file__).parent.glob("*.py"))
    assert modules
    used = {name for module in modules for name in imported(module)}
    assert used
    assert [name for name in sorted(used) if not name.startswith(OPEN_TO_PLUGINS)] == []


def test_the_terminal_unit_is_found_as_a_plugin_and_takes_the_terminal() -> None:
    assert "terminal" in {entry.name for entry in entry_points(group="m2pem")}
    factory = PluginManager().ocu("terminal")
    assert factory is TerminalOcu
    assert TerminalOcu.capabilities.takes_terminal


def test_all_that_takes_long_to_import_is_imported_before_an_executive_exists() -> None:
    code = (
        "import sys; from m2pem.cli.ocus import Operators; from m2pem.plugins import PluginManager;"
        "Operators(['terminal'], PluginManager());"
        "before = set(sys.modules); import m2pem_plugin_terminal.app, textual.drivers.linux_driver;"
        "print(set(sys.modules) - before)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout == "set()\n"


async def test_without_a_terminal_it_says_what_to_use(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "__stdin__", NoTerminal())
    with pytest.raises(OperatorError, match="--ocu plain"):
        await TerminalOcu(world.control).serve()


class Tty:
    """Standard input that says it is a terminal; the screen itself is off."""

    def isatty(self) -> bool:
        return True


@pytest.fixture
def headless(monkeypatch: pytest.MonkeyPatch) -> None:
    """Serve as on a terminal, without one."""
    monkeypatch.setattr(sys, "__stdin__", Tty())
    monkeypatch.setattr(
        "textual.app.App.get_driver_class",
        lambda _: (
            __import__(
                "textual.drivers.headless_driver", fromlist=["HeadlessDriver"]
            ).HeadlessDriver
        ),
    )


@pytest.mark.usefixtures("headless")
async def test_cancelled_it_gives_everything_back(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = asyncio.Event()
    monkeypatch.setattr("m2pem_plugin_terminal.display.Display.show", lambda _: shown.set())
    before = logging.getLogger("m2pem").handlers[:]
    factory = asyncio.get_running_loop().get_task_factory()
    serving = asyncio.create_task(TerminalOcu(world.control).serve())
    await shown.wait()
    assert logging.getLogger("m2pem").handlers != before
    logging.getLogger("m2pem.test").warning("shown on the screen")
    serving.cancel()
    with pytest.raises(asyncio.CancelledError):
        await serving
    assert logging.getLogger("m2pem").handlers == before
    assert asyncio.get_running_loop().get_task_factory() is factory


@pytest.mark.usefixtures("headless")
async def test_a_screen_that_breaks_is_told(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: object) -> None:
        raise RuntimeError("a bug")

    monkeypatch.setattr("m2pem_plugin_terminal.display.Display.show", broken)
    with pytest.raises(PluginError, match="the screen of the terminal unit failed"):
        await TerminalOcu(world.control).serve()
