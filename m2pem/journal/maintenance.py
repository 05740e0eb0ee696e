"""Maintenance of a journal's file: its format and sizes, a smaller file, a copy while it is in use.

A copy begins with the journal's mark file as it was before: what the mark says was acknowledged is
in the copy, or was lost before.
"""

import os
import sqlite3
from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from m2pem.errors import JournalError
from m2pem.journal.database import explained, open_for_writing, open_unchanged
from m2pem.journal.marks import beside, identity_in
from m2pem.journal.migrations import MIGRATIONS, check
from m2pem.units import US_PER_S

LATEST_FORMAT = len(MIGRATIONS)
"""The version of the tables that this m2pem writes."""

_FORMAT_OF_ORIGIN = 7

_PAGES = 1000
"""Copied between two calls that show the progress."""


@dataclass(frozen=True, slots=True)
class FileInfo:
    """Format and sizes, in bytes. `free`: of pages in `size` that hold nothing any more. `origin`:
    from where, when and by whom the journal was salvaged; "" if it was not."""

    format: int
    size: int
    free: int
    log: int
    origin: str = ""


def file_info(path: Path) -> FileInfo:
    """Return format and sizes of a journal's file, without changing it.

    Raises:
        JournalError: it cannot be read, or is not a journal.
    """
    with (
        explained(path),
        ExitStack() as stack,
        closing(open_unchanged(path, stack)) as connection,
    ):
        check(connection, path)
        version, free_pages, page_size = (
            connection.execute(f"PRAGMA {name}").fetchone()[0]
            for name in ("user_version", "freelist_count", "page_size")
        )
        log = beside(path, "wal")
        return FileInfo(
            version,
            path.stat().st_size,
            free_pages * page_size,
            log.stat().st_size if log.exists() else 0,
            _origin(connection) if version >= _FORMAT_OF_ORIGIN else "",
        )


def _origin(connection: sqlite3.Connection) -> str:
    row = connection.execute("SELECT path, uuid, salvaged_us, salvaged_by FROM origin").fetchone()
    if row is None:
        return ""
    path, uuid, salvaged_us, by = row
    when = datetime.fromtimestamp(salvaged_us / US_PER_S, UTC)
    return f"salvaged from {path} ({uuid or 'unknown'}) on {when:%Y-%m-%d at %H:%M:%S} UTC by {by}"


def compact(path: Path) -> None:
    """Give the space of deleted runs back to the disk. No executive may write meanwhile.

    Needs as much free space as the journal takes.

    Raises:
        JournalError: the disk is full, another program has it locked, ...
    """
    marked = identity_in(beside(path, "mark"))
    with explained(path), closing(open_for_writing(path, marked)) as connection:
        connection.execute("BEGIN IMMEDIATE")
        connection.execute(
            "DELETE FROM entries WHERE run IN (SELECT run FROM deletions WHERE NOT emptied)"
        )
        connection.execute("UPDATE deletions SET emptied = 1 WHERE NOT emptied")
        connection.execute("COMMIT")
        connection.execute("VACUUM")
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")


def back_up(path: Path, copy: Path, progress: Callable[[int, int], None]) -> None:
    """Copy a journal, also while executives write to it. The copy is as of one moment.

    `progress`: called with the pages that remain, and their total.

    Raises:
        JournalError: there is such a file already, it cannot be written, or the copy is damaged;
            no copy is left then.
    """
    mark, copied_mark = beside(path, "mark"), beside(copy, "mark")
    for file in (copy, copied_mark, beside(copy, "wal")):
        if file.exists():
            raise JournalError(f"{file} exists already; name a new file")
    made: list[Path] = []
    try:
        with explained(copy):
            # Before the tables, so that they are ahead of it, and never behind.
            marks = mark.read_bytes() if mark.exists() else b""
            _make(copy, b"", made)
            _copy_tables(path, copy, progress)
            _make(copied_mark, marks, made)
    except BaseException:
        for file in made:
            file.unlink(missing_ok=True)
        raise


def _copy_tables(path: Path, copy: Path, progress: Callable[[int, int], None]) -> None:
    with (
        ExitStack() as stack,
        closing(open_unchanged(path, stack)) as source,
        closing(sqlite3.connect(copy)) as target,
    ):
        check(source, path)
        # One reading transaction: SQLite would begin again after each commit of an executive.
        source.execute("BEGIN")
        source.execute("SELECT count(*) FROM sqlite_master").fetchone()
        source.backup(
            target, pages=_PAGES, progress=lambda _, remaining, total: progress(remaining, total)
        )
        (found,) = target.execute("PRAGMA integrity_check(1)").fetchone()
        if found != "ok":
            raise JournalError(f"{path} cannot be copied, because it is damaged: {found}")


def _make(file: Path, content: bytes, made: list[Path]) -> None:
    descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    made.append(file)
    with os.fdopen(descriptor, "wb") as written:
        written.write(content)
        written.flush()
        os.fsync(descriptor)
