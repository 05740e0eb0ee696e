"""The log: what happened in the run that is looked at, all of it or the lines with some text."""

from collections.abc import Iterable
from textwrap import wrap

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import Input, RichLog

from m2pem_plugin_terminal.story import Line, Weight

TIME_CELLS = 9

STYLES = {
    Weight.QUIET: "#747c86",
    Weight.PLAIN: "#c8d0d9",
    Weight.GOOD: "#8fb89a",
    Weight.ALARM: "bold #e07a6a",
}


class LogPane(Vertical):
    """Newest line last; the filter is typed below it."""

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
        """The lines, and the filter, hidden until asked for."""
        yield self._shown
        yield self._asked

    def on_mount(self) -> None:
        """Begin without a filter."""
        self.border_title = "Log"

    def show(self, lines: Iterable[Line]) -> None:
        """Show these instead."""
        self._lines = list(lines)
        self._rewrite()

    def add(self, line: Line) -> None:
        """One more."""
        self._lines.append(line)
        if self._passes(line):
            self._shown.write(_styled(line, self._width), scroll_end=self._following)

    def move(self, lines: int) -> None:
        """Look further up or down; at its end, the log follows what happens again."""
        end = self._shown.max_scroll_y
        target = max(0, min(end, round(self._shown.scroll_target_y) + lines))
        self._following = target == end
        self._shown.scroll_to(y=target, animate=False)

    def ask_filter(self) -> None:
        """Let the operator type."""
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
        """The lines follow while it is typed."""
        self._filter = event.value.strip().lower()
        self.border_title = f"Log: {self._filter}" if self._filter else "Log"
        self._rewrite()

    def on_input_submitted(self) -> None:
        """The filter stays; keys are commands again."""
        self._close()

    def _close(self) -> None:
        self._asked.display = False
        self.screen.set_focus(None)

    @property
    def _width(self) -> int:
        # The scroll bar's cell is kept free, so that nothing moves when it comes.
        return self.content_size.width - 1

    def on_resize(self) -> None:
        """Lines break elsewhere now."""
        self._rewrite()

    def _passes(self, line: Line) -> bool:
        return self._filter in f"{line.time} {line.text}".lower()

    def _rewrite(self) -> None:
        self._shown.clear()
        for line in self._lines:
            if self._passes(line):
                self._shown.write(_styled(line, self._width), scroll_end=self._following)


def _styled(line: Line, width: int) -> Text:
    """The time, and the text beside it on as many lines as it takes."""
    parts = wrap(" ".join(line.text.split()), max(20, width - TIME_CELLS)) or [""]
    text = Text(f"{line.time:>{TIME_CELLS - 2}}  ", "#747c86")
    for place, part in enumerate(parts):
        text.append(("\n" + " " * TIME_CELLS if place else "") + part, STYLES[line.weight])
    return text
