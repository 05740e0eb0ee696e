"""The journal in an SQLite file, for any number of executives on one host."""

import hashlib
import logging
import sqlite3
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager, suppress
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any
from uuid import UUID

from m2pem.errors import JournalError
from m2pem.journal.codec import run_id
from m2pem.journal.database import (
    explained_error,
    is_transient,
    open_for_reading,
    open_for_writing,
)
from m2pem.journal.database_journal import DatabaseJournal
from m2pem.journal.fleet_server import FleetServer, decode, encode, this_process
from m2pem.journal.marks import MarkFile, beside, find_losses, identity_in, of_another_journal
from m2pem.journal.position import RunPosition
from m2pem.journal.run_locks import RunLocks, run_locks
from m2pem.journal.standbys import PLACES, standby_of
from m2pem.journal.storage_checks import OpenFiles, disk_fault, min_free_mb
from m2pem.journal.transaction import mark_of, position_columns, position_from
from m2pem.whole_file import write_whole

log = logging.getLogger("m2pem.journal")

_ROWS = 90
"""To a statement: SQLite before 3.32 takes 999 parameters."""


class SqliteStorage:
    """The file of an open journal, and its locks; see `Storage`."""

    errors: tuple[type[Exception], ...] = (sqlite3.Error, OSError)
    """The files beside the database raise OSError."""
    locking = ""

    def __init__(
        self, path: Path, connection: sqlite3.Connection, locks: RunLocks, mark: Path
    ) -> None:
        self.place = str(path)
        self.connection = connection
        self.owners = locks
        self._path = path
        self._files = OpenFiles([path, beside(path, "wal"), beside(path, "lock"), mark])
        self._data_version = 0
        self._fleets: dict[str, set[str]] = {}

    def begin(self) -> bool:
        """See `Storage.begin`: whether no other process has written since."""
        self.connection.execute("BEGIN IMMEDIATE")
        (version,) = self.connection.execute("PRAGMA data_version").fetchone()
        before, self._data_version = self._data_version, version
        return bool(version == before)

    def exclude_others(self) -> None:
        """See `Storage.exclude_others`: a transaction of SQLite excludes all others."""

    def fence(self, number: int) -> None:
        """See `Storage.fence`: a process that has lost its lock has ended."""

    def driver(self, number: int, position: RunPosition) -> str:
        return f"process {position.pid}" if self.owners.held(number) else ""

    def refuse_lost(self, number: int) -> None:
        """See `Storage.refuse_lost`: the kernel takes no lock from a living process."""

    def give_up(self, number: int) -> bool:
        """See `Storage.give_up`: its lock is noted elsewhere."""
        return False

    def serve_fleet(
        self, fleet: str, resources: Collection[str], digest: str, page: str
    ) -> FleetServer | None:
        """See `Storage.serve_fleet`: by locks of the kernel; files beside them say whose they are.

        No other process takes some of them meanwhile: it does so in a transaction, too.
        """
        for resource in resources:
            lock = _fleet_lock(fleet, resource)
            if not self.owners.mine(lock) and self.owners.held(lock):
                return fleet_server(self._path, self.owners, fleet, (resource,)) or FleetServer()
        for resource in resources:
            lock = _fleet_lock(fleet, resource)
            if not self.owners.mine(lock):
                self.owners.acquire(lock)
                self._fleets.setdefault(fleet, set()).add(resource)
                note = encode(this_process(digest, page))
                # It ends with its process: it need not be durable.
                write_whole(_fleet_note(self._path, lock), note, durable=False)
        return None

    def leave_fleet(self, fleet: str) -> None:
        for resource in self._fleets.pop(fleet, set()):
            lock = _fleet_lock(fleet, resource)
            _fleet_note(self._path, lock).unlink(missing_ok=True)
            self.owners.release(lock)

    def leave_fleets(self) -> None:
        """Serve nothing any more."""
        for fleet in tuple(self._fleets):
            self.leave_fleet(fleet)

    def add_to_schedule(self, fleet: str, plan: str, state: str, revision: int) -> int:
        added = self.connection.execute(
            "INSERT INTO schedule (fleet, plan, state, revision) VALUES (?, ?, ?, ?)",
            (fleet, plan, state, revision),
        )
        return added.lastrowid or 0

    def commit(
        self, entries: Sequence[tuple[Any, ...]], positions: Mapping[int, RunPosition], wrote: bool
    ) -> None:
        self._write("INSERT INTO entries", entries)
        changed = [position_columns(*each) for each in positions.items()]
        self._write("REPLACE INTO standings", changed)
        self.connection.execute("COMMIT")

    def _write(self, into: str, rows: Sequence[tuple[Any, ...]]) -> None:
        # Many rows to a statement: each execution releases the interpreter's lock, and with a busy
        # event loop it takes 5 ms to acquire it again.
        for first in range(0, len(rows), _ROWS):
            some = rows[first : first + _ROWS]
            statement = f"{into} VALUES {_placeholders(len(some), len(some[0]))}"
            self.connection.execute(statement, tuple(chain.from_iterable(some)))

    def rollback(self) -> None:
        if self.connection.in_transaction:
            self.connection.execute("ROLLBACK")

    def check(self) -> None:
        self._files.check()

    def explained(self, error: Exception) -> JournalError:
        if isinstance(error, OSError):
            name = error.filename or self._path
            return JournalError(f"{name}: {disk_fault(error)}")
        assert isinstance(error, sqlite3.Error)
        return explained_error(error, self._path)

    def is_transient(self, error: Exception) -> bool:
        # Files beside the database are read before anything is written; see `MarkFile`.
        return isinstance(error, OSError) or (
            isinstance(error, sqlite3.Error) and is_transient(error)
        )

    def is_worth_a_retry(self, error: Exception) -> bool:
        """See `Storage.is_worth_a_retry`: SQLite itself has waited."""
        return False


