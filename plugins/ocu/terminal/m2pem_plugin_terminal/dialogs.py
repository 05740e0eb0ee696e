"""Dialogs: a list to choose from, a text to read. STOP stays visible and works over them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, TypeVar

from rich.text import Text
from textual import events
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Vertical, VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Input, OptionList, Static
from textual.widgets.option_list import Option

from m2pem_plugin_terminal.formatting import shortened
from m2pem_plugin_terminal.status_lines import StopBar

T = TypeVar("T")

WIDTH = 60


@dataclass(frozen=True, slots=True)
class Choice:
    """A line of a list: its value, its label, and a remark in grey."""

    value: str
    label: str
    remark: str = ""


class Choose(ModalScreen[str | None]):
    """A list: Enter or a digit chooses a value, Escape returns None.

    Other characters are searched for: only lines with them are shown.
    """

    AUTO_FOCUS = "OptionList"
    BINDINGS: ClassVar[list[BindingType]] = [
        ("escape", "dismiss(None)", "Close"),
        ("backspace", "shorten", "Search for less"),
    ]

    def __init__(self, title: str, choices: Sequence[Choice], text: str = "") -> None:
        super().__init__()
        self._title = title
        self.choices = tuple(choices)
        self.shown = self.choices
        self._search = ""
        self._text = text
        self._box = Vertical(classes="dialog")
        self._list = OptionList(*self._options())

    def compose(self) -> ComposeResult:
        """Compose the list; digits precede the first nine lines."""
        with self._box as box:
            box.border_title = self._title
            box.border_subtitle = "Enter or a digit: choose   letters: search   Esc: close"
            if self._text:
                yield Static(Text(self._text), classes="dialog-text")
            yield self._list
            yield from self.compose_below()
        yield StopBar()

    def compose_below(self) -> ComposeResult:
        """Compose what is below the list: nothing here."""
        yield from ()

    def remark(self, value: str, remark: str) -> None:
        """Change the remark of a line."""
        self.choices = tuple(
            replace(each, remark=remark) if each.value == value else each for each in self.choices
        )
        marked = self._list.highlighted
        self._show()
        if marked is not None and marked < len(self.shown):
            self._list.highlighted = marked

    def action_shorten(self) -> None:
        """Remove the last character that is searched for."""
        self._search_for(self._search[:-1])

    def _search_for(self, text: str) -> None:
        self._search = text
        self._show()
        self._list.highlighted = 0 if self.shown else None

    def _show(self) -> None:
        words = self._search.lower().split()
        self.shown = tuple(
            each
            for each in self.choices
            if all(word in f"{each.label} {each.remark}".lower() for word in words)
        )
        self._box.border_title = f"{self._title}: {self._search}" if self._search else self._title
        self._list.set_options(self._options())

    def _options(self) -> list[Option]:
        return [self._option(place) for place in range(len(self.shown))]

    def _option(self, place: int) -> Option:
        choice = self.shown[place]
        digit = f"{place + 1} " if place < 9 else "  "
        remark = f"  {choice.remark}" if choice.remark else ""
        label = shortened(choice.label, WIDTH - 6 - len(remark))
        return Option(Text.assemble((digit, "bold #e8c468"), label, (remark, "#9aa4af")))

    def on_key(self, event: events.Key) -> None:
        """Choose the line of a digit; search for other characters."""
        if event.key.isdigit() and 1 <= int(event.key) <= min(9, len(self.shown)):
            event.stop()
            self.dismiss(self.shown[int(event.key) - 1].value)
        elif event.is_printable and event.character and not event.character.isdigit():
            event.stop()
            event.prevent_default()
            self._search_for(self._search + event.character)

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Choose the marked line at Enter."""
        self.dismiss(self.shown[event.option_index].value)


class _TextDialog(ModalScreen[T]):
    """A text, which the arrows move when it does not fit. `HINT`: what the keys do."""

    BINDINGS: ClassVar[list[BindingType]] = [
        ("up", "scroll(-1)", "Up"),
        ("down", "scroll(1)", "Down"),
        ("pageup", "scroll(-8)", "Page up"),
        ("pagedown", "scroll(8)", "Page down"),
    ]
    HINT: ClassVar[str]

    def __init__(self, title: str, text: Text) -> None:
        super().__init__()
        self._title = title
        self._text = text

    def compose(self) -> ComposeResult:
        """Compose the text and the line of keys."""
        with Vertical(classes="dialog") as box:
            box.border_title = self._title
            box.border_subtitle = self.HINT
            yield VerticalScroll(
                Static(self._text, classes="dialog-text"), classes="dialog-scroll", can_focus=False
            )
        yield StopBar()

    def action_scroll(self, lines: int) -> None:
        """Scroll the text."""
        self.query_one(VerticalScroll).scroll_relative(y=lines, animate=False)


