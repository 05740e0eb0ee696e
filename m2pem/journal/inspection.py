"""What is intact in a journal's file, damaged or not. Nothing of it is changed.

SQLite finds each row by its key, so a damaged page hides no more than what is in it. The hash chain
says what is intact; what follows a damaged or missing entry counts as unusable, because nothing
says that it belongs there.
"""

import shutil
import sqlite3
import struct
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from uuid import UUID

import msgspec

from m2pem.errors import JournalError, M2pemError
from m2pem.journal.base import Entry, Loss
from m2pem.journal.codec import decode_body, decode_library, decode_part, run_id
from m2pem.journal.database import explained_error, open_for_writing, open_unchanged
from m2pem.journal.hash_chain import entry_hash, header_hash
from m2pem.journal.marks import Mark, MarkState, beside, find_loss, is_deleted, read_marks
from m2pem.journal.migrations import check
from m2pem.journal.position import RunPosition
from m2pem.journal.transaction import position_from
from m2pem.scheduling.entry import EntryState, Hold, SchedulePlan

_FIRST_FORMAT = 4
"""From which on entries have hashes."""

_HEADER_BYTES = 100
_PAGE_BYTES = 4096
_TABLES = ("runs", "standings", "entries", "identity")
_SHOWN = 20
"""At most so many errors that SQLite finds are listed."""

_UNREADABLE = (sqlite3.Error, JournalError, TypeError, ValueError, OverflowError, struct.error)
"""What reading a damaged row may raise: a flipped bit makes a text of a number."""

Row = tuple[Any, ...]


@dataclass(slots=True)
class RunState:
    """What is intact of a run.

    `header`: its row of the table `runs`; None: missing or damaged. `position`: after its last
    intact entry. `mark`: what was acknowledged; None: there is none. `damage`: what is wrong with
    the journal's own rows, "" if they are intact; `unusable`: entries from the damage on. `loss`:
    what the journal itself says that it has lost of an undamaged run.
    """

    number: int
    header: Row | None
    position: RunPosition
    mark: Mark | None
    entries: int = 0
    damage: str = ""
    unusable: int = 0
    loss: Loss | None = None

    @property
    def run(self) -> str:
        """The run's id."""
        return run_id(self.number)

    @property
    def missing(self) -> int:
        """How many acknowledged records are not intact, at the least."""
        if self.mark is None or self.mark.state is MarkState.ACCEPTED:
            return 0
        return max(0, self.mark.seq - self.position.last_seq)

    @property
    def problem(self) -> str:
        """What is wrong with the run; "": it is whole."""
        if self.header is None and not self.damage:
            return f"the run is missing: {self.missing} records of it were acknowledged"
        last = self.position.last_seq
        kept = f"records 1 to {last} are intact" if last else "no record is intact"
        if self.damage:
            after = f"; {self.unusable} entries from there on are unusable" if self.unusable else ""
            return f"{kept}; {self.damage}{after}"
        if self.missing:
            return f"{kept}; {self.missing} more were acknowledged and are missing"
        if self.loss is not None:
            return f"{kept}; {self.loss}"
        return ""


@dataclass(slots=True)
class Inspection:
    """What is intact in a journal. `problems`: of the file and the mark; of runs see `runs`.

    `schedule`: rows of the table; `lost_schedule`: how many of them cannot be read. `deletions`:
    rows of the table. `holds`: who holds the schedule, by fleet. `alerts`, `drawings`: rows of the
    tables that can be read; of those that cannot, `problems` has how many.
    """

    path: Path
    identity: UUID | None = None
    problems: list[str] = field(default_factory=list)
    runs: list[RunState] = field(default_factory=list)
    deletions: list[Row] = field(default_factory=list)
    schedule: list[Row] = field(default_factory=list)
    holds: dict[str, Hold] = field(default_factory=dict)
    lost_schedule: int = 0
    alerts: list[Row] = field(default_factory=list)
    drawings: list[Row] = field(default_factory=list)

    @property
    def whole(self) -> bool:
        """Whether nothing is damaged or missing."""
        return not (self.problems or self.lost_schedule or any(run.problem for run in self.runs))


@contextmanager
def inspected(path: Path) -> Iterator[tuple[sqlite3.Connection, Inspection]]:
    """Inspect a journal as it is at one moment, also while executives write to it.

    Yields a connection that reads what was inspected.

    Raises:
        JournalError: it cannot be read at all, it is no journal, or one of a newer m2pem.
    """
    found = Inspection(path)
    marks = _marks(path, found)
    with ExitStack() as stack:
        try:
            connection = _open(path, found, stack)
            _read(connection, found, marks)
        except sqlite3.Error as error:
            raise explained_error(error, path) from error
        yield connection, found


def _marks(path: Path, found: Inspection) -> Mapping[int, Mark]:
    # Before the tables, as both grow meanwhile.
    file = beside(path, "mark")
    try:
        of, marks = read_marks(file)
    except JournalError as error:
        found.problems.append(str(error))
        return {}
    found.identity = of
    return marks


