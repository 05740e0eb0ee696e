import asyncio
import logging
import sys
from types import SimpleNamespace
from typing import Any, cast

import click
import pytest

from m2pem.api.capabilities import OcuCapabilities
from m2pem.api.clock import Clock, run_virtual
from m2pem.api.control import MissionControl
from m2pem.cli.ocus import LEAVES_WITHIN_S, Operators, chosen
from m2pem.errors import PluginError
from m2pem.plugins import PluginManager


class Plugins:
    """Has some units."""

    def __init__(self, **units: Any) -> None:
        self._units = units

    def ocus(self) -> dict[str, Any]:
        return self._units

    def ocu(self, name: str) -> Any:
        if name not in self._units:
            raise PluginError(f"there is no ocu {name!r}")
        return self._units[name]


def plugins(**units: Any) -> PluginManager:
    return cast("PluginManager", Plugins(**units))


def on_terminal(monkeypatch: pytest.MonkeyPatch, stdin: bool, stdout: bool) -> None:
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(isatty=lambda: stdin))
    monkeypatch.setattr(sys, "stdout", SimpleNamespace(isatty=lambda: stdout))


@pytest.mark.parametrize(
    ("stdin", "stdout", "unit"),
    [(True, True, "terminal"), (False, True, "plain"), (True, False, "plain")],
)
def test_the_default_is_the_terminal_where_there_is_one(
    monkeypatch: pytest.MonkeyPatch, stdin: bool, stdout: bool, unit: str
) -> None:
    on_terminal(monkeypatch, stdin, stdout)
    assert chosen(None, plugins(terminal=1, plain=2)) == (unit,)


def test_without_that_plugin_it_is_plain(monkeypatch: pytest.MonkeyPatch) -> None:
    on_terminal(monkeypatch, True, True)
    assert chosen(None, plugins(plain=2)) == ("plain",)


def test_several_are_named_each_once() -> None:
    assert chosen("web, plain,web", plugins(web=1, plain=2)) == ("web", "plain")


def test_nobody_serves_if_that_is_wanted() -> None:
    assert chosen("none", plugins(plain=1)) == ()


@pytest.mark.parametrize("names", ["", ",", "none,plain", "foo"])
def test_what_names_no_unit_is_refused(names: str) -> None:
    with pytest.raises(click.UsageError):
        chosen(names, plugins(plain=1))


class Unit:
    """Serves until cancelled; tells what became of it."""

    became: dict[str, str]

    def __init__(self, control: MissionControl) -> None:
        self.control = control

    async def serve(self) -> None:
        try:
            await asyncio.get_running_loop().create_future()
        finally:
            self.became["good"] = "cancelled"


class Broken(Unit):
    async def serve(self) -> None:
        raise ValueError("no screen")


def test_what_a_unit_imports_is_imported_before_it_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    module = "wave"  # any that nothing here needs

    class Heavy(Unit):
        capabilities = OcuCapabilities(imports=(module,))

    monkeypatch.delitem(sys.modules, module, raising=False)
    Operators(["heavy"], plugins(heavy=Heavy))
    assert module in sys.modules


async def test_a_unit_that_breaks_is_told_of_and_stops_nothing(
    caplog: pytest.LogCaptureFixture,
) -> None:
    Unit.became = {}
    operators = Operators(["good", "bad"], plugins(good=Unit, bad=Broken))
    with caplog.at_level(logging.ERROR, "m2pem"):
        operators.begin(cast("MissionControl", None), lambda: None)
        await asyncio.sleep(0)
        assert "the operator control unit bad broke" in caplog.text
        assert Unit.became == {}
        await operators.end()
    assert Unit.became == {"good": "cancelled"}


class Silent:
    """A remote executive that does not answer any more."""

    async def announce_presence(self, client: str, *, unit: str, by: str) -> None:
        pass

    async def end_presence(self, client: str) -> None:
        await asyncio.get_running_loop().create_future()


def test_an_operator_leaves_an_executive_that_does_not_answer() -> None:
    Unit.became = {}

    async def main(clock: Clock) -> float:
        operators = Operators(["plain"], plugins(plain=Unit))
        operators.begin(cast("MissionControl", Silent()), lambda: None)
        await clock.sleep(1.0)
        began_us = clock.now_us()
        await operators.end()
        return (clock.now_us() - began_us) / 1e6

    assert run_virtual(main, 0) == pytest.approx(LEAVES_WITHIN_S)
    assert Unit.became == {"good": "cancelled"}