class SqliteJournal(DatabaseJournal):
    """WAL and `synchronous=FULL`: an append that returned survives a power cut.

    Beside the file, `FILE-lock` locks the runs that are driven and `FILE-mark` has what was
    acknowledged last.
    """

    # The body is a text in the file; one that a flipped bit has damaged is no UTF-8.
    body_column = "CAST(body AS BLOB)"

    def __init__(
        self,
        path: Path,
        writing: sqlite3.Connection,
        reading: sqlite3.Connection,
        locks: RunLocks,
        marks: MarkFile,
        identity: UUID,
    ) -> None:
        self._locks = locks
        self._writing = writing
        self._closing = reading.close
        self._data_version: int | None = None
        self._revisions: Mapping[str, int] = {}
        self._served = SqliteStorage(path, writing, locks, marks.path)
        super().__init__(path, identity, self._served, reading, marks)

    @classmethod
    def open(cls, path: Path) -> "SqliteJournal":
        """Open a journal, making its file where it is missing; `close` it in the end.

        What was acknowledged and is gone is logged as an error, and each run's `RunInfo.loss`.

        Raises:
            JournalError: there is no such folder, it is not a journal, a newer one, it is not the
                one whose mark file is beside it, ...
        """
        path = path.resolve()
        min_free_mb()  # a wrong setting is reported now, not when a run is to begin
        marked = identity_in(beside(path, "mark"))
        if marked is not None and not path.exists():
            raise of_another_journal(beside(path, "mark"))
        with ExitStack() as undo:
            writing = undo.enter_context(closing(open_for_writing(path, marked)))
            reading = undo.enter_context(closing(open_for_reading(path)))
            identity = _identity_of(writing, path)
            try:
                locks = run_locks(beside(path, "lock"))
                marks = MarkFile(beside(path, "mark"), identity)
            except OSError as error:
                name = error.filename or beside(path, "mark")  # what is written has no name
                raise JournalError(f"{name} can't be opened: {error.strerror}") from error
            undo.callback(marks.close)
            try:
                _compare(writing, marks, path)
            except sqlite3.Error as error:
                raise explained_error(error, path) from error
            except OSError as error:
                raise JournalError(f"{marks.path}: {disk_fault(error)}") from error
            undo.pop_all()
        return cls(path, writing, reading, locks, marks, identity)

    @contextmanager
    def _snapshot(self) -> Iterator[None]:
        self._reading.execute("BEGIN")
        try:
            yield
        finally:
            self._reading.execute("ROLLBACK")

    def _schedule_revisions(self) -> Mapping[str, int]:
        # Read before the rows: what is written meanwhile is seen the next time.
        (version,) = self._reading.execute("PRAGMA data_version").fetchone()
        if version != self._data_version:
            self._revisions = super()._schedule_revisions()
            self._data_version = version
        return self._revisions

    def _driven(self, numbers: Collection[int]) -> Collection[int]:
        return {number for number in numbers if self._locks.held(number)}

    def _fleet_server(self, fleet: str, resources: Collection[str]) -> FleetServer | None:
        return fleet_server(self._path, self._locks, fleet, resources)

    def abandon(self, fleet: str) -> FleetServer | None:
        """See `Journal.abandon`: locks end with the process."""
        return fleet_server(self._path, self._locks, standby_of(fleet), PLACES)

    def _finish(self) -> None:
        self._reader.submit(self._closing)
        self._reader.shutdown()
        # What can't be moved from the log into the file now is moved when it is opened next.
        with suppress(sqlite3.Error):
            self._writing.close()
        self._marks.close()
        with suppress(OSError):
            self._served.leave_fleets()
        self._locks.close()


