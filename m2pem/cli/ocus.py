"""Chooses operator control units, and serves them beside the runs."""

import asyncio
import importlib
import logging
import sys
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import cast
from uuid import uuid4

import click

from m2pem.api.capabilities import ocu_capabilities
from m2pem.api.control import MissionControl
from m2pem.api.health import ExecutiveAddress
from m2pem.api.ocu import StandbyOcu
from m2pem.api.operator import operator_name
from m2pem.api.people import PRESENCE_EVERY_S
from m2pem.cli.notes import note
from m2pem.errors import M2pemError, PluginError
from m2pem.plugins import PluginManager

log = logging.getLogger("m2pem.ocu")

NO_UNIT = "none"
PLAIN = "plain"
TERMINAL = "terminal"

LEAVES_WITHIN_S = 2.0
"""An executive that has not taken the leave of an operator by then is silent."""


def chosen(names: str | None, plugins: PluginManager) -> tuple[str, ...]:
    """The units that `--ocu` names, or the default: `terminal` where there is one, else `plain`.

    Without a terminal, `plain` stands in for a unit that takes the whole terminal.

    Raises:
        UsageError: there is no such unit.
    """
    on_terminal = sys.stdin.isatty() and sys.stdout.isatty()
    if names is None:
        return (TERMINAL if on_terminal and TERMINAL in plugins.ocus() else PLAIN,)
    wanted = names_of("--ocu", names, "units")
    found: dict[str, None] = {}
    for name in wanted:
        try:
            factory = plugins.ocu(name)
        except PluginError as error:
            raise click.UsageError(str(error)) from error
        if ocu_capabilities(factory).takes_terminal and not on_terminal:
            note(f"m2pem: no terminal here for --ocu {name}; using {PLAIN}")
            name = PLAIN  # noqa: PLW2901
        found[name] = None
    if sum(ocu_capabilities(plugins.ocu(name)).takes_terminal for name in found) > 1:
        raise click.UsageError(f"--ocu {names!r}: only one of them can have the terminal")
    return tuple(found)


def names_of(option: str, text: str, what: str) -> tuple[str, ...]:
    """The names that an option lists with commas; none for `none`. `what`: what it names.

    Raises:
        UsageError: it names none, or `none` beside others.
    """
    wanted = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if wanted == (NO_UNIT,):
        return ()
    if not wanted or NO_UNIT in wanted:
        raise click.UsageError(f"{option} {text!r}: name {what}, or `{NO_UNIT}` alone")
    return wanted


class Operators:
    """The units that serve. A unit that raises is reported, and stops nothing."""

    def __init__(self, names: Sequence[str], plugins: PluginManager) -> None:
        self.names = tuple(names)
        self._factories = {name: plugins.ocu(name) for name in names}
        for factory in self._factories.values():
            for module in ocu_capabilities(factory).imports:
                importlib.import_module(module)
        self._tasks: list[asyncio.Task[bool]] = []

    @property
    def take_terminal(self) -> bool:
        """Whether one of them draws on the whole terminal."""
        return any(ocu_capabilities(each).takes_terminal for each in self._factories.values())

    @property
    def page(self) -> str:
        """The address of the web page that one of them will serve; "": none does."""
        return next((page for each in self._standing_by() if (page := each.page())), "")

    async def stand_by(self, fleet: str, served_by: Callable[[], ExecutiveAddress | None]) -> None:
        """Let those that can answer while the executive stands by, until cancelled."""
        units = [
            self._serve("standby", each.stand_by(fleet, served_by)) for each in self._standing_by()
        ]
        await asyncio.gather(*units)

    def _standing_by(self) -> list[type[StandbyOcu]]:
        units = self._factories.values()
        return [
            cast("type[StandbyOcu]", each) for each in units if ocu_capabilities(each).stands_by
        ]

    def begin(self, control: MissionControl, left: Callable[[], None]) -> None:
        """Let them serve. `left` is called when the operator of one has left, and when one that
        had the terminal broke."""

        def ended(task: asyncio.Task[bool], *, had_terminal: bool) -> None:
            if not task.cancelled() and (task.result() or had_terminal):
                left()

        for name, factory in self._factories.items():
            had_terminal = ocu_capabilities(factory).takes_terminal
            serving: Awaitable[None] = factory(control).serve()
            if had_terminal or name == PLAIN:  # others have operators of their own
                serving = _present(control, name, serving)
            task = asyncio.create_task(self._serve(name, serving), name=name)
            task.add_done_callback(partial(ended, had_terminal=had_terminal))
            self._tasks.append(task)

    async def left(self) -> None:
        """Wait until all of them have left."""
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def end(self) -> None:
        """Cancel all units, and wait until they have ended."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _serve(self, name: str, serving: Awaitable[None]) -> bool:
        """Return whether the operator has left; False: the unit broke."""
        try:
            await serving
        except Exception:
            log.exception("the operator control unit %s broke; missions go on without it", name)
            return False
        return True


async def _present(control: MissionControl, unit: str, serving: Awaitable[None]) -> None:
    """Announce that the operator of this terminal is present, for as long as a unit serves."""
    client = f"{unit}-{uuid4()}"

    async def announce() -> None:
        while True:
            with suppress(M2pemError):  # of a remote executive that is gone, the unit tells
                await control.announce_presence(client, unit=unit, by=operator_name())
            await asyncio.sleep(PRESENCE_EVERY_S)

    announcing = asyncio.create_task(announce(), name=f"presence at {unit}")
    try:
        await serving
    finally:
        announcing.cancel()
        # A remote executive that is silent would keep the operator from reading who serves now.
        with suppress(M2pemError, TimeoutError):
            async with asyncio.timeout(LEAVES_WITHIN_S):
                await control.end_presence(client)
