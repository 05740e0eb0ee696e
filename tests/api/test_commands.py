"""Commands of plugins: their modules are imported when they are called."""

import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from m2pem.api import LazyCommand, command_group, simulator_group
from m2pem.errors import PluginError


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "pump_commands", raising=False)
    return tmp_path / "pump_commands.py"


def group_of(command: click.Command) -> click.Group:
    cli = click.Group("m2pem")
    simulator_group(cli.commands).add_command(command)
    return cli


def test_a_module_is_imported_when_its_command_is_called(module: Path) -> None:
    module.write_text("import click\n@click.command()\ndef fire_pump(): click.echo('pumps')\n")
    cli = group_of(LazyCommand("fire-pump", "pump_commands", "Pump."))
    assert "Pump." in CliRunner().invoke(cli, ["sim", "--help"]).output
    assert "pump_commands" not in sys.modules
    assert CliRunner().invoke(cli, ["sim", "fire-pump"]).output == "pumps\n"


def test_a_missing_package_of_an_extra_is_named_with_what_installs_it(module: Path) -> None:
    module.write_text("import hydraulics.valves\n")
    cli = group_of(LazyCommand("pump", "pump_commands", "", ("hydraulics",), "pumps[real]"))
    with pytest.raises(PluginError, match=r"`m2pem sim pump` needs hyd.*'pumps\[real\]'"):
        cli.main(["sim", "pump"], prog_name="m2pem", standalone_mode=False)


def test_another_missing_package_is_a_bug(module: Path) -> None:
    module.write_text("import hydraulics\n")
    cli = group_of(LazyCommand("pump", "pump_commands", "", ("water",), "pumps[real]"))
    with pytest.raises(ModuleNotFoundError, match="hydraulics"):
        cli.main(["sim", "pump"], prog_name="m2pem", standalone_mode=False)


def test_plugins_share_a_group() -> None:
    cli = click.Group("m2pem")
    first = command_group(cli.commands, "ros", "For vehicles that speak ROS 2.")
    assert command_group(cli.commands, "ros", "") is first
