"""Opens the journal that a command names, and finds runs in it."""

import os
import shutil
import tempfile
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import AsyncExitStack, ExitStack, asynccontextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from m2pem.cli.options import UnusableError
from m2pem.cli.status import RunStatusView
from m2pem.errors import JournalError
from m2pem.executive.runtime_directory import runtime_directory
from m2pem.journal import (
    Journal,
    MemoryJournal,
    RunInfo,
    default_url,
    file_of,
    is_postgres,
    open_journal,
    postgres_address,
)

if TYPE_CHECKING:
    from m2pem.journal.database_journal import DatabaseJournal
    from m2pem.journal.postgres_info import ExecutiveElsewhere


def url_of(url: str | None) -> str:
    """The journal's URL: the user's own when none is named."""
    return url or default_url()


@asynccontextmanager
async def journal_at(url: str) -> AsyncIterator[Journal]:
    """The journal, open within the block; its file is made where it is missing."""
    journal = open_journal(url)
    try:
        yield journal
    finally:
        await journal.close()


@asynccontextmanager
async def journal_to_read(url: str | None) -> AsyncIterator[Journal]:
    """As `existing_journal`, for a command that writes nothing: a copy of it where nothing can be
    written, as on a full disk or a file system that is mounted read-only.

    What the vehicles were doing must be known then, too.
    """
    from m2pem.journal.database import needs_copy

    path = file_of(url_of(url))
    async with AsyncExitStack() as stack:
        try:
            journal = await stack.enter_async_context(existing_journal(url))
        except JournalError as error:
            if path is None or is_postgres(url_of(url)) or not needs_copy(error.__cause__):
                raise
            journal = await stack.enter_async_context(_copy_of(path.resolve(), error))
        yield journal


@asynccontextmanager
async def _copy_of(path: Path, why: JournalError) -> AsyncIterator[Journal]:
    with ExitStack() as stack:
        try:
            folder = stack.enter_context(tempfile.TemporaryDirectory(dir=runtime_directory()))
            copy = _copied(path, Path(folder))
        except OSError as error:
            raise JournalError(
                f"{why}. {runtime_directory()} cannot take a copy of it: {error.strerror}"
            ) from error
        try:
            async with journal_at(str(copy)) as journal:
                unknown = "" if _has_locks(path) else "; whether a run is driven is not known"
                click.echo(f"m2pem: {why}; a copy of it is read{unknown}", err=True)
                yield journal
        except JournalError as error:
            raise JournalError(str(error).replace(str(copy), str(path))) from error


def _copied(path: Path, folder: Path) -> Path:
    """Copy a journal's files into a folder. The locks stay its own: they say what is driven."""
    copy = folder / path.name
    for what in ("", "-wal", "-mark"):
        beside = path.with_name(path.name + what)
        if beside.exists():
            shutil.copyfile(beside, copy.with_name(copy.name + what))
    if _has_locks(path):
        copy.with_name(f"{copy.name}-lock").symlink_to(f"{path}-lock")
    return copy


def _has_locks(path: Path) -> bool:
    """Whether the locks of a journal can be asked: its file of them must be open for writing."""
    return os.access(f"{path}-lock", os.W_OK)


@asynccontextmanager
async def existing_journal(url: str | None) -> AsyncIterator[Journal]:
    """A journal that is there already, open within the block.

    The user's own may be missing yet; it is then an empty one.

    Raises:
        UnusableError: there is no such file.
    """
    path = file_of(url_of(url))
    if is_postgres(url_of(url)) or path is None or path.exists():
        async with journal_at(url_of(url)) as journal:
            yield journal
    elif url is not None:
        raise UnusableError(f"there is no journal {path}")
    else:
        yield MemoryJournal()


def executives_elsewhere(url: str | None) -> "Sequence[ExecutiveElsewhere]":
    """Return the executives of other hosts on a journal in PostgreSQL, as far as it can be read."""
    if not is_postgres(url_of(url)):
        return ()
    from m2pem.journal.postgres_info import executives_elsewhere

    with suppress(JournalError):  # who asks has an error of its own
        return executives_elsewhere(postgres_address(url_of(url)))
    return ()


async def find_run(journal: Journal, run: str) -> RunInfo:
    """What the journal says of a run.

    Raises:
        UnusableError: it has no such run.
    """
    lines = {line.run: line for line in await journal.runs()}
    if run not in lines:
        for deletion in await journal.deletions():
            if deletion.run == run:
                raise UnusableError(str(deletion))
        there = f"it has {', '.join(lines)}" if lines else "it has none yet"
        raise UnusableError(f"the journal has no run {run!r}; {there}")
    line = lines[run]
    if line.gone and line.loss is not None:
        raise UnusableError(f"{run}: {line.loss}. {line.loss.remedy(run)}")
    return line


async def accept(journal: Journal, run: str) -> None:
    """Note that a person knows what the journal has lost of a run that cannot be resumed.

    Raises:
        UnusableError: a journal in memory loses nothing.
        JournalError: it has lost nothing, or can be resumed, which asks.
    """
    if isinstance(journal, MemoryJournal):
        raise UnusableError(f"the journal has no run {run!r}")
    await cast("DatabaseJournal", journal).accept_loss(run)


async def last_decided_us(journal: Journal, line: RunInfo) -> int:
    """Return the time of a run's last input, in microseconds since the Unix epoch."""
    back = 1
    while True:
        # An entry is found by its first record; how many the last one has is unknown.
        after = max(0, line.last_seq - back)
        times = [entry.at_us async for entry in journal.read(line.run, after)]
        if times or after == 0:
            return max(times, default=line.started_us)
        back *= 10


@dataclass(frozen=True, slots=True)
class Interrupted:
    """A run that was left without an end. `behaviors`: what it was doing, by vehicle or payload."""

    run: str
    mission: str
    behaviors: Mapping[str, str]

    def as_text(self) -> str:
        """For people: what may still move or be held, and the commands to go on."""
        held = ", ".join(f"{name} ({behavior})" for name, behavior in self.behaviors.items())
        what = f"it has {held}, which may go on or be held" if held else "it has no vehicle"
        return (
            f"{self.run} ({self.mission}) was interrupted, and no executive drives it: {what}; "
            f"`m2pem resume {self.run}` goes on with it, and `m2pem resume {self.run} --stop` "
            "stops it"
        )


async def interrupted_runs(url: str | None) -> list[Interrupted]:
    """The interrupted runs of a journal, by what its records say."""
    async with journal_to_read(url) as journal:
        return [
            await interruption(journal, line)
            for line in await journal.runs()
            if line.outcome is None and not line.driven and line.last_seq > 0
        ]


async def interruption(journal: Journal, line: RunInfo) -> Interrupted:
    """What an interrupted run was doing, by what its records say."""
    standing = RunStatusView(line)
    async for entry in journal.read(line.run):
        for record in entry.records:
            standing.take(record, entry.input)
    return Interrupted(line.run, line.header.mission_name, standing.commanded())