def fleet_server(
    path: Path, locks: RunLocks, fleet: str, resources: Collection[str]
) -> FleetServer | None:
    """Who serves one of these of a fleet on the journal `path`; None: no living process."""
    for resource in resources:
        lock = _fleet_lock(fleet, resource)
        if locks.held(lock):
            try:
                return decode(_fleet_note(path, lock).read_bytes())
            except OSError:
                return FleetServer()
    return None


def _fleet_note(path: Path, lock: int) -> Path:
    return beside(path, f"fleet-{lock:016x}")


def _fleet_lock(fleet: str, resource: str) -> int:
    """The number of a vehicle or payload among the locks: far above those of runs."""
    name = f"{fleet}\0{resource}".encode()
    return (1 << 62) | int.from_bytes(hashlib.sha256(name).digest()[:7])


def _identity_of(connection: sqlite3.Connection, path: Path) -> UUID:
    try:
        return UUID(connection.execute("SELECT uuid FROM identity").fetchone()[0])
    except sqlite3.Error as error:
        raise explained_error(error, path) from error
    except (TypeError, ValueError, AttributeError) as error:
        raise JournalError(f"{path}: it is damaged: its identity cannot be read") from error


def _compare(connection: sqlite3.Connection, marks: MarkFile, path: Path) -> None:
    """Log what is missing; make the marks of a journal that has none."""
    (marked,) = connection.execute("SELECT marked FROM identity").fetchone()
    if marks.new:
        if marked:
            log.warning(
                "%s is missing: whether %s has lost anything cannot be known any more; look at the "
                "vehicles before you resume a run",
                marks.path,
                path.name,
            )
        _begin_marks(connection, marks)
    for number, loss in find_losses(connection, marks.read()).items():
        log.error("%s: %s: %s", path, run_id(number), loss)
    if not marked:
        connection.execute("UPDATE identity SET marked = 1")


def _begin_marks(connection: sqlite3.Connection, marks: MarkFile) -> None:
    # No other process may write meanwhile: a mark must not go back.
    connection.execute("BEGIN IMMEDIATE")
    try:
        rows = connection.execute("SELECT * FROM standings").fetchall()
        if rows:
            marks.reserve(max(row[0] for row in rows))
            marks.write({row[0]: mark_of(position_from(row)) for row in rows})
    finally:
        connection.execute("ROLLBACK")


@cache
def _placeholders(rows: int, columns: int) -> str:
    return ", ".join([f"({', '.join('?' * columns)})"] * rows)
