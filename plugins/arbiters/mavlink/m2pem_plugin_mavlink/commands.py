"""The commands of this plugin; their modules are imported when a command is invoked."""

from collections.abc import MutableMapping
from importlib import import_module
from typing import Any

import click


class LazyCommand(click.Command):
    """A command that imports its module when it is invoked."""

    def __init__(self, name: str, module: str, summary: str) -> None:
        super().__init__(name, help=summary)
        self._module = module

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        """Return the context of the imported command, which is then invoked."""
        command: click.Command = getattr(import_module(self._module), str(self.name))
        return command.make_context(info_name, args, parent, **extra)


def add_to(commands: MutableMapping[str, click.Command]) -> None:
    """Add `sitl` and `sim mavlink`; the group `sim` may have commands of other plugins, too."""
    commands["sitl"] = LazyCommand(
        "sitl",
        "m2pem_plugin_mavlink.sitl.command_line",
        "Start the real autopilots of a fleet, as software in the loop.",
    )
    group = commands.get("sim")
    if not isinstance(group, click.Group):
        group = click.Group("sim", help="Simulate vehicles that speak as real ones do.")
        commands["sim"] = group
    group.add_command(
        LazyCommand(
            "mavlink",
            "m2pem_plugin_mavlink.simulator.command_line",
            "Simulate MAVLink vehicles over UDP.",
        )
    )
