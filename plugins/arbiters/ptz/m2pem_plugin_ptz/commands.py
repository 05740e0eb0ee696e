"""The commands of this plugin. The module of a command is imported only when it is called."""

from collections.abc import Collection, MutableMapping
from importlib import import_module
from typing import Any

import click

from m2pem.errors import PluginError


class LazyCommand(click.Command):
    """A command in the list of commands whose module is imported when the command is called.

    `needs`: the top packages that the extra `extra` of this plugin brings.
    """

    def __init__(
        self, name: str, module: str, summary: str, extra: str, needs: Collection[str]
    ) -> None:
        super().__init__(name, help=summary)
        self._module, self._extra, self._needs = module, extra, needs

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        """Import the command, and return its context, so that click invokes it."""
        try:
            module = import_module(self._module)
        except ModuleNotFoundError as error:
            if (error.name or "").partition(".")[0] not in self._needs:
                raise
            raise PluginError(
                f"`m2pem sim {self.name}` needs {error.name}: "
                f"pip install 'm2pem-plugin-ptz[{self._extra}]'"
            ) from error
        command: click.Command = getattr(module, str(self.name).replace("-", "_"))
        return command.make_context(info_name, args, parent, **extra)


def add_commands(commands: MutableMapping[str, click.Command]) -> None:
    """Add `sim onvif` and `sim ros-cameras`. The group `sim` may have commands of other plugins."""
    group = commands.get("sim")
    if not isinstance(group, click.Group):
        group = click.Group("sim", help="Simulate vehicles that speak as real ones do.")
        commands["sim"] = group
    simulators = "m2pem_plugin_ptz.simulator"
    group.add_command(
        LazyCommand(
            "onvif",
            f"{simulators}.onvif.command_line",
            "Simulate a camera that turns and speaks ONVIF.",
            "onvif",
            ("aiohttp", "PIL"),
        )
    )
    group.add_command(
        LazyCommand(
            "ros-cameras",
            f"{simulators}.ros.command_line",
            "Simulate cameras that turn over ROS, on 127.0.0.1.",
            "ros",
            ("m2pem_plugin_ros", "rclpy"),
        )
    )
