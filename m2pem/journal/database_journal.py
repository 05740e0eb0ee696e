"""A journal in a database: what journals in SQLite and in PostgreSQL have in common."""

import asyncio
import struct
import time
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable, Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, closing
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, TypeVar
from uuid import UUID

from m2pem.errors import JournalError
from m2pem.fleet.approval import Approval, Edit
from m2pem.journal.base import Deletion, Entry, Loss, RunHeader, RunInfo
from m2pem.journal.codec import (
    BEGIN_OF_REVISION,
    Numbered,
    decode_body,
    decode_library,
    decode_part,
    encode_body,
    encode_part,
    run_id,
    run_number,
)
from m2pem.journal.fleet_server import FleetServer
from m2pem.journal.hash_chain import entry_hash, header_hash
from m2pem.journal.marks import MarkFile, find_losses
from m2pem.journal.position import RunPosition
from m2pem.journal.storage import Connection, Storage
from m2pem.journal.transaction import (
    EntryRow,
    WriteTransaction,
    deletions_in,
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

_BATCH_BYTES = 1 << 20
_POSITION_COLUMNS = 11

_WITH_FILES = "mission_name, mission, process, fleet, simulated, speed, created_us, library"
_WITHOUT_FILES = "mission_name, NULL, process, NULL, simulated, speed, created_us, NULL"
NO_HEADER = RunHeader("", b"", "")
"""The header of a run that the journal has lost whole."""


class DatabaseJournal(ABC):
    """A `Journal`: one thread writes, another reads; the event loop never waits for the database.

    `file`: beside which other files are kept. `reading`: a connection for the thread that reads.
    """

    batch_entries: ClassVar[int] = 500
    """Read at once, at most."""

    body_column: ClassVar[str] = "body"
    """What selects the bytes of an entry's body."""

    def __init__(
        self,
        file: Path,
        identity: UUID,
        storage: Storage,
        reading: Connection,
        marks: MarkFile,
    ) -> None:
        self._path = file
        self._identity = identity
        self._storage = storage
        self._place = storage.place
        self._marks = marks
        self._reading = reading
        transaction = WriteTransaction(storage, marks)
        self._writer = GroupWriter(transaction, storage, finish=self._finish)
        self._reader = ThreadPoolExecutor(1, thread_name_prefix=f"reading {self._place}")
        self._closed = False
        self._writer.start()

    @abstractmethod
    def _snapshot(self) -> AbstractContextManager[None]:
        """Within the block the reading connection sees the journal as it is at one moment."""

    @abstractmethod
    def _driven(self, numbers: Collection[int]) -> Collection[int]:
        """Return which of these runs a living executive drives; the reading thread asks."""

    @abstractmethod
    def _fleet_server(self, fleet: str, resources: Collection[str]) -> FleetServer | None:
        """Return who serves one of these of a fleet; the reading thread asks."""

    @abstractmethod
    def _finish(self) -> None:
        """Close everything; the writing thread does it last."""

    @property
    def identity(self) -> UUID:
        """See `Journal.identity`. A copy of the journal has it, too: use one of the two."""
        return self._identity

    @property
    def file(self) -> Path | None:
        return self._path

    @property
    def lease_s(self) -> float | None:
        """See `Journal.lease_s`: a process that lives keeps its locks."""
        return None

    @property
    def owned_until_s(self) -> float | None:
        return None

    @abstractmethod
    def abandon(self, fleet: str) -> FleetServer | None:
        """See `Journal.abandon`."""

    @property
    def commits(self) -> int:
        """How many transactions have been written since it was opened."""
        return self._writer.commits

    async def serve_fleet(
        self, fleet: str, resources: Collection[str], digest: str = "", page: str = ""
    ) -> None:
        await self._write(
            lambda transaction: transaction.serve_fleet(fleet, resources, digest, page)
        )

    async def leave_fleet(self, fleet: str) -> None:
        await self._write(lambda transaction: transaction.leave_fleet(fleet))

    async def fleet_server(self, fleet: str, resources: Collection[str]) -> FleetServer | None:
        return await self._read(lambda: self._fleet_server(fleet, resources))

    async def create(self, header: RunHeader, started: EntryChange | None = None) -> str:
        return await self._holding(
            lambda transaction: transaction.create(header, started), run_number
        )

    async def claim(self, run: str) -> int:
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

    async def check_claim(self, run: str, epoch: int) -> None:
        """See `Journal.check_claim`; it does not wait for what is being written."""
        number = run_number(run)
        (await self._read(lambda: self._position(number))).check_claim(run, epoch)

    def _position(self, number: int) -> RunPosition:
        return position_from(self._row("SELECT * FROM standings WHERE run = ?", number))

    def _row(self, query: str, number: int) -> Any:
        row = self._reading.execute(query, (number,)).fetchone()
        if row is None:
            raise no_run(self._reading, number)
        return row

    async def release(self, run: str) -> None:
        """See `Journal.release`; what was submitted before is written first."""
        self._check_open()
        await asyncio.wait([self._release(run_number(run))])

    def _release(self, number: int) -> asyncio.Future[None]:
        forgotten = self._writer.submit(lambda transaction: transaction.forget(number))

        def unlock(forgotten: asyncio.Future[None]) -> None:
            # Looked at so that asyncio doesn't report it: a failed journal lets go all the same.
            forgotten.exception()
            self._storage.owners.release(number)

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
        await self._write(WriteTransaction.check)

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
        with self._snapshot():
            if first:
                before = self._hash_up_to(number, after_seq)
            entries, before = self._next(number, after_seq, before)
            if not entries:
                self._check_end(number, before)
        return entries, before

    def _next(
        self, number: int, after_seq: int, before: bytes | None
    ) -> tuple[list[Entry], bytes | None]:
        entries: list[Entry] = []
        size = 0
        rows = self._reading.execute(
            f"SELECT seq, epoch, at_us, t_us, {self.body_column}, hash FROM entries"
            " WHERE run = ? AND seq > ? ORDER BY seq LIMIT ?",
            (number, after_seq, self.batch_entries),
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

    async def revisions(self, run: str) -> Sequence[Entry]:
        return await self._read(partial(self._revisions_of, run_number(run)))

    def _revisions_of(self, number: int) -> list[Entry]:
        query = (
            f"SELECT seq, epoch, at_us, t_us, {self.body_column} FROM entries"
            f" WHERE run = ? AND substr({self.body_column}, 1, ?) = ? ORDER BY seq"
        )
        begin = BEGIN_OF_REVISION
        with self._snapshot():
            self._row("SELECT 1 FROM runs WHERE run = ?", number)  # it is there
            rows = self._reading.execute(query, (number, len(begin), begin)).fetchall()
        entries: list[Entry] = []
        for seq, epoch, at_us, t_us, body in rows:
            try:
                content = decode_body(body)
            except JournalError as error:
                raise self._damaged(number, seq, str(error)) from error
            entries.append(Entry(run_id(number), epoch, seq, at_us, t_us, *content))
        return entries

    def _hash_up_to(self, number: int, seq: int) -> bytes | None:
        row = self._reading.execute(
            "SELECT hash FROM entries WHERE run = ? AND seq <= ? ORDER BY seq DESC LIMIT 1",
            (number, seq),
        ).fetchone()
        return None if row is None else row[0]

    def _header_hash(self, number: int) -> bytes:
        return header_hash(self._row("SELECT * FROM runs WHERE run = ?", number))

    def _check_end(self, number: int, before: bytes | None) -> None:
        row = self._row("SELECT * FROM standings JOIN runs USING (run) WHERE run = ?", number)
        position = position_from(row[:_POSITION_COLUMNS])
        if position.hash is not None and position.hash != (before or self._header_hash(number)):
            raise self._damaged(
                number, position.last_seq, "it, or what was before it, is missing or was changed"
            )

    def _damaged(self, number: int, seq: int, why: str) -> JournalError:
        return JournalError(f"{self._place}: {run_id(number)}, record {seq}: {why}")

    async def runs(self, *, files: bool = True) -> Sequence[RunInfo]:
        return await self._read(lambda: self._infos(_WITH_FILES if files else _WITHOUT_FILES))

    def _infos(self, columns: str) -> list[RunInfo]:
        marks = self._marks.read()
        with self._snapshot():
            lost = find_losses(self._reading, marks)
            rows = self._reading.execute(
                f"SELECT standings.*, {columns} FROM standings JOIN runs USING (run) ORDER BY run"
            ).fetchall()
            driven = self._driven([row[0] for row in rows])
        infos = {row[0]: _info(row, row[0] in driven, lost.pop(row[0], None)) for row in rows}
        for number, loss in lost.items():
            mark = marks[number]
            infos[number] = RunInfo(run_id(number), NO_HEADER, mark.epoch, 0, 0, loss=loss)
        return [infos[number] for number in sorted(infos)]

    async def accept_loss(self, run: str) -> None:
        """Note that an operator accepts the loss of a run that cannot be resumed: new runs may
        begin.

        Raises:
            JournalError: the run has lost nothing, or can be resumed, which asks the operator.
        """
        await self._write(lambda transaction: transaction.accept_loss(run_number(run)))

    async def delete(self, runs: Sequence[str], *, by: str, unended: bool = False) -> None:
        """See `Journal.delete`. A file keeps its size: `compact` makes it smaller."""
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
        return await self._read(lambda: deletions_in(self._reading))

    # --- the schedule ---------------------------------------------------------------------------

    async def schedule(self, plan: SchedulePlan, state: EntryState) -> ScheduleEntry:
        self._check_open()
        text = encode_part(plan)
        return await self._writer.submit(
            lambda transaction: transaction.schedule(plan, text, state)
        )

    async def change_entry(self, change: EntryChange, *, deletes: str = "") -> None:
        now_us = time.time_ns() // 1000
        await self._write(lambda transaction: transaction.change_entry(change, deletes, now_us))

    async def entries(self) -> Sequence[ScheduleEntry]:
        return await self._read(self._entries)

    def _entries(self) -> list[ScheduleEntry]:
        rows = self._reading.execute("SELECT entry, plan, state FROM schedule ORDER BY entry")
        return [
            ScheduleEntry(
                entry_id(number), decode_part(plan, SchedulePlan), decode_part(state, EntryState)
            )
            for number, plan, state in rows
        ]

    async def schedule_revisions(self) -> Mapping[str, int]:
        return await self._read(self._schedule_revisions)

    def _schedule_revisions(self) -> Mapping[str, int]:
        rows = self._reading.execute("SELECT entry, revision FROM schedule ORDER BY entry")
        return {entry_id(number): revision for number, revision in rows}

    async def changed(self, seen: int) -> int:
        """See `Journal.changed`: nothing notifies of what another process writes."""
        never: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        return await never

    async def remove_entries(self, entries: Sequence[str]) -> None:
        await self._write(lambda transaction: transaction.remove_entries(entries))

    async def hold_schedule(self, fleet: str, hold: Hold | None) -> None:
        await self._write(lambda transaction: transaction.hold_schedule(fleet, hold))

    async def schedule_hold(self, fleet: str) -> Hold | None:
        return await self._read(lambda: self._schedule_hold(fleet))

    def _schedule_hold(self, fleet: str) -> Hold | None:
        row = self._reading.execute(
            "SELECT hold FROM schedule_holds WHERE fleet = ?", (fleet,)
        ).fetchone()
        return None if row is None else decode_part(row[0], Hold)

    # --- approvals ------------------------------------------------------------------------------

    async def approve(self, approval: Approval) -> None:
        await self._write(lambda transaction: transaction.approve(approval))

    async def withdraw_approval(self, approval: Approval) -> None:
        await self._write(lambda transaction: transaction.withdraw_approval(approval))

    async def approvals(self, fleet: str) -> Sequence[Approval]:
        return await self._read(lambda: self._approvals(fleet))

    def _approvals(self, fleet: str) -> list[Approval]:
        rows = self._reading.execute("SELECT approval FROM approvals WHERE fleet = ?", (fleet,))
        found = [decode_part(text, Approval) for (text,) in rows]
        return sorted(found, key=lambda each: each.at_us)

    async def note_edit(self, edit: Edit) -> None:
        await self._write(lambda transaction: transaction.note_edit(edit))

    async def edits(self, digests: Collection[str]) -> Mapping[str, Edit]:
        return await self._read(lambda: self._edits(digests))

    def _edits(self, digests: Collection[str]) -> dict[str, Edit]:
        found = {}
        for digest in digests:
            row = self._reading.execute(
                "SELECT edit FROM edits WHERE digest = ?", (digest,)
            ).fetchone()
            if row is not None:
                found[digest] = decode_part(row[0], Edit)
        return found

    async def write_alerts(
        self, fleet: str, alerts: Mapping[int, str | None], *, last: int | None = None
    ) -> None:
        await self._write_numbered(Numbered.ALERTS, fleet, alerts, last)

    async def alerts(self, fleet: str) -> Mapping[int, str]:
        return await self._read(lambda: self._numbered(Numbered.ALERTS, fleet))

    async def write_drawings(
        self, fleet: str, drawings: Mapping[int, str | None], *, last: int | None = None
    ) -> None:
        await self._write_numbered(Numbered.DRAWINGS, fleet, drawings, last)

    async def drawings(self, fleet: str) -> Mapping[int, str]:
        return await self._read(lambda: self._numbered(Numbered.DRAWINGS, fleet))

    async def _write_numbered(
        self, kind: Numbered, fleet: str, texts: Mapping[int, str | None], last: int | None
    ) -> None:
        await self._write(lambda transaction: transaction.write_numbered(kind, fleet, texts, last))

    def _numbered(self, kind: Numbered, fleet: str) -> Mapping[int, str]:
        rows = self._reading.execute(
            f"SELECT number, {kind.column} FROM {kind.value} WHERE fleet = ? ORDER BY number",
            (fleet,),
        )
        return dict(rows)

    async def _write(self, work: Callable[[WriteTransaction], T]) -> T:
        self._check_open()
        return await self._writer.submit(work)

    async def _read(self, work: Callable[[], T]) -> T:
        self._check_open()
        try:
            return await asyncio.get_running_loop().run_in_executor(self._reader, work)
        except self._storage.errors as error:
            raise self._storage.explained(error) from error
        except (TypeError, ValueError, struct.error) as error:
            # A flipped bit may make a text of a number.
            raise JournalError(f"{self._place}: it is damaged: {error}") from error

    def _check_open(self) -> None:
        if self._closed:
            raise JournalError(f"{self._place}: the journal has been closed")

    async def close(self) -> None:
        """See `Journal.close`; closing it again does nothing."""
        if self._closed:
            return
        self._closed = True
        stopped = self._writer.stop()
        # Looked at so that asyncio doesn't report it: a journal that has failed has said so.
        stopped.add_done_callback(asyncio.Future.exception)
        await asyncio.wait([stopped])


def _info(row: Sequence[Any], driven: bool, loss: Loss | None) -> RunInfo:
    mission_name, mission, process, fleet, simulated, speed, created_us, library = row[
        _POSITION_COLUMNS:
    ]
    header = RunHeader(
        mission_name=mission_name,
        mission=mission or b"",
        process=process,
        fleet=fleet or b"",
        simulated=bool(simulated),
        speed=speed,
        created_us=created_us,
        library=decode_library(library) if library else (),
    )
    position = position_from(row[:_POSITION_COLUMNS])
    return position.info(run_id(row[0]), header, driven, loss)
