"""The SQLite file of a journal: making it, opening it, and explaining its errors."""

import logging
import os
import shutil
import sqlite3
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from urllib.parse import quote
from uuid import UUID

from m2pem.errors import JournalError, JournalUrlError
from m2pem.journal.marks import beside, of_another_journal
from m2pem.journal.migrations import check, migrate
from m2pem.journal.storage_checks import DISK_FAILED, DISK_FULL, READ_ONLY

_logger = logging.getLogger(__name__)

BUSY_TIMEOUT_S = 5.0
LOG_BYTES = 4_000_000
"""About where SQLite begins to write its log from the start again."""


def open_for_writing(path: Path, marked: UUID | None = None) -> sqlite3.Connection:
    """Open a journal's file, making it and its tables where they are missing.

    `marked`: the identity in the mark file beside it; a journal that has another is left alone.

    The connection may be handed to one other thread. A new file is readable by its owner alone:
    missions and fleets contain positions of vehicles.

    Raises:
        JournalUrlError: it is a folder, or its folder does not exist.
        JournalError: no permission, it is not a journal, ...
    """
    try:
        if path.is_dir():
            raise JournalUrlError(f"{path} is a folder; name a file in it")
        if not path.parent.is_dir():
            raise JournalUrlError(f"{path}: the folder {path.parent} does not exist; make it")
        new = not path.exists()
        connection = _connect(path, "rwc")
        try:
            if new:
                # Never by opening the file: closing it again would drop SQLite's own locks.
                path.chmod(0o600)
            _prepare(connection, path, marked)
        except BaseException:
            connection.close()
            raise
    except sqlite3.Error as error:
        raise explained_error(error, path) from error
    except OSError as error:
        raise JournalError(f"{path} cannot be opened: {error.strerror}") from error
    return connection


def _prepare(connection: sqlite3.Connection, path: Path, marked: UUID | None) -> None:
    # Checked before anything is changed: turning WAL on would already mark a foreign database.
    connection.execute("BEGIN")
    try:
        check(connection, path)
        if marked is not None and not _is(connection, marked):
            raise of_another_journal(beside(path, "mark"))
    finally:
        if connection.in_transaction:  # after a failure SQLite itself has rolled back
            connection.execute("ROLLBACK")
    if _turn_wal_on(connection) != "wal":
        raise JournalError(f"{path}: its file system can't carry a write-ahead log; use another")
    connection.execute("PRAGMA synchronous = FULL")
    migrate(connection, path)
    # The tables and the identity leave the log at once: they must outlast damage to it.
    connection.execute("PRAGMA wal_checkpoint(PASSIVE)")
    disk = os.statvfs(path.parent)
    # On a small or almost full disk the log would take what the files beside it need.
    roomy = disk.f_bavail * disk.f_frsize >= 2 * LOG_BYTES
    if roomy and beside(path, "wal").stat().st_size < LOG_BYTES:
        _lengthen_log(connection)


def _is(connection: sqlite3.Connection, identity: UUID) -> bool:
    has_one = "SELECT 1 FROM sqlite_master WHERE name = 'identity'"
    if connection.execute(has_one).fetchone() is None:
        # Of an earlier m2pem, or empty, which no journal with a mark can be.
        return False
    return bool(connection.execute("SELECT uuid FROM identity").fetchone() == (str(identity),))


def _lengthen_log(connection: sqlite3.Connection) -> None:
    """Give the log its size at once: a flush that makes a file longer takes about twice as long.

    A small cache lets SQLite write to the log before it is rolled back; nothing of it counts.
    """
    (cache_size,) = connection.execute("PRAGMA cache_size").fetchone()
    connection.execute("PRAGMA cache_size = 10")
    try:
        connection.execute("BEGIN IMMEDIATE")
        connection.execute("CREATE TABLE filling (content BLOB)")
        connection.execute("INSERT INTO filling VALUES (zeroblob(?))", (LOG_BYTES + (1 << 16),))
    except sqlite3.Error:
        # Only speed depends on it: a disk that is too full for this may be large enough for a
        # mission.
        _logger.debug("the log of the journal stays short", exc_info=True)
    if connection.in_transaction:
        connection.execute("ROLLBACK")
    connection.execute(f"PRAGMA cache_size = {cache_size}")


def _turn_wal_on(connection: sqlite3.Connection) -> str:
    deadline_s = time.monotonic() + BUSY_TIMEOUT_S
    while True:
        try:
            return str(connection.execute("PRAGMA journal_mode = WAL").fetchone()[0])
        except sqlite3.OperationalError as error:
            # Here, alone, SQLite doesn't wait for others who are opening the same new file.
            if _primary_code(error) != sqlite3.SQLITE_BUSY or time.monotonic() > deadline_s:
                raise
            time.sleep(0.01)


