"""The runs of the executive: a line of those that go on, a list of all with what is to come."""

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from rich.style import Style
from rich.text import Text

from m2pem.api import RunId, RunStatus, RunSummary, RunView, Schedule
from m2pem_plugin_terminal.dialogs import Choice
from m2pem_plugin_terminal.formatting import shortened

TITLE = "Runs"
OVER_MOST = 500
"""Ended runs that are listed, the newest first."""

NAME_CELLS = 18

_FIRST = {RunStatus.RUNNING: 0, RunStatus.PAUSED: 1, RunStatus.INTERRUPTED: 2}


def run_tabs(views: Iterable[RunView], shown: RunId, asking: Collection[RunId]) -> Text:
    """Return a line with the runs that go on: `?` asks, `!` is stopped by an error, `=` is paused.

    `shown`: the run on the screen. `asking`: the runs with open questions.
    """
    text = Text(" ", "#9aa4af", no_wrap=True)
    for view in views:
        marks = "?" if view.run in asking else ""
        marks += "!" if view.incidents else ""
        marks += "=" if view.status is RunStatus.PAUSED else ""
        own = view.run == shown
        style = "bold #1b2129 on #8ab4d8" if own else "#c8d0d9 on #2a333e"
        click = Style.from_meta({"does": f"look('{view.run}')"})
        start = len(text)
        text.append(f" {view.run} {shortened(view.name, NAME_CELLS)} ", style)
        if marks:
            text.append(f"{marks} ", "bold #1b2129 on #e8c468")
        text.stylize(click, start)
        text.append(" ")
    text.append("[ ] next", "#747c86")
    return text


def run_choices(runs: Sequence[RunSummary], schedule: Schedule | None) -> list[Choice]:
    """Return a line for each run that goes on, each entry of the schedule that may still start
    something, and each run that has ended."""
    newest = sorted(runs, key=lambda each: int(each.run[1:]) if each.run[1:].isdigit() else 0)
    newest.reverse()
    going_on = sorted(
        (each for each in newest if not each.status.ended),
        key=lambda each: _FIRST.get(each.status, 3),
    )
    ended = [each for each in newest if each.status.ended]
    entries = schedule.entries if schedule is not None else ()
    to_come = [
        Choice(
            each.entry, f"{each.entry}  {Path(each.mission).stem}, {each.when_text}", each.status
        )
        for each in entries
        if not each.status.over
    ]
    return [*map(_choice, going_on), *to_come, *map(_choice, ended[:OVER_MOST])]


def _choice(run: RunSummary) -> Choice:
    return Choice(run.run, f"{run.run}  {Path(run.mission).name}", run.status)


def next_run(runs: Sequence[RunId], shown: RunId, step: int) -> RunId | None:
    """Return the run after the one that is shown, or (`step` -1) before it; None: no other."""
    if not runs or list(runs) == [shown]:
        return None
    place = runs.index(shown) if shown in runs else (-1 if step > 0 else 0)
    return runs[(place + step) % len(runs)]
