"""The line above the keys: something that the operator ought to know, for some seconds."""

from collections.abc import Callable

from rich.text import Text
from textual.widgets import Static

from m2pem_plugin_terminal.words import shortened

SHOWN_FOR_S = 8.0


class NoticeLine(Static):
    """The newest notice; its place stays when there is none, so that nothing jumps."""

    def __init__(self, now: Callable[[], float]) -> None:
        super().__init__(id="notice")
        self._now = now
        self._text = ""
        self._alarm = False
        self._since = 0.0

    def say(self, text: str, *, alarm: bool = False) -> None:
        """Show this now."""
        self._text, self._alarm, self._since = text, alarm, self._now()
        self.show()

    def show(self) -> None:
        """Bring it up to date."""
        if self._now() - self._since >= SHOWN_FOR_S:
            self._text = ""
        style = "bold #e07a6a" if self._alarm else "#e8c468"
        self.update(Text(f" {shortened(self._text, self.size.width - 2)}", style))
