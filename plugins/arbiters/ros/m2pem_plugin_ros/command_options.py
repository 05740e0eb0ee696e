"""What the commands of this plugin share: lazy loading."""

from collections.abc import MutableMapping
from importlib import import_module
from typing import Any

import click


class LazyCommand(click.Command):
    """A command in the list of commands whose module is imported when the command is called."""

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
        """Import the command, and return its context, so that click invokes it."""
        command: click.Command = getattr(import_module(self._module), str(self.name))
        return command.make_context(info_name, args, parent, **extra)


def group(commands: MutableMapping[str, click.Command], name: str, summary: str) -> click.Group:
    """Return the group of this name, made if it is missing."""
    found = commands.get(name)
    if not isinstance(found, click.Group):
        found = click.Group(name, help=summary)
        commands[name] = found
    return found
