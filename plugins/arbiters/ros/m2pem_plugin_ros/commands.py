"""The commands of this plugin. What they need is loaded only when one is called."""

from collections.abc import MutableMapping
from importlib import import_module
from typing import Any

import click


class Later(click.Command):
    """Stands for a command of another module in the list of commands."""

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
        """That of the command itself, which then is what is invoked."""
        command: click.Command = getattr(import_module(self._module), str(self.name))
        return command.make_context(info_name, args, parent, **extra)


def add_to(commands: MutableMapping[str, click.Command]) -> None:
    """Add `sim ros` and `ros onboard`; both groups may have commands of other plugins, too."""
    _group(commands, "sim", "Simulate vehicles that speak as real ones do.").add_command(
        Later("ros", "m2pem_plugin_ros.sim.command_line", "Simulate ROS vehicles on 127.0.0.1.")
    )
    _group(commands, "ros", "For vehicles that speak ROS 2.").add_command(
        Later(
            "onboard",
            "m2pem_plugin_ros.onboard.command_line",
            "Be the m2pem node of a vehicle, on board of it.",
        )
    )


def _group(commands: MutableMapping[str, click.Command], name: str, summary: str) -> click.Group:
    group = commands.get(name)
    if not isinstance(group, click.Group):
        group = click.Group(name, help=summary)
        commands[name] = group
    return group
