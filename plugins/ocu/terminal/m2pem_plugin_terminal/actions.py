"""What all keys that ask the executive share: a request that is not waited for, and a question."""

import time
from collections.abc import Awaitable, Callable
from typing import Any

from rich.text import Text

from m2pem.api import MissionControl
from m2pem.api.operator import operator_name
from m2pem.errors import M2pemError
from m2pem_plugin_terminal.dialogs import Confirm
from m2pem_plugin_terminal.display import Display


class Actions(Display):
    """The display, with requests to the executive. `by`: the name that is journaled."""

    def __init__(
        self,
        control: MissionControl,
        *,
        now: Callable[[], float] = time.monotonic,
        by: str | None = None,
    ) -> None:
        super().__init__(control, now=now)
        self.by = operator_name() if by is None else by

    @property
    def in_dialog(self) -> bool:
        """Whether a dialog is open."""
        return len(self.screen_stack) > 1

    def carry_out(self, what: str, call: Awaitable[Any]) -> None:
        """Ask the executive without waiting; show what it refuses."""

        async def send() -> None:
            try:
                await call
            except M2pemError as error:
                self.say(f"{what}: {error}", alarm=True)

        self.run_worker(send(), exit_on_error=False)

    async def confirm(
        self, what: str, title: str, text: Text, call: Callable[[], Awaitable[None]]
    ) -> None:
        """Have the operator confirm a text with a key that has no other use."""

        def confirmed(yes: bool | None) -> None:
            if yes:
                self.carry_out(what, call())

        await self.push_screen(Confirm(title, text), confirmed)
        self.show()
