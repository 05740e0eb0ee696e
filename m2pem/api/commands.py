"""Commands that plugins add to the command line."""

from collections.abc import Collection, MutableMapping
from importlib import import_module
from typing import Any

import click

from m2pem.errors import PluginError


class LazyCommand(click.Command):
    """A command whose module is imported when it is called, so that `m2pem --help` stays fast.

    `module` has a click command of this `name`, with "_" for "-". `needs`: top packages that an
    extra of the plugin brings; `install`: the requirement with that extra.
    """

    def __init__(
        self, name: str, module: str, summary: str, needs: Collection[str] = (), install: str = ""
    ) -> None:
        super().__init__(name, help=summary)
        self._module, self._needs, self._install = module, needs, install

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        """Import the command, and return its context, so that click invokes it.

        Raises:
            PluginError: a package of `needs` is not installed.
        """
        try:
            module = import_module(self._module)
        except ModuleNotFoundError as error:
            if (error.name or "").partition(".")[0] not in self._needs:
                raise
            path = f"{parent.command_path} {self.name}" if parent else self.name
            raise PluginError(
                f"`{path}` needs {error.name}: pip install '{self._install}'"
            ) from error
        command: click.Command = getattr(module, str(self.name).replace("-", "_"))
        return command.make_context(info_name, args, parent, **extra)


def command_group(
    commands: MutableMapping[str, click.Command], name: str, summary: str
) -> click.Group:
    """Return the group of this name, made if it is missing: other plugins may add to it, too."""
    found = commands.get(name)
    if not isinstance(found, click.Group):
        found = commands[name] = click.Group(name, help=summary)
    return found


def simulator_group(commands: MutableMapping[str, click.Command]) -> click.Group:
    """Return the group `m2pem sim`, which has the simulators of all plugins."""
    return command_group(commands, "sim", "Simulate vehicles that speak as real ones do.")
