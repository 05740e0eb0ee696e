"""The log pane: the events of the shown run, or only the lines with a text."""

from collections.abc import Iterable
from dataclasses import dataclass
from textwrap import wrap

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import Input, RichLog

from m2pem.api import Importance, RunView, StampedRecord, describe
from m2pem.api import records as r
from m2pem_plugin_terminal.formatting import clock_time

LOGGED = frozenset(
    (
        r.RunStarted,
        r.RunClaimed,
        r.RunPaused,
        r.RunResumed,
        r.RunEnded,
        r.OperatorTookControl,
        r.OperatorGaveControlBack,
        r.OperatorNote,
        r.GeometryReceived,
        r.AllocationDelayed,
        r.ResourcesAllocated,
        r.BehaviorRequested,
        r.BehaviorUnsettled,
        r.BehaviorEnded,
        r.WorkReassigned,
        r.ResourceReturned,
        r.ResourceKept,
        r.KeepingEnded,
        r.PromptOpened,
        r.PromptAnswered,
        r.PromptWithdrawn,
        r.ServiceEnded,
        r.DataWritten,
        r.SignalThrown,
        r.MessageThrown,
        r.EscalationThrown,
        r.ErrorThrown,
        r.IncidentOpened,
        r.IncidentUpdated,
        r.IncidentResolved,
        r.IncidentClosed,
        r.RequirementDecided,
        r.RequirementLeftOpen,
    )
)
"""Records that the log shows; the mission pane shows tokens."""

TIME_CELLS = 9

STYLES = {
    Importance.DETAIL: "#747c86",
    Importance.NORMAL: "#c8d0d9",
    Importance.GOOD: "#8fb89a",
    Importance.ATTENTION: "#c8d0d9",
    Importance.WARNING: "bold #e07a6a",
    Importance.ERROR: "bold #e07a6a",
}


@dataclass(frozen=True, slots=True)
class Line:
    """A line of the log. `time`: mission time."""

    time: str
    text: str
    importance: Importance = Importance.NORMAL


def line_of(view: RunView, stamped: StampedRecord) -> Line | None:
    """Return the line of a record; None for one that is not logged."""
    record = stamped.record
    if type(record) not in LOGGED or (isinstance(record, r.ServiceEnded) and not record.code):
        return None
    description = describe(stamped, view)
    return Line(clock_time(stamped.t_s), description.text, description.importance)


class LogPane(Vertical):
    """Shows the newest line last, and the field of the filter below."""

    def __init__(self) -> None:
        super().__init__(id="log")
        self._filter = ""
        self._lines: list[Line] = []
        self._following = True
        self._shown = RichLog(wrap=True, min_width=0, max_lines=2000, markup=False, highlight=False)
        self._shown.can_focus = False
        self._asked = Input(placeholder="only lines with ...", id="filter", compact=True)
        self._asked.display = False

    def compose(self) -> ComposeResult:
        """Compose the lines, and the hidden field of the filter."""
        yield self._shown
        yield self._asked

    def on_mount(self) -> None:
        """Show the title."""
        self.border_title = "Log"

    def show(self, lines: Iterable[Line]) -> None:
        """Replace the lines."""
        self._lines = list(lines)
        self._rewrite()

    def add(self, line: Line) -> None:
        """Add a line."""
        self._lines.append(line)
        if self._passes(line):
            self._shown.write(_styled(line, self._width), scroll_end=self._following)

    def move(self, lines: int) -> None:
        """Scroll; at the end, follow new lines again."""
        end = self._shown.max_scroll_y
        target = max(0, min(end, round(self._shown.scroll_target_y) + lines))
        self._following = target == end
        self._shown.scroll_to(y=target, animate=False)

    def ask_filter(self) -> None:
        """Open the field for the filter."""
        self._asked.display = True
        self._asked.focus()

    def clear_filter(self) -> None:
        """Show all lines again."""
        self._asked.value = ""
        self._close()

    @property
    def filtering(self) -> bool:
        """Whether lines are left out, or the filter is being typed."""
        return bool(self._filter) or self._asked.has_focus

    def on_input_changed(self, event: Input.Changed) -> None:
        """Filter the lines while the text is typed."""
        self._filter = event.value.strip().lower()
        self.border_title = f"Log: {self._filter}" if self._filter else "Log"
        self._rewrite()

    def on_input_submitted(self) -> None:
        """Close the field; the filter stays, and keys are commands again."""
        self._close()

    def _close(self) -> None:
        self._asked.display = False
        self.screen.set_focus(None)

    @property
    def _width(self) -> int:
        # A free cell for the scroll bar, so that lines do not move when it appears.
        return self.content_size.width - 1

    def on_resize(self) -> None:
        """Wrap the lines for the new width."""
        self._rewrite()

    def _passes(self, line: Line) -> bool:
        return self._filter in f"{line.time} {line.text}".lower()

    def _rewrite(self) -> None:
        self._shown.clear()
        for line in self._lines:
            if self._passes(line):
                self._shown.write(_styled(line, self._width), scroll_end=self._following)


def _styled(line: Line, width: int) -> Text:
    """Return the time, and beside it the text on as many lines as needed."""
    parts = wrap(" ".join(line.text.split()), max(20, width - TIME_CELLS)) or [""]
    text = Text(f"{line.time:>{TIME_CELLS - 2}}  ", "#747c86")
    for place, part in enumerate(parts):
        text.append(("\n" + " " * TIME_CELLS if place else "") + part, STYLES[line.importance])
    return text
