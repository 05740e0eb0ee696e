"""The journal in an SQLite file: for one host, any number of executives."""

import asyncio
import sqlite3
from collections.abc import AsyncIterator, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, suppress
from functools import partial
from pathlib import Path
from typing import Any, TypeVar
from uuid import UUID

from m2pem.errors import JournalError
from m2pem.journal.base import Entry, RunHeader, RunLine
from m2pem.journal.codec import (
    decode_body,
    decode_library,
    encode_body,
    run_id,
    run_number,
    unknown_run,
)
from m2pem.journal.database import in_plain_words, open_for_reading, open_for_writing
from m2pem.journal.lease import RunLocks, run_locks
from m2pem.journal.ledger import Ledger, Row, standing_of
from m2pem.journal.writer import GroupWriter

T = TypeVar("T")

_BATCH_BYTES = 1 << 20
_BATCH_ENTRIES = 500


class SqliteJournal:
    """WAL and `synchronous=FULL`: an append that returned survives a power cut.

    One thread writes, another reads; the event loop never waits for the disk. `FILE-lock` beside
    the file says which runs are driven.
    """

    def __init__(
        self,
        path: Path,
        writing: sqlite3.Connection,
        reading: sqlite3.Connection,
        locks: RunLocks,
    ) -> None:
        self._path = path
        self._identity = UUID(writing.execute("SELECT uuid FROM identity").fetchone()[0])
        self._locks = locks
        self._writing = writing
        self._reading = reading
        self._writer = GroupWriter(Ledger(writing, locks), path, finish=self._finish)
        self._reader = ThreadPoolExecutor(1, thread_name_prefix=f"reading {path}")
        self._closed = False
        self._writer.start()

    @classmethod
    def open(cls, path: Path) -> "SqliteJournal":
        """Open a journal, making its file where it is missing; `close` it in the end.

        Raises:
            JournalError: there is no such folder, it is not a journal, a newer one, ...
        """
        path = path.resolve()
        with ExitStack() as undo:
            writing = undo.enter_context(closing(open_for_writing(path)))
            reading = undo.enter_context(closing(open_for_reading(path)))
            try:
                locks = run_locks(path.with_name(f"{path.name}-lock"))
            except OSError as error:
                raise JournalError(f"{error.filename} can't be opened: {error.strerror}") from error
            undo.pop_all()
        return cls(path, writing, reading, locks)

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

    async def create(self, header: RunHeader) -> str:
        """See `Journal.create`."""
        return await self._holding(lambda ledger: ledger.create(header), run_number)

    async def claim(self, run: str) -> int:
        """See `Journal.claim`."""
        number = run_number(run)
        return await self._holding(lambda ledger: ledger.claim(number), lambda _: number)

    async def _holding(self, work: Callable[[Ledger], T], number_of: Callable[[T], int]) -> T:
        """Do what takes a run's lock; if the caller is cancelled meanwhile, let go of it."""
        self._check_open()
        taking = self._writer.submit(work)

        def let_go(taken: asyncio.Future[T]) -> None:
            if taken.exception() is None:
                self._let_go(number_of(taken.result()))

        try:
            return await asyncio.shield(taking)
        except asyncio.CancelledError:
            taking.add_done_callback(let_go)
            raise

    async def release(self, run: str) -> None:
        """See `Journal.release`; what was handed over before is written first."""
        self._check_open()
        await asyncio.wait([self._let_go(run_number(run))])

    def _let_go(self, number: int) -> asyncio.Future[None]:
        forgotten = self._writer.submit(lambda ledger: ledger.forget(number))

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
            rows = [Row(run_number(e.run), e, encode_body(e).decode()) for e in entries]
            await self._writer.submit(partial(Ledger.append, rows=rows))

    async def read(self, run: str, after_seq: int = 0) -> AsyncIterator[Entry]:
        """See `Journal.read`; entries that are appended meanwhile are included."""
        number = run_number(run)
        while True:
            batch = await self._read(partial(self._batch, number, after_seq))
            for entry in batch:
                yield entry
            if not batch:
                return
            after_seq = batch[-1].seq

    def _batch(self, number: int, after_seq: int) -> list[Entry]:
        entries: list[Entry] = []
        size = 0
        rows = self._reading.execute(
            "SELECT seq, epoch, at_us, t_us, body FROM entries WHERE run = ? AND seq > ?"
            " ORDER BY seq LIMIT ?",
            (number, after_seq, _BATCH_ENTRIES),
        )
        for seq, epoch, at_us, t_us, body in rows:
            try:
                content = decode_body(body)
            except JournalError as error:
                raise JournalError(
                    f"{self._path}: {run_id(number)}, record {seq}: {error}"
                ) from error
            entries.append(Entry(run_id(number), epoch, seq, at_us, t_us, *content))
            size += len(body)
            if size > _BATCH_BYTES:
                break
        rows.close()
        if not entries and not self._known(number):
            raise unknown_run(run_id(number))
        return entries

    def _known(self, number: int) -> bool:
        query = "SELECT 1 FROM runs WHERE run = ?"
        return self._reading.execute(query, (number,)).fetchone() is not None

    async def runs(self) -> Sequence[RunLine]:
        """See `Journal.runs`."""
        return await self._read(self._lines)

    def _lines(self) -> list[RunLine]:
        rows = self._reading.execute("SELECT * FROM runs JOIN standings USING (run) ORDER BY run")
        return [self._line(*row) for row in rows]

    def _line(self, number: int, *columns: Any) -> RunLine:
        mission_name, mission, process, fleet, simulated, speed, created_us, library, *standing = (
            columns
        )
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
        return standing_of(standing).line(run_id(number), header, self._locks.held(number))

    async def _read(self, work: Callable[[], T]) -> T:
        self._check_open()
        try:
            return await asyncio.get_running_loop().run_in_executor(self._reader, work)
        except sqlite3.Error as error:
            raise in_plain_words(error, self._path) from error

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
        self._locks.close()
