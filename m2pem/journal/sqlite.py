"""The journal in an SQLite file, for any number of executives on one host."""

import asyncio
import logging
import sqlite3
import struct
import time
from collections.abc import AsyncIterator, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, suppress
from functools import partial
from pathlib import Path
from typing import Any, TypeVar
from uuid import UUID

from m2pem.errors import JournalError
from m2pem.journal.base import Deletion, Entry, Loss, RunHeader, RunInfo
from m2pem.journal.codec import (
    decode_body,
    decode_library,
    decode_part,
    encode_body,
    encode_part,
    run_id,
    run_number,
)
from m2pem.journal.database import explained_error, open_for_reading, open_for_writing
from m2pem.journal.hash_chain import entry_hash, header_hash
from m2pem.journal.marks import MarkFile, find_losses, identity_in, of_another_journal
from m2pem.journal.run_locks import RunLocks, run_locks
from m2pem.journal.storage_checks import OpenFiles, min_free_mb
from m2pem.journal.transaction import (
    EntryRow,
    WriteTransaction,
    deletions_in,
    mark_of,
    no_run,
    position_from,
)
from m2pem.journal.writer import GroupWriter
from m2pem.scheduling.entry import (
    EntryChange,
    EntryState,
    Hold,
    ScheduleEntry,
    SchedulePlan,
    entry_id,
)

T = TypeVar("T")

log = logging.getLogger("m2pem.journal")

_BATCH_BYTES = 1 << 20
_BATCH_ENTRIES = 500
_POSITION_COLUMNS = 11
NO_HEADER = RunHeader("", b"", "")
"""The header of a run that the journal has lost whole."""