def open_for_reading(path: Path) -> sqlite3.Connection:
    """Open a second connection to a journal's file, which refuses to write."""
    try:
        connection = _connect(path, "rw")
        connection.execute("PRAGMA query_only = ON")
    except sqlite3.Error as error:
        raise explained_error(error, path) from error
    return connection


def open_unchanged(path: Path, stack: ExitStack) -> sqlite3.Connection:
    """Open a journal's file, damaged or not, so that nothing of it is changed: not even its log
    is moved into it.

    SQLite needs to write beside the file. Where it cannot, a copy is opened, which is removed when
    `stack` is closed.

    Raises:
        JournalError: it cannot be opened, or cannot be copied.
    """
    try:
        return _opened_unchanged(path)
    except sqlite3.OperationalError as error:
        if not needs_copy(error):
            raise explained_error(error, path) from error
    try:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="m2pem-")))
        for file in (path, beside(path, "wal")):
            if file.exists():
                shutil.copyfile(file, folder / file.name)
        return _opened_unchanged(folder / path.name)
    except sqlite3.Error as error:
        raise explained_error(error, path) from error
    except OSError as error:
        raise JournalError(
            f"{path} cannot be copied to {tempfile.gettempdir()}: {error.strerror}; TMPDIR names "
            "another folder"
        ) from error


def _opened_unchanged(path: Path) -> sqlite3.Connection:
    connection = _connect(path, "ro")
    try:
        # SQLite refuses all of a truncated file otherwise.
        connection.execute("PRAGMA writable_schema = ON")
        connection.execute("SELECT 1 FROM sqlite_master").fetchone()
    except sqlite3.DatabaseError as error:
        if needs_copy(error):
            connection.close()
            raise
    except BaseException:
        connection.close()
        raise
    return connection


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    return sqlite3.connect(
        f"file:{quote(str(path))}?mode={mode}",
        uri=True,
        timeout=BUSY_TIMEOUT_S,
        isolation_level=None,
        check_same_thread=False,
    )


_EXPLANATIONS = {
    sqlite3.SQLITE_FULL: DISK_FULL,
    sqlite3.SQLITE_READONLY: READ_ONLY,
    sqlite3.SQLITE_NOTADB: "it is not a journal of m2pem, nor any SQLite database",
    sqlite3.SQLITE_CORRUPT: "it is damaged; use a backup, or save what is intact with "
    "`m2pem journal salvage`",
    sqlite3.SQLITE_BUSY: f"another program has kept it locked for {BUSY_TIMEOUT_S:g} s; end that",
    sqlite3.SQLITE_CANTOPEN: "it cannot be opened; check the permissions of it and its folder",
    sqlite3.SQLITE_IOERR: DISK_FAILED,
}

_NO_INDEX = ("SQLITE_IOERR_SHMOPEN", "SQLITE_IOERR_SHMSIZE", "SQLITE_IOERR_SHMMAP")

_NEEDS_COPY = (
    sqlite3.SQLITE_CANTOPEN,
    sqlite3.SQLITE_READONLY,
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_IOERR,
)

_TRANSIENT = (sqlite3.SQLITE_FULL, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_BUSY)


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Raise what fails within the block as a `JournalError` that names the file."""
    try:
        yield
    except sqlite3.Error as error:
        raise explained_error(error, path) from error
    except OSError as error:
        raise JournalError(f"{error.filename or path}: {error.strerror}") from error


def explained_error(error: sqlite3.Error, path: Path) -> JournalError:
    """Return an error that says what is wrong with a journal's file, and the remedy."""
    explanation = _EXPLANATIONS.get(_primary_code(error), "SQLite refused")
    name = getattr(error, "sqlite_errorname", type(error).__name__)
    if name in _NO_INDEX:
        explanation = "the disk is full or failed as SQLite made its index (-shm); make room"
    return JournalError(f"{path}: {explanation} ({error}, {name})")


def needs_copy(error: BaseException | None) -> bool:
    """Whether a journal could not be opened because something beside it cannot be written."""
    return isinstance(error, sqlite3.Error) and _primary_code(error) in _NEEDS_COPY


def is_transient(error: sqlite3.Error) -> bool:
    """Whether surely nothing of the transaction was written, and a later one may succeed.

    After a failed write or fsync neither is known: the kernel may have dropped what it could not
    write, and a second fsync would report success.
    """
    return _primary_code(error) in _TRANSIENT


def _primary_code(error: sqlite3.Error) -> int:
    return int(getattr(error, "sqlite_errorcode", 0)) & 0xFF