def _open(path: Path, found: Inspection, stack: ExitStack) -> sqlite3.Connection:
    connection = stack.enter_context(closing(open_unchanged(path, stack)))
    try:
        _begin(connection, path)
    except (sqlite3.DatabaseError, JournalError) as error:
        # The mark beside it says that it is a journal of m2pem.
        damaged = isinstance(error, sqlite3.DatabaseError) or found.identity is not None
        mended = _with_new_first_page(path, stack) if damaged else None
        if mended is None:
            raise
        found.problems.append(f"the first page of {path.name} is damaged: {error}")
        return mended
    return connection


def _begin(connection: sqlite3.Connection, path: Path) -> None:
    connection.execute("BEGIN")
    check(connection, path)
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if version < _FIRST_FORMAT:
        raise JournalError(
            f"{path} is of an earlier m2pem, without hashes of its entries (format {version}): "
            "`m2pem runs` brings a copy of it up to date"
        )
    for table in _TABLES:
        connection.execute(f"SELECT 1 FROM {table} WHERE 0").fetchone()  # compiled, and not run


def _with_new_first_page(path: Path, stack: ExitStack) -> sqlite3.Connection | None:
    """Open a copy whose first page, with SQLite's header and the list of tables, is from a new
    journal; first its header alone. None: that does not help.

    No wrong content comes of it: every entry must have the hash that it was written with.
    """
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="m2pem-")))
    with closing(open_for_writing(folder / "new.db")) as new:
        new.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    page = bytearray((folder / "new.db").read_bytes()[:_PAGE_BYTES])
    page[28:32] = (path.stat().st_size // _PAGE_BYTES).to_bytes(4, "big")  # pages of the file
    copy = folder / "copy.db"
    for length in (_HEADER_BYTES, _PAGE_BYTES):
        shutil.copyfile(path, copy)
        with copy.open("r+b") as file:
            file.write(page[:length])
        connection = open_unchanged(copy, stack)
        try:
            _begin(connection, copy)
        except (sqlite3.Error, JournalError):
            connection.close()
            continue
        if _holds_something(connection):
            return stack.enter_context(closing(connection))
        connection.close()
    return None


def _holds_something(connection: sqlite3.Connection) -> bool:
    return any(_has(connection, f"SELECT 1 FROM {table}") for table in _TABLES)


def _read(connection: sqlite3.Connection, found: Inspection, marks: Mapping[int, Mark]) -> None:
    found.problems += _errors(connection)
    identity = _identity(connection)
    if identity is None:
        found.problems.append("the identity of the journal cannot be read")
    elif found.identity not in (None, identity):
        found.problems.append("the mark file is that of another journal")
        marks = {}
    found.identity = identity or found.identity
    if not marks and not found.problems and _has(connection, "SELECT 1 FROM runs"):
        found.problems.append(
            f"{found.path.name}-mark is missing: what was acknowledged is not known"
        )
    found.deletions = _rows(connection, "deletions", "run")
    deleted = {row[0] for row in found.deletions}
    numbers = {row[0] for row in _rows(connection, "standings", "run")}
    numbers |= {row[0] for row in _rows(connection, "runs", "run")} | set(marks)
    for number in sorted(each for each in numbers if isinstance(each, int)):
        mark = marks.get(number)
        if number in deleted and (mark is None or is_deleted(connection, number, mark)):
            continue
        run = _run(connection, number, mark)
        if run.header is not None and not run.damage:
            run.loss = find_loss(connection, number, mark)
        if run.header is not None or run.damage or run.missing:
            found.runs.append(run)
    _read_schedule(connection, found)
    found.alerts = _of_fleets(connection, "alerts", found)
    found.drawings = _of_fleets(connection, "drawings", found)


def _errors(connection: sqlite3.Connection) -> list[str]:
    """What SQLite's own check finds."""
    try:
        rows = connection.execute(f"PRAGMA integrity_check({_SHOWN})").fetchall()
    except sqlite3.Error as error:
        return [f"SQLite's check of the file fails: {error}"]
    return [f"SQLite: {text}" for row in rows for text in row[0].splitlines() if text != "ok"]


def _identity(connection: sqlite3.Connection) -> UUID | None:
    with suppress(*_UNREADABLE, AttributeError):
        return UUID(connection.execute("SELECT uuid FROM identity").fetchone()[0])
    return None


def _has(connection: sqlite3.Connection, query: str) -> bool:
    with suppress(sqlite3.Error):
        return connection.execute(f"{query} LIMIT 1").fetchone() is not None
    return False


def _rows(connection: sqlite3.Connection, table: str, *key: str) -> list[Row]:
    """All rows of a table that can be read: from its beginning up to a damage, and from its end.

    `key`: its first columns.
    """
    found: dict[Row, Row] = {}
    for order in ("ASC", "DESC"):
        ordered = ", ".join(f"{column} {order}" for column in key)
        with suppress(sqlite3.Error):  # the table is of a later format, or it is damaged there
            for row in connection.execute(f"SELECT * FROM {table} ORDER BY {ordered}"):
                if row[: len(key)] in found:
                    break
                found[row[: len(key)]] = row
            else:
                break
    return [found[each] for each in sorted(found, key=str)]


def _run(connection: sqlite3.Connection, number: int, mark: Mark | None) -> RunState:
    state = RunState(number, _header(connection, number), RunPosition(0, 0, 0), mark)
    try:
        row = connection.execute("SELECT * FROM standings WHERE run = ?", (number,)).fetchone()
        stored = None if row is None else position_from(row)
    except _UNREADABLE:
        row, stored = (), None
    if state.header is not None:
        _read_entries(connection, state, state.header)
        if not state.damage:
            _compare(state, stored)
    elif row is not None or _has(connection, f"SELECT 1 FROM entries WHERE run = {number}"):
        state.damage = "its mission and fleet are missing or damaged"
        state.unusable = _count(connection, number, 0)
    epochs = [each.epoch for each in (state.position, stored, mark) if each is not None]
    state.position = replace(state.position, epoch=max(epochs))
    return state


def _compare(state: RunState, stored: RunPosition | None) -> None:
    last = state.position
    if stored is None:
        state.damage = "its row in the table `standings` is missing or damaged"
    elif (stored.last_seq, stored.hash) not in ((last.last_seq, last.hash), (last.last_seq, None)):
        state.damage = f"record {last.last_seq + 1} is missing"


def _header(connection: sqlite3.Connection, number: int) -> Row | None:
    with suppress(*_UNREADABLE):
        row = connection.execute("SELECT * FROM runs WHERE run = ?", (number,)).fetchone()
        if row is not None:
            header_hash(row)
            decode_library(row[8])
            return tuple(row)
    return None


def _read_entries(connection: sqlite3.Connection, state: RunState, row: Row) -> None:
    """Read the entries of a run up to the first that is not intact."""
    header = header_hash(row)
    state.position = RunPosition(0, 0, row[7], hash=header)
    chained = False
    rows: sqlite3.Cursor | None = None
    while not state.damage:
        before = state.position
        seq = before.last_seq + 1
        try:
            rows = rows or connection.execute(
                "SELECT seq, epoch, at_us, t_us, CAST(body AS BLOB), hash FROM entries"
                " WHERE run = ? ORDER BY seq",
                (state.number,),
            )
            found = rows.fetchone()
            if found is None:
                return
            *content, hash_ = found
            expected = entry_hash(before.hash or header, *content)
            if content[0] != seq:
                why = "it is missing"
            elif hash_ != expected and (chained or hash_ is not None):
                why = "it does not follow from what was before it (its hash differs)"
            else:
                _, epoch, at_us, t_us, body = content
                entry = Entry(state.run, epoch, seq, at_us, t_us, *decode_body(body))
                # An older entry may be of an earlier epoch; they never fall.
                position = replace(before, epoch=max(before.epoch, entry.epoch))
                state.position = position.after(entry, hash_ or header)
                state.entries += 1
                chained = hash_ is not None
                continue
        except _UNREADABLE as error:
            why = f"it cannot be read ({error})"
        except M2pemError as error:
            why = str(error)
        state.damage = f"record {seq}: {why}"
        state.unusable = _count(connection, state.number, seq)


def _count(connection: sqlite3.Connection, number: int, seq: int) -> int:
    """How many entries from a record on can be found, from the end of the run."""
    count = 0
    with suppress(sqlite3.Error):
        for _ in connection.execute(
            "SELECT seq FROM entries WHERE run = ? AND seq >= ? ORDER BY seq DESC", (number, seq)
        ):
            count += 1
    return count


def _read_schedule(connection: sqlite3.Connection, found: Inspection) -> None:
    for row in _rows(connection, "schedule", "entry"):
        try:
            decode_part(row[2], SchedulePlan)
            decode_part(row[3], EntryState)
        except _UNREADABLE:
            found.lost_schedule += 1
            continue
        found.schedule.append(row)
    for fleet, text in _rows(connection, "schedule_holds", "fleet"):
        try:
            found.holds[fleet] = decode_part(text, Hold)
        except _UNREADABLE:
            found.problems.append(f"who holds the schedule of {fleet} cannot be read")


def _of_fleets(connection: sqlite3.Connection, table: str, found: Inspection) -> list[Row]:
    """Rows of a table of fleet, number and JSON. What they say is read by those who use them."""
    whole, damaged = [], 0
    for row in _rows(connection, table, "fleet", "number"):
        try:
            _, number, text = row
            readable = isinstance(number, int) and isinstance(msgspec.json.decode(text), dict)
        except (*_UNREADABLE, msgspec.MsgspecError):
            readable = False
        if readable:
            whole.append(row)
        else:
            damaged += 1
    if damaged:
        found.problems.append(f"{damaged} rows of the table `{table}` cannot be read")
    return whole


def entry_rows(connection: sqlite3.Connection, run: RunState) -> Iterator[Row]:
    """Yield the rows of the intact entries of a run, for the table `entries`."""
    if run.entries:
        # No further than the last intact one: SQLite would look at the page after it.
        yield from connection.execute(
            "SELECT run, seq, epoch, at_us, t_us, body, hash FROM entries"
            " WHERE run = ? ORDER BY seq LIMIT ?",
            (run.number, run.entries),
        )