class SqliteJournal:
    """WAL and `synchronous=FULL`: an append that returned survives a power cut.

    One thread writes, another reads; the event loop never waits for the disk. Beside the
    file, `FILE-lock` locks the runs that are driven and `FILE-mark` has what was acknowledged last.
    """

    def __init__(
        self,
        path: Path,
        writing: sqlite3.Connection,
        reading: sqlite3.Connection,
        locks: RunLocks,
        marks: MarkFile,
        identity: UUID,
    ) -> None:
        self._path = path
        self._identity = identity
        self._locks = locks
        self._marks = marks
        self._writing = writing
        self._reading = reading
        open_files = OpenFiles([path, _beside(path, "wal"), _beside(path, "lock"), marks.path])
        transaction = WriteTransaction(writing, locks, marks, open_files)
        self._writer = GroupWriter(transaction, path, finish=self._finish)
        self._reader = ThreadPoolExecutor(1, thread_name_prefix=f"reading {path}")
        self._closed = False
        self._writer.start()

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
        marked = identity_in(_beside(path, "mark"))
        if marked is not None and not path.exists():
            raise of_another_journal(_beside(path, "mark"))
        with ExitStack() as undo:
            writing = undo.enter_context(closing(open_for_writing(path, marked)))
            reading = undo.enter_context(closing(open_for_reading(path)))
            identity = _identity_of(writing, path)
            try:
                locks = run_locks(_beside(path, "lock"))
                marks = MarkFile(_beside(path, "mark"), identity)
            except OSError as error:
                name = error.filename or _beside(path, "mark")  # what is written has no name
                raise JournalError(f"{name} can't be opened: {error.strerror}") from error
            undo.callback(marks.close)
            try:
                _compare(writing, marks, path)
            except sqlite3.Error as error:
                raise explained_error(error, path) from error
            except OSError as error:
                raise JournalError(f"{marks.path}: {error.strerror}") from error
            undo.pop_all()
        return cls(path, writing, reading, locks, marks, identity)

    @property
    def identity(self) -> UUID:
        """See `Journal.identity`. A copy of the file has it, too: use one of the two."""
        return self._identity

    @property
    def file(self) -> Path | None:
        """See `Journal.file`."""
        return self._path

    @property
    def commits(self) -> int:
        """How many transactions have been written since it was opened."""
        return self._writer.commits

    async def create(self, header: RunHeader, started: EntryChange | None = None) -> str:
        """See `Journal.create`."""
        return await self._holding(
            lambda transaction: transaction.create(header, started), run_number
        )

    async def claim(self, run: str) -> int:
        """See `Journal.claim`."""
        number = run_number(run)
        return await self._holding(lambda transaction: transaction.claim(number), lambda _: number)

    async def _holding(
        self, work: Callable[[WriteTransaction], T], number_of: Callable[[T], int]
    ) -> T:
        """Carry out what takes a run's lock; if the caller is cancelled meanwhile, release it."""
        self._check_open()
        taking = self._writer.submit(work)

        def release(taken: asyncio.Future[T]) -> None:
            if taken.exception() is None:
                self._release(number_of(taken.result()))

        try:
            return await asyncio.shield(taking)
        except asyncio.CancelledError:
            taking.add_done_callback(release)
            raise

    async def release(self, run: str) -> None:
        """See `Journal.release`; what was submitted before is written first."""
        self._check_open()
        await asyncio.wait([self._release(run_number(run))])

    def _release(self, number: int) -> asyncio.Future[None]:
        forgotten = self._writer.submit(lambda transaction: transaction.forget(number))

        def unlock(forgotten: asyncio.Future[None]) -> None:
            # Looked at so that asyncio doesn't report it: a failed journal lets go all the same.
            forgotten.exception()
            self._locks.release(number)

        forgotten.add_done_callback(unlock)
        return forgotten

    async def append(self, entries: Sequence[Entry]) -> None:
        """See `Journal.append`. A cancelled call may or may not be written, but never in part."""
        self._check_open()
        if entries:
            rows = [EntryRow(run_number(e.run), e, encode_body(e)) for e in entries]
            await self._writer.submit(partial(WriteTransaction.append, rows=rows))

    async def check(self) -> None:
        """See `Journal.check`; it waits for its turn, as what is written does."""
        self._check_open()
        await self._writer.submit(WriteTransaction.check)

    async def read(self, run: str, after_seq: int = 0) -> AsyncIterator[Entry]:
        """See `Journal.read`; entries that are appended meanwhile are included."""
        number = run_number(run)
        before: bytes | None = None
        first = True
        while True:
            batch, before = await self._read(
                partial(self._batch, number, after_seq, before, first=first)
            )
            for entry in batch:
                yield entry
            if not batch:
                return
            after_seq, first = batch[-1].seq, False

    def _batch(
        self, number: int, after_seq: int, before: bytes | None, *, first: bool
    ) -> tuple[list[Entry], bytes | None]:
        """`before`: the hash of the entry before; None: no entry before has one."""
        self._reading.execute("BEGIN")
        try:
            if first:
                before = self._hash_up_to(number, after_seq)
            entries, before = self._next(number, after_seq, before)
            if not entries:
                self._check_end(number, before)
        finally:
            self._reading.execute("ROLLBACK")
        return entries, before

    def _next(
        self, number: int, after_seq: int, before: bytes | None
    ) -> tuple[list[Entry], bytes | None]:
        entries: list[Entry] = []
        size = 0
        rows = self._reading.execute(
            "SELECT seq, epoch, at_us, t_us, CAST(body AS BLOB), hash FROM entries"
            " WHERE run = ? AND seq > ? ORDER BY seq LIMIT ?",
            (number, after_seq, _BATCH_ENTRIES),
        )
        with closing(rows):
            for seq, epoch, at_us, t_us, body, hash_ in rows:
                if hash_ is not None:
                    expected = entry_hash(
                        before or self._header_hash(number), seq, epoch, at_us, t_us, body
                    )
                if hash_ != (None if before is None and hash_ is None else expected):
                    raise self._damaged(
                        number, seq, "it does not follow from what was before it (its hash differs)"
                    )
                before = hash_
                try:
                    content = decode_body(body)
                except JournalError as error:
                    raise self._damaged(number, seq, str(error)) from error
                entries.append(Entry(run_id(number), epoch, seq, at_us, t_us, *content))
                size += len(body)
                if size > _BATCH_BYTES:
                    break
        return entries, before

    def _hash_up_to(self, number: int, seq: int) -> bytes | None:
        row = self._reading.execute(
            "SELECT hash FROM entries WHERE run = ? AND seq <= ? ORDER BY seq DESC LIMIT 1",
            (number, seq),
        ).fetchone()
        return None if row is None else row[0]

    def _header_hash(self, number: int) -> bytes:
        row = self._reading.execute("SELECT * FROM runs WHERE run = ?", (number,)).fetchone()
        if row is None:
            raise no_run(self._reading, number)
        return header_hash(row)

    def _check_end(self, number: int, before: bytes | None) -> None:
        query = "SELECT * FROM standings JOIN runs USING (run) WHERE run = ?"
        row = self._reading.execute(query, (number,)).fetchone()
        if row is None:
            raise no_run(self._reading, number)
        position = position_from(row[:_POSITION_COLUMNS])
        if position.hash is not None and position.hash != (before or self._header_hash(number)):
            raise self._damaged(
                number, position.last_seq, "it, or what was before it, is missing or was changed"
            )

    def _damaged(self, number: int, seq: int, why: str) -> JournalError:
        return JournalError(f"{self._path}: {run_id(number)}, record {seq}: {why}")

    async def runs(self) -> Sequence[RunInfo]:
        """See `Journal.runs`."""
        return await self._read(self._infos)

    def _infos(self) -> list[RunInfo]:
        marks = self._marks.read()
        self._reading.execute("BEGIN")
        try:
            lost = find_losses(self._reading, marks)
            rows = self._reading.execute(
                "SELECT * FROM standings JOIN runs USING (run) ORDER BY run"
            ).fetchall()
        finally:
            self._reading.execute("ROLLBACK")
        infos = {row[0]: self._info(row, lost.pop(row[0], None)) for row in rows}
        for number, loss in lost.items():
            mark = marks[number]
            infos[number] = RunInfo(run_id(number), NO_HEADER, mark.epoch, 0, 0, loss=loss)
        return [infos[number] for number in sorted(infos)]

    def _info(self, row: Sequence[Any], loss: Loss | None) -> RunInfo:
        mission_name, mission, process, fleet, simulated, speed, created_us, library = row[
            _POSITION_COLUMNS:
        ]
        header = RunHeader(
            mission_name=mission_name,
            mission=mission,
            process=process,
            fleet=fleet,
            simulated=bool(simulated),
            speed=speed,
            created_us=created_us,
            library=decode_library(library),
        )
        number = row[0]
        position = position_from(row[:_POSITION_COLUMNS])
        return position.info(run_id(number), header, self._locks.held(number), loss)

    async def accept_loss(self, run: str) -> None:
        """Note that an operator accepts the loss of a run that cannot be resumed: new runs may
        begin.

        Raises:
            JournalError: the run has lost nothing, or can be resumed, which asks the operator.
        """
        self._check_open()
        await self._writer.submit(partial(WriteTransaction.accept_loss, number=run_number(run)))

    async def delete(self, runs: Sequence[str], *, by: str, unended: bool = False) -> None:
        """See `Journal.delete`. The file keeps its size: `compact` makes it smaller."""
        self._check_open()
        numbers = [run_number(run) for run in dict.fromkeys(runs)]
        now_us = time.time_ns() // 1000
        await self._writer.submit(
            lambda transaction: transaction.delete(numbers, by, now_us, unended=unended)
        )
        # Also what an earlier deletion has left, if it was ended by a crash.
        while await self._writer.submit(WriteTransaction.empty):
            pass

    async def deletions(self) -> Sequence[Deletion]:
        """See `Journal.deletions`."""
        return await self._read(lambda: deletions_in(self._reading))

    # --- the schedule ---------------------------------------------------------------------------

    async def schedule(self, plan: SchedulePlan, state: EntryState) -> ScheduleEntry:
        """See `Journal.schedule`."""
        self._check_open()
        text = encode_part(plan)
        return await self._writer.submit(
            lambda transaction: transaction.schedule(plan, text, state)
        )

    async def change_entry(self, change: EntryChange, *, deletes: str = "") -> None:
        """See `Journal.change_entry`."""
        self._check_open()
        now_us = time.time_ns() // 1000
        await self._writer.submit(
            lambda transaction: transaction.change_entry(change, deletes, now_us)
        )

    async def entries(self) -> Sequence[ScheduleEntry]:
        """See `Journal.entries`."""
        return await self._read(self._entries)

    def _entries(self) -> list[ScheduleEntry]:
        rows = self._reading.execute("SELECT entry, plan, state FROM schedule ORDER BY entry")
        return [
            ScheduleEntry(
                entry_id(number), decode_part(plan, SchedulePlan), decode_part(state, EntryState)
            )
            for number, plan, state in rows
        ]

    async def remove_entries(self, entries: Sequence[str]) -> None:
        """See `Journal.remove_entries`."""
        self._check_open()
        await self._writer.submit(lambda transaction: transaction.remove_entries(entries))

    async def hold_schedule(self, fleet: str, hold: Hold | None) -> None:
        """See `Journal.hold_schedule`."""
        self._check_open()
        await self._writer.submit(lambda transaction: transaction.hold_schedule(fleet, hold))

    async def schedule_hold(self, fleet: str) -> Hold | None:
        """See `Journal.schedule_hold`."""
        return await self._read(lambda: self._schedule_hold(fleet))

    def _schedule_hold(self, fleet: str) -> Hold | None:
        row = self._reading.execute(
            "SELECT hold FROM schedule_holds WHERE fleet = ?", (fleet,)
        ).fetchone()
        return None if row is None else decode_part(row[0], Hold)

    async def _read(self, work: Callable[[], T]) -> T:
        self._check_open()
        try:
            return await asyncio.get_running_loop().run_in_executor(self._reader, work)
        except sqlite3.Error as error:
            raise explained_error(error, self._path) from error
        except (TypeError, ValueError, struct.error) as error:
            # A flipped bit may make a text of a number.
            raise JournalError(f"{self._path}: it is damaged: {error}") from error

    def _check_open(self) -> None:
        if self._closed:
            raise JournalError(f"{self._path}: the journal has been closed")

    async def close(self) -> None:
        """See `Journal.close`; closing it again does nothing."""
        if self._closed:
            return
        self._closed = True
        stopped = self._writer.stop()
        # Looked at so that asyncio doesn't report it: a journal that has failed has said so.
        stopped.add_done_callback(asyncio.Future.exception)
        await asyncio.wait([stopped])

    def _finish(self) -> None:
        self._reader.submit(self._reading.close)
        self._reader.shutdown()
        # What can't be moved from the log into the file now is moved when it is opened next.
        with suppress(sqlite3.Error):
            self._writing.close()
        self._marks.close()
        self._locks.close()


def _beside(path: Path, what: str) -> Path:
    return path.with_name(f"{path.name}-{what}")


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
