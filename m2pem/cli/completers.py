"""Words that a shell completes as values of options and arguments.

They must come at once, so missions and fleets are not loaded. Whatever goes wrong, there is nothing
to complete: a shell has no place for messages.
"""

import os
import re
import sqlite3
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, TypeAlias

import click
from click.shell_completion import CompletionItem, split_arg_string

from m2pem.errors import M2pemError

Completer: TypeAlias = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]

_PROCESS = re.compile(rb"""<(?:[\w.-]+:)?process\s(?:[^>]*\s)?id\s*=\s*["']([^"'<>]+)["']""")
_MOST_BYTES = 10_000_000
"""Larger missions are not searched for processes."""


def file_or(*words: str) -> Completer:
    """Return what completes files of the shell, and some words."""

    def complete(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
        matching = [
            CompletionItem(word) for word in words if incomplete and word.startswith(incomplete)
        ]
        return [*matching, CompletionItem(incomplete, type="file")]

    return complete


def runs_of_journal(*, ended: bool) -> Completer:
    """Return what completes the runs of the journal; `ended`: those that have ended, too."""

    def complete(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
        return [
            CompletionItem(f"r{number}", help=f"{mission}, {outcome or 'not ended'}")
            for number, mission, outcome in _runs(ctx.params.get("journal"))
            if f"r{number}".startswith(incomplete) and (ended or outcome is None)
        ]

    return complete


def entries_of_journal(
    ctx: click.Context, _: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Complete the entries of the journal's schedule that may still start something."""
    return [
        CompletionItem(f"s{number}")
        for (number,) in _rows(
            ctx.params.get("journal"),
            "SELECT entry FROM schedule WHERE json_extract(state, '$.status') IS NULL"
            " ORDER BY entry DESC LIMIT 200",
        )
        if f"s{number}".startswith(incomplete)
    ]


def runs_and_entries(
    ctx: click.Context, param: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Complete what a scheduled mission may come after."""
    runs = runs_of_journal(ended=False)(ctx, param, incomplete)
    return [*entries_of_journal(ctx, param, incomplete), *runs]


def _runs(url: str | None) -> Sequence[tuple[int, str, str | None]]:
    return _rows(
        url,
        "SELECT run, mission_name, outcome FROM runs JOIN standings USING (run)"
        " ORDER BY run DESC LIMIT 200",
    )


def _rows(url: str | None, query: str) -> Sequence[tuple[Any, ...]]:
    from m2pem.journal import default_url, file_of, is_postgres
    from m2pem.journal.database import open_for_reading

    try:
        path = file_of(url or default_url())
        if path is None or not path.exists() or is_postgres(str(path)):
            return ()  # no server is asked while someone types
        with closing(open_for_reading(path)) as connection:
            return connection.execute(query).fetchall()
    except (M2pemError, sqlite3.Error):
        return ()


def processes_of_mission(
    _: click.Context, __: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Complete the processes of the mission file that the command line names."""
    # click's context has no arguments here: it stops at the option that has no value yet.
    words = split_arg_string(os.environ.get("COMP_WORDS", ""))
    found = dict.fromkeys(name for word in words[1:] for name in _processes(Path(word)))
    return [CompletionItem(name) for name in found if name.startswith(incomplete)]


def _processes(file: Path) -> list[str]:
    """Return the ids of processes in a file; none if it cannot be read, or is no mission."""
    try:
        if not file.is_file() or file.stat().st_size > _MOST_BYTES:
            return []
        return [each.decode("utf-8", "replace") for each in _PROCESS.findall(file.read_bytes())]
    except OSError:
        return []


def operator_units(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete the last one of several names of operator control units."""
    from m2pem.cli.ocus import NO_UNIT
    from m2pem.plugins import PluginManager

    return _last_of_several(PluginManager().ocus(), NO_UNIT, incomplete)


def faces(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete the last one of several names of faces."""
    from m2pem.cli.ocus import NO_UNIT
    from m2pem.plugins import PluginManager

    return _last_of_several(PluginManager().faces(), NO_UNIT, incomplete)


def _last_of_several(names: Iterable[str], none: str, incomplete: str) -> list[CompletionItem]:
    before, comma, last = incomplete.rpartition(",")
    named = before.split(",")
    known = [*names, *([] if comma else [none])]
    return [
        CompletionItem(f"{before}{comma}{name}")
        for name in sorted(known)
        if name.startswith(last) and name not in named
    ]
