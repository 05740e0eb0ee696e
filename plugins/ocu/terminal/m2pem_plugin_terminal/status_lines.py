"""The lines around the panes: the header, the notice line and the STOP bar.

STOP is on every screen and over every dialog; a second press confirms it.
"""

from collections.abc import Callable, Sequence

from rich.style import Style
from rich.text import Text
from textual.widgets import Static

from m2pem.api import RunStatus, RunView
from m2pem_plugin_terminal.formatting import clock_time, shortened

STATUS_STYLES = {
    RunStatus.RUNNING: "bold #1b2129 on #7fc8a9",
    RunStatus.PAUSED: "bold #1b2129 on #e8c468",
    RunStatus.COMPLETED: "bold #1b2129 on #8ab4d8",
    RunStatus.TERMINATED: "bold #1b2129 on #8ab4d8",
    RunStatus.FAILED: "bold #ffffff on #b3382c",
    RunStatus.STOPPED: "bold #ffffff on #b3382c",
}
BAR_CELLS = 8

SHOWN_FOR_S = 8.0

ARMED_FOR_S = 4.0

STOP_ALL = "STOP all runs"

HINTS = (
    ("p", "Pause", "pause"),
    ("s", "Signals", "signals"),
    ("t", "Take", "take"),
    ("m", "Start", "missions"),
    ("r", "Runs", "runs"),
    ("g", "Map", "map"),
    ("?", "Help", "help"),
    ("q", "Quit", "leave"),
)
"""Keys, what they do, and the action that a click on them does. STOP has none: it is pressed
twice."""


def header(
    view: RunView | None, others: int, time_s: float, width: int, standbys: Sequence[str] = ()
) -> Text:
    """Return one line of `width` cells: status, mission, who stands by, progress, time.

    `others`: runs beside this one that have not ended. `standbys`: hosts of executives that stand
    by.
    """
    right = Text(f"standby: {', '.join(standbys)}  " if standbys else "", "#7fc8a9")
    if view is None:
        left = Text(" m2pem: no mission is running", "#9aa4af")
        return Text.assemble(left, " " * max(1, width - left.cell_len - right.cell_len), right)
    done, total = view.progress()
    if total:
        filled = round(done / total * BAR_CELLS)
        right.append("━" * filled, "#7fc8a9")
        right.append("━" * (BAR_CELLS - filled), "#4b525b")
        right.append(f" {done}/{total} tasks  ", "#9aa4af")
    right.append(f"{clock_time(time_s)} ", "bold #e3e8ee")
    left = Text.assemble(
        (f" {view.status.value.upper()} ", STATUS_STYLES.get(view.status, "")), "  "
    )
    violated = sum(each.verdict == "violated" for each in view.requirements.values())
    wrong = f"  {violated} violated (v)" if violated else ""
    more = f"  +{others} more (r)" if others else ""
    room = width - left.cell_len - right.cell_len - len(more) - len(wrong) - len(view.run) - 3
    if view.status is RunStatus.PAUSED:
        room -= len(view.paused_by) + 5
    left.append(shortened(view.name, room), "bold #e3e8ee")
    left.append(f"  {view.run}", "#9aa4af")
    if view.status is RunStatus.PAUSED and view.paused_by:
        left.append(f"  by {view.paused_by}", "#9aa4af")
    left.append(wrong, "bold #e07a6a")
    left.append(more, "#e8c468")
    gap = max(1, width - left.cell_len - right.cell_len)
    return Text.assemble(left, " " * gap, right)


class NoticeLine(Static):
    """Shows the newest notice; without one, what `standing` returns. An empty line stays, so that
    the panes do not move."""

    def __init__(self, now: Callable[[], float], standing: Callable[[], str]) -> None:
        super().__init__(id="notice")
        self._now = now
        self._standing = standing
        self._text = ""
        self._alarm = False
        self._since = 0.0

    def say(self, text: str, *, alarm: bool = False) -> None:
        """Show a text for some seconds."""
        self._text, self._alarm, self._since = text, alarm, self._now()
        self.show()

    def show(self) -> None:
        """Clear a text that has expired."""
        if self._now() - self._since >= SHOWN_FOR_S:
            self._text = ""
        text = self._text or self._standing()
        style = "bold #e07a6a" if self._alarm or not self._text else "#e8c468"
        self.update(Text(f" {shortened(text, self.size.width - 2)}", style))


class DoublePress:
    """Confirms a key by a second press within some seconds."""

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._armed_at: float | None = None
        self.what = ""

    @property
    def armed(self) -> bool:
        """Whether the next press confirms."""
        return self._armed_at is not None and self._now() - self._armed_at < ARMED_FOR_S

    def press(self, what: str) -> bool:
        """Process a press of the key for `what`; return whether it was the second one."""
        if self.armed and self.what == what:
            self._armed_at = None
            return True
        self._armed_at, self.what = self._now(), what
        return False

    def disarm(self) -> None:
        """Forget the first press."""
        self._armed_at = None


class StopBar(Static):
    """The last line of every screen: STOP and the keys, or the question whether to stop."""

    def show(self, trigger: DoublePress, paused: bool) -> None:
        """Show the keys, or what a second press does."""
        armed = trigger.armed
        self.set_class(armed, "armed")
        if armed:
            stop = "^A" if trigger.what == STOP_ALL else "^X"
            key = stop if trigger.what.startswith("STOP") else "^C"
            self.update(Text(f" {trigger.what}?  Press {key} again.   Esc: no", "bold"))
            return
        text = Text()
        text.append(" ^X STOP ", "bold #ffffff on #b3382c")
        for key, hint, action in HINTS:
            text.append("  ")
            start = len(text)
            text.append(f"{key} ", "bold #c8d0d9")
            text.append("Go on" if hint == "Pause" and paused else hint, "#9aa4af")
            text.stylize(Style.from_meta({"does": action}), start)
        self.update(text)
