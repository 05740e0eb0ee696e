"""A dialog with a field for each parameter."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Vertical, VerticalScroll
from textual.screen import ModalScreen
from textual.suggester import SuggestFromList
from textual.widgets import Input, Static

from m2pem_plugin_terminal.status_lines import StopBar


@dataclass(frozen=True, slots=True)
class Field:
    """`hint`: what is typed. `suggestions`: words that are completed."""

    name: str
    hint: str = ""
    required: bool = False
    suggestions: tuple[str, ...] = ()


class Form(ModalScreen[dict[str, str] | None]):
    """Enter returns the texts by field, once all that must be given are; Escape returns None."""

    AUTO_FOCUS = "Input"
    BINDINGS: ClassVar[list[BindingType]] = [
        ("escape", "dismiss(None)", "Close"),
        ("down", "app.focus_next", "Next"),
        ("up", "app.focus_previous", "Previous"),
    ]

    def __init__(
        self, title: str, text: str, fields: Sequence[Field], values: Mapping[str, str]
    ) -> None:
        super().__init__()
        self._title = title
        self._text = text
        self._fields = tuple(fields)
        self._inputs = [
            Input(
                values.get(each.name, ""),
                placeholder=each.hint,
                compact=True,
                suggester=SuggestFromList(each.suggestions, case_sensitive=False)
                if each.suggestions
                else None,
            )
            for each in fields
        ]

    def compose(self) -> ComposeResult:
        """Compose the fields; those that must be given are marked."""
        with Vertical(classes="dialog") as box:
            box.border_title = self._title
            box.border_subtitle = "Tab: next   Enter: go on   Esc: close"
            yield Static(Text(self._text, "#9aa4af"), classes="dialog-text")
            with VerticalScroll(classes="dialog-scroll", can_focus=False):
                for field, typed in zip(self._fields, self._inputs, strict=True):
                    mark = (" *", "bold #e8c468") if field.required else ("", "")
                    label = Text.assemble((field.name, "#c8d0d9"), mark)
                    yield Static(label, classes="form-label")
                    yield typed
        yield StopBar()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Return the texts; go to a field that is missing instead."""
        event.stop()
        for field, typed in zip(self._fields, self._inputs, strict=True):
            if field.required and not typed.value.strip():
                typed.focus()
                return
        self.dismiss(
            {
                field.name: typed.value
                for field, typed in zip(self._fields, self._inputs, strict=True)
            }
        )