class Confirm(_TextDialog[bool]):
    """A question that only `y` confirms: digits and Enter answer prompts and choose lines."""

    BINDINGS: ClassVar[list[BindingType]] = [
        ("y", "dismiss(True)", "Yes"),
        ("escape", "dismiss(False)", "No"),
    ]
    HINT = "y: yes   Esc: no"


class ConfirmStart(_TextDialog[str]):
    """Whether a mission starts: now (`y`), when its vehicles are free (`w`), or later (`l`)."""

    BINDINGS: ClassVar[list[BindingType]] = [
        ("y", "dismiss('start')", "Yes"),
        ("w", "dismiss('wait')", "When all is free"),
        ("l", "dismiss('later')", "Later"),
        ("escape", "dismiss(None)", "No"),
    ]
    HINT = "y: yes   w: when all is free   l: later   Esc: no"


class Read(_TextDialog[None]):
    """A text; Escape, Enter or ? closes it."""

    BINDINGS: ClassVar[list[BindingType]] = [("escape,enter,question_mark", "dismiss", "Close")]
    HINT = "Up, Down: move   Esc: close"


class Ask(ModalScreen[str | None]):
    """A line to type; Enter returns it, Escape returns None."""

    AUTO_FOCUS = "Input"
    BINDINGS: ClassVar[list[BindingType]] = [("escape", "dismiss(None)", "Close")]

    def __init__(self, title: str, text: str) -> None:
        super().__init__()
        self._title = title
        self._text = text

    def compose(self) -> ComposeResult:
        """Compose the text and the field."""
        with Vertical(classes="dialog") as box:
            box.border_title = self._title
            box.border_subtitle = "Enter: take it   Esc: close"
            yield Static(Text(self._text), classes="dialog-text")
            yield Input()
        yield StopBar()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Return the line."""
        event.stop()
        self.dismiss(event.value)


KEYS = (
    ("1 ... 9", "answer the question"),
    ("Tab", "the next question, when there are several"),
    ("p", "pause (vehicles hold, timers stop), or resume"),
    ("^X ^X", "STOP the mission and release its vehicles"),
    ("^A ^A", "STOP all missions"),
    ("^C ^C", "as ^X; when nothing runs, quit"),
    ("s", "send a signal"),
    ("m", "start a mission, from the files there are"),
    ("d", "command a vehicle: go to, hold, return, land"),
    ("t", "take a vehicle, give it back, ask for it"),
    ("o", "operators: who is present, who asks for what"),
    ("n", "write a note into the log"),
    ("i", "decide about an error that stops a task (!)"),
    ("r", "runs: going on, scheduled and ended ones"),
    ("] [", "the next run that goes on, the one before"),
    ("g", "the map; g or Esc leaves it"),
    ("arrows", "move the map; else the mission"),
    ("+ - 0", "map: nearer, farther, everything"),
    (". ,", "map: follow the next vehicle, the one before"),
    ("c", "the schedule: start, hold, release, cancel"),
    ("f", "who is in shared space, and which tasks wait"),
    ("v", "requirements: what is violated, open, satisfied"),
    ("a", "alerts: acknowledge, take care, see the run"),
    ("b", "the bell, on or off"),
    ("/", "log: only lines with a text; Esc: all"),
    ("PgUp PgDn", "move through the log"),
    ("Shift-Up", "move through a long question"),
    ("?", "these keys"),
    ("q", "quit"),
)


def help_text() -> Text:
    """Show the marks of the mission, then all keys."""
    text = Text()
    text.append("●", "#7fc8a9")
    text.append(" at work  ", "#9aa4af")
    text.append("?", "bold #e8c468")
    text.append(" asks  ", "#9aa4af")
    text.append("○", "#8ab4d8")
    text.append(" waits  ", "#9aa4af")
    text.append("✓ - ✗", "#9aa4af")
    text.append(" done, given up, failed\n", "#9aa4af")
    for key, what in KEYS:
        text.append(f"{key:<11}", "bold #c8d0d9")
        text.append(f"{what}\n", "#9aa4af")
    text.rstrip()
    return text
