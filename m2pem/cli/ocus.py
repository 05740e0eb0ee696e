"""Chooses operator control units, and serves them beside the runs."""

import asyncio
import logging
import sys
from collections.abc import Awaitable, Sequence

import click

from m2pem.api.control import MissionControl
from m2pem.errors import PluginError
from m2pem.plugins import PluginManager

log = logging.getLogger("m2pem.ocu")

NOBODY = "none"
PLAIN = "plain"
TERMINAL = "terminal"


def chosen(names: str | None, plugins: PluginManager) -> tuple[str, ...]:
    """The units that `--ocu` names, or the default: `terminal` where there is one, else `plain`.

    Raises:
        UsageError: there is no such unit.
    """
    if names is None:
        on_terminal = sys.stdin.isatty() and sys.stdout.isatty()
        return (TERMINAL if on_terminal and TERMINAL in plugins.ocus() else PLAIN,)
    wanted = tuple(dict.fromkeys(name.strip() for name in names.split(",") if name.strip()))
    if wanted == (NOBODY,):
        return ()
    if not wanted or NOBODY in wanted:
        raise click.UsageError(f"--ocu {names!r}: name units, or `{NOBODY}` alone")
    for name in wanted:
        try:
            plugins.ocu(name)
        except PluginError as error:
            raise click.UsageError(str(error)) from error
    return wanted


class Operators:
    """The units at work. One that breaks is told of and stops nothing."""

    def __init__(self, names: Sequence[str], plugins: PluginManager) -> None:
        self.names = tuple(names)
        self._factories = {name: plugins.ocu(name) for name in names}
        self._tasks: list[asyncio.Task[None]] = []

    def begin(self, control: MissionControl) -> None:
        """Let them serve."""
        for name, factory in self._factories.items():
            unit = factory(control)
            self._tasks.append(asyncio.create_task(self._serve(name, unit.serve()), name=name))

    async def end(self) -> None:
        """Let them go."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _serve(self, name: str, serving: Awaitable[None]) -> None:
        try:
            await serving
        except Exception:
            log.exception("the operator control unit %s broke; missions go on without it", name)
