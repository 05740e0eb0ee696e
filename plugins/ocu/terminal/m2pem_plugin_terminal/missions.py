"""Choosing a mission to start: the list of files, and what the fleet says of the marked one."""

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual import work
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import VerticalScroll
from textual.widgets import OptionList, Static

from m2pem.errors import M2pemError
from m2pem_plugin_terminal.dialogs import Choice, Choose

if TYPE_CHECKING:
    from m2pem.api.allocation import StartPreview

TITLE = "Start a mission"
NO_MISSIONS = (
    "No mission files were found. They are looked for in the folders of --path and M2PEM_PATH, in "
    "the executive's working folder, and in its folder missions."
)
CHECKED_MOST = 50
"""Missions that are checked before they are marked; each takes the executive some time."""
WAIT = "is being checked ..."
PROBLEM_STYLE = "bold #e07a6a"
WARNING_STYLE = "#e8c468"


class ChooseMission(Choose):
    """The list of mission files; below it, the preview of the one that is marked."""

    BINDINGS: ClassVar[list[BindingType]] = [
        ("shift+up", "scroll(-1)", "Up"),
        ("shift+down", "scroll(1)", "Down"),
    ]

    def __init__(
        self, files: Sequence[str], preview: Callable[[str], Awaitable["StartPreview"]]
    ) -> None:
        super().__init__(TITLE, [mission_choice(file) for file in files])
        self._preview = preview
        self._text_below = Static()
        self._previews: dict[str, Text] = {}
        self._one_at_a_time = asyncio.Lock()

    def compose_below(self) -> ComposeResult:
        """Compose the preview."""
        yield VerticalScroll(self._text_below, id="preview", can_focus=False)

    def action_scroll(self, lines: int) -> None:
        """Scroll the preview."""
        self.query_one(VerticalScroll).scroll_relative(y=lines, animate=False)

    def on_option_list_option_highlighted(self, event: OptionList.OptionHighlighted) -> None:
        """Preview the marked mission."""
        self._preview_of(self.shown[event.option_index])

    def on_mount(self) -> None:
        """Begin to check the missions, one after another."""
        self._check_all()

    @work(exit_on_error=False)
    async def _check_all(self) -> None:
        for choice in self.choices[:CHECKED_MOST]:
            await self._read(choice)

    @work(exclusive=True, group="marked", exit_on_error=False)
    async def _preview_of(self, choice: Choice) -> None:
        if choice.value not in self._previews:
            self._text_below.update(Text(f"{choice.label} {WAIT}", "#9aa4af"))
        self._text_below.update(await self._read(choice))

    async def _read(self, choice: Choice) -> Text:
        """Return the preview of a mission; its line says in short what was found."""
        async with self._one_at_a_time:
            file = choice.value
            if file not in self._previews:
                try:
                    preview = await self._preview(file)
                except M2pemError as error:
                    self._previews[file] = Text(str(error), PROBLEM_STYLE)
                    self.remark(file, "cannot be checked")
                else:
                    self._previews[file] = preview_text(preview)
                    folder = mission_choice(file).remark
                    self.remark(file, f"{folder}  {found_in_short(preview)}")
            return self._previews[file]


def mission_choice(file: str) -> Choice:
    """Return the line of a mission file: its name, and the folder that it is in."""
    path = Path(file)
    return Choice(file, path.name, path.parent.name)


def found_in_short(preview: "StartPreview") -> str:
    """Return what the check says of a mission, in a few words."""
    errors = sum(each.severity == "error" for each in preview.findings)
    warnings = len(preview.findings) - errors
    if errors:
        return f"{errors} error{'s' if errors > 1 else ''}"
    if preview.busy:
        return "busy"
    return f"{warnings} warning{'s' if warnings > 1 else ''}" if warnings else "ready"


def preview_text(preview: "StartPreview") -> Text:
    """Return what a start would begin with, and what speaks against it."""
    file = Path(preview.file).name
    text = Text()
    if preview.process:
        text.append(f"{preview.name or preview.process}\n", "bold #e3e8ee")
    for finding in sorted(preview.findings, key=lambda each: each.severity != "error"):
        where = replace(finding, file=Path(finding.file).name)
        text.append(f"{where}\n", PROBLEM_STYLE if finding.severity == "error" else WARNING_STYLE)
    if not preview.findings:
        text.append(f"{file}: nothing found\n", "#7fc8a9")
    for role in preview.roles:
        text.append(f"{role}\n", "#9aa4af")
    if preview.busy:
        text.append(f"{preview.busy}\n", PROBLEM_STYLE)
    text.rstrip()
    return text
