"""STOP: always in sight, on every screen and over every dialog, and done by a second press."""

from collections.abc import Callable

from rich.text import Text
from textual.widgets import Static

ARMED_FOR_S = 4.0

STOP_ALL = "STOP all runs"

HINTS = (
    ("p", "Pause"),
    ("s", "Signals"),
    ("t", "Take"),
    ("r", "Runs"),
    ("/", "Filter"),
    ("?", "Help"),
    ("q", "Quit"),
)


class Trigger:
    """Armed by the first press, pulled by a second within some seconds."""

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._armed_at: float | None = None
        self.what = ""

    @property
    def armed(self) -> bool:
        """Whether the next press does it."""
        return self._armed_at is not None and self._now() - self._armed_at < ARMED_FOR_S

    def press(self, what: str) -> bool:
        """A press of the key for `what`. True: that was the second, do it."""
        if self.armed and self.what == what:
            self._armed_at = None
            return True
        self._armed_at, self.what = self._now(), what
        return False

    def disarm(self) -> None:
        """The operator thought better of it."""
        self._armed_at = None


class StopBar(Static):
    """The last line of every screen: STOP and the keys, or the question whether to stop."""

    def show(self, trigger: Trigger, paused: bool) -> None:
        """Say how things stand."""
        armed = trigger.armed
        self.set_class(armed, "armed")
        if armed:
            stop = "^A" if trigger.what == STOP_ALL else "^X"
            key = stop if trigger.what.startswith("STOP") else "^C"
            self.update(Text(f" {trigger.what}?  Press {key} again.   Esc: no", "bold"))
            return
        text = Text()
        text.append(" ^X STOP ", "bold #ffffff on #b3382c")
        for key, hint in HINTS:
            text.append(f"  {key} ", "bold #c8d0d9")
            text.append("Go on" if hint == "Pause" and paused else hint, "#9aa4af")
        self.update(text)
