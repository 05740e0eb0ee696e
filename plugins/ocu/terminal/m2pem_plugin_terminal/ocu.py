"""The operator control unit in a terminal."""

import asyncio
import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from m2pem.api import OcuCapabilities
from m2pem.errors import OperatorError, PluginError

if TYPE_CHECKING:
    from m2pem.api.control import MissionControl
    from m2pem_plugin_terminal.app import TerminalApp

MOUSE = "M2PEM_MOUSE"
"""0: the terminal keeps the mouse, to select text without Shift."""

LINGERS_FOR_S = 2.0
"""Seconds for which the end of a mission stays on the screen after `serve` is cancelled."""


class TerminalOcu:
    """Uses the whole terminal while it serves, and restores it afterwards."""

    capabilities = OcuCapabilities(
        takes_terminal=True,
        imports=("m2pem_plugin_terminal.app", "textual.drivers.linux_driver"),
    )
    """The command line prints nothing while this unit serves. Textual takes up to a second to
    import, and imports the driver of its screen when an app is made."""

    def __init__(self, control: "MissionControl") -> None:
        self._control = control

    async def serve(self) -> None:
        """Serve the operator until cancelled, or until the operator quits.

        Raises:
            OperatorError: standard input or output is not a terminal.
            PluginError: the screen failed; Textual has printed the error.
        """
        from m2pem_plugin_terminal.app import TerminalApp  # noqa: PLC0415  # not to list units

        if not (sys.__stdin__ and sys.__stdin__.isatty()):
            raise OperatorError(
                "the terminal unit needs a terminal to read keys from; "
                "use --ocu plain, or m2pem answer"
            )
        app = TerminalApp(self._control)
        loop = asyncio.get_running_loop()
        task_factory = loop.get_task_factory()
        serving = asyncio.create_task(app.run_async(mouse=os.environ.get(MOUSE, "1") != "0"))
        with _log_to(app):
            # Textual makes all tasks of the event loop eager, also those of the executive: undo
            # that.
            loop.call_soon(lambda: loop.set_task_factory(task_factory))
            try:
                await asyncio.shield(serving)
            except asyncio.CancelledError:
                if app.view is not None and app.view.status.ended:
                    await asyncio.wait([serving], timeout=LINGERS_FOR_S)
                app.exit()
                await serving
                raise
        if app.return_code:
            raise PluginError("the screen of the terminal unit failed")


@contextmanager
def _log_to(app: "TerminalApp") -> Iterator[None]:
    """Show warnings on the screen; printed, they would damage it."""
    logger = logging.getLogger("m2pem")
    before = logger.handlers[:]
    logger.handlers[:] = [_ToScreen(app)]
    try:
        yield
    finally:
        logger.handlers[:] = before


class _ToScreen(logging.Handler):
    def __init__(self, app: "TerminalApp") -> None:
        super().__init__(logging.WARNING)
        self._app = app
        self._loop = asyncio.get_running_loop()

    def emit(self, record: logging.LogRecord) -> None:
        text = record.getMessage()

        def say() -> None:
            self._app.call_later(lambda: self._app.say(text, alarm=True))

        # Not from this thread: Textual would wait for the event loop, which may be blocked.
        self._loop.call_soon_threadsafe(say)
