"""Write transactions of a journal in a database. Used by the writing thread alone.

Every call is checked before anything of it is written. A refused call therefore leaves nothing
behind, and the others of its group are written. An error of the database ends the whole
transaction.
"""

import os
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from m2pem.engine.records import RunOutcome
from m2pem.errors import InternalError, JournalError, StaleEntryError
from m2pem.fleet.approval import Approval, Edit
from m2pem.journal.base import Deletion, Entry, RunHeader
from m2pem.journal.codec import (
    Numbered,
    decode_part,
    encode_library,
    encode_part,
    known_entry,
    run_id,
    run_number,
    unknown_entry,
    unknown_run,
)
from m2pem.journal.hash_chain import entry_hash, header_hash, position_seal
from m2pem.journal.marks import NO_HASH, Mark, MarkFile, MarkState, find_loss, find_losses
from m2pem.journal.position import RunPosition
from m2pem.journal.storage import Connection, Storage
from m2pem.journal.storage_checks import disk_fault, space_shortage
from m2pem.scheduling.entry import (
    EntryChange,
    EntryId,
    EntryState,
    Hold,
    ScheduleEntry,
    SchedulePlan,
    entry_id,
)


@dataclass(frozen=True, slots=True)
class EntryRow:
    """An entry with its encoded body, ready to be written."""

    number: int
    entry: Entry
    body: bytes

    def hash_after(self, before: bytes) -> bytes:
        """Return the hash of the entry; `before` is the hash of the entry before it."""
        entry = self.entry
        return entry_hash(before, entry.seq, entry.epoch, entry.at_us, entry.t_us, self.body)

    def columns(self, hash_: bytes | None) -> tuple[Any, ...]:
        """Return the values of the row in the table `entries`."""
        entry = self.entry
        body = self.body.decode()
        return self.number, entry.seq, entry.epoch, entry.at_us, entry.t_us, body, hash_


_EMPTIED_ENTRIES = 2000
"""To a transaction: inputs of runs under way wait for it."""


class WriteTransaction:
    """Transactions, one after the other: `begin`, any number of calls, `commit` or `rollback`."""

    def __init__(self, storage: Storage, marks: MarkFile) -> None:
        self._storage = storage
        self._owners = storage.owners
        self._marks = marks
        self._known: dict[int, RunPosition] = {}
        self._changed: dict[int, RunPosition] = {}
        self._rows: list[tuple[Any, ...]] = []
        self._taken: list[int] = []
        self._given_up: set[int] = set()
        self._appended: set[int] = set()
        self._lossy: set[int] = set()
        self._wrote = False

    @property
    def _connection(self) -> Connection:
        return self._storage.connection

    def begin(self) -> None:
        """Start a transaction; it sees what another process has committed before."""
        if not self._storage.begin():
            self._known.clear()

    def check(self) -> None:
        """Check that the database answers, that the files are where they were opened, and that
        there is room for a run."""
        self._connection.execute("SELECT 1")
        self._storage.check()
        self._refuse_while_short()

    def create(self, header: RunHeader, started: EntryChange | None = None) -> str:
        """Add a run that is claimed with epoch 1, and return its id."""
        self._storage.exclude_others()
        if started is not None:
            self._refuse_stale(started)
            self._refuse_held(started.entry)
        self._refuse_while_short()
        marks = self._marks.read()
        self._refuse_while_lossy(marks)
        last = self._connection.execute(
            "SELECT max(run) FROM"
            " (SELECT run FROM runs UNION ALL SELECT run FROM deletions) AS given"
        ).fetchone()[0]
        number = 1 + max(last or 0, *marks, 0)
        row = (
            number,
            header.mission_name,
            header.mission,
            header.process,
            header.fleet,
            int(header.simulated),
            float(header.speed),
            header.created_us,
            encode_library(header.library),
        )
        position = RunPosition(
            epoch=1, pid=os.getpid(), started_us=header.created_us, hash=header_hash(row)
        )
        self._take(number, position)
        self._connection.execute("INSERT INTO runs VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", row)
        self._changed[number] = position
        if started is not None:
            self._replace_state(started.with_run(run_id(number)))
        return run_id(number)

    def _refuse_while_short(self) -> None:
        try:
            text = space_shortage(self._marks.path)
        except OSError as error:
            raise JournalError(
                f"{self._marks.path}: its disk cannot be asked for free space: {error.strerror}"
            ) from error
        if text:
            raise JournalError(text)

    def _refuse_while_lossy(self, marks: Mapping[int, Mark]) -> None:
        for number, loss in find_losses(self._connection, marks).items():
            run = run_id(number)
            raise JournalError(
                f"no run begins: {run}: {loss}, so its vehicles may do what no mission knows. "
                f"{loss.remedy(run)}"
            )

    def serve_fleet(self, fleet: str, resources: Collection[str], digest: str, page: str) -> None:
        """Serve a fleet, unless another executive does."""
        self._storage.exclude_others()
        try:
            other = self._storage.serve_fleet(fleet, resources, digest, page)
        except OSError as error:
            raise JournalError(
                f"{error.filename or self._storage.place}: {disk_fault(error)}; which executive "
                f"serves {fleet} cannot be noted"
            ) from error
        if other is not None:
            raise other.refusal(fleet)

    def leave_fleet(self, fleet: str) -> None:
        """Serve a fleet no more."""
        self._storage.leave_fleet(fleet)

    def claim(self, number: int) -> int:
        """Take a run's lock and raise its epoch, which is returned."""
        self._storage.exclude_others()
        self._storage.fence(number)
        position = self._position(number)
        self._take(number, position)
        # With the lock, no other process writes the mark.
        mark = self._marks.of(number)
        if find_loss(self._connection, number, mark) is not None:
            self._lossy.add(number)
        self._changed[number] = replace(
            position.claimed(os.getpid()), epoch=1 + max(position.epoch, mark.epoch if mark else 0)
        )
        return self._changed[number].epoch

    def accept_loss(self, number: int) -> None:
        """Note in the mark that a run's loss was accepted; no executive may drive the run."""
        mark = self._marks.of(number)
        loss = find_loss(self._connection, number, mark)
        if mark is None or loss is None:
            raise JournalError(f"{run_id(number)} has lost nothing")
        if loss.resumable:
            run = run_id(number)
            raise JournalError(f"{run} can be resumed: {loss.remedy(run)}")
        self._marks.write({number: replace(mark, state=MarkState.ACCEPTED)})

    def delete(self, numbers: Sequence[int], by: str, now_us: int, *, unended: bool) -> None:
        """Delete runs; `empty` removes their entries, which may be too many for one transaction.

        No other process takes a run's lock meanwhile: it does so in a transaction, too.
        """
        self._storage.exclude_others()
        for number in numbers:
            self._refuse_deletion(number, unended=unended)
        for number in numbers:
            self._connection.execute("DELETE FROM deletions WHERE run = ?", (number,))
            self._connection.execute(
                "INSERT INTO deletions SELECT run, epoch, last_seq, hash, ?, ?, 0 FROM standings"
                " WHERE run = ?",
                (now_us, by, number),
            )
            self._connection.execute("DELETE FROM standings WHERE run = ?", (number,))
            self._connection.execute("DELETE FROM runs WHERE run = ?", (number,))
            self._known.pop(number, None)
        self._wrote = True

    def _refuse_deletion(self, number: int, *, unended: bool) -> None:
        run = run_id(number)
        self._storage.fence(number)
        position = self._position(number)
        if driver := self._storage.driver(number, position):
            raise JournalError(
                f"{run} is not deleted: it is driven by {driver}, which is alive; "
                f"`m2pem stop {run}` ends the run"
            )
        if (loss := find_loss(self._connection, number, self._marks.of(number))) is not None:
            raise JournalError(f"{run} is not deleted: {loss}. {loss.remedy(run)}")
        if position.outcome is None and not unended:
            raise JournalError(f"{run} is not deleted: it has not ended, and can be resumed")

    def empty(self) -> bool:
        """Remove some entries of deleted runs; False: there were none left."""
        self._storage.exclude_others()
        found = self._connection.execute(
            "SELECT run FROM deletions WHERE emptied = 0 LIMIT 1"
        ).fetchone()
        if found is None:
            return False
        (number,) = found
        beyond = self._connection.execute(
            "SELECT seq FROM entries WHERE run = ? ORDER BY seq LIMIT 1 OFFSET ?",
            (number, _EMPTIED_ENTRIES),
        ).fetchone()
        if beyond is None:
            self._connection.execute("DELETE FROM entries WHERE run = ?", (number,))
            self._connection.execute("UPDATE deletions SET emptied = 1 WHERE run = ?", (number,))
        else:
            self._connection.execute(
                "DELETE FROM entries WHERE run = ? AND seq < ?", (number, *beyond)
            )
        self._wrote = True
        return True

    # --- the schedule ---------------------------------------------------------------------------

    def schedule(self, plan: SchedulePlan, plan_text: str, state: EntryState) -> ScheduleEntry:
        """Add an entry to the schedule."""
        self._refuse_while_short()
        number = self._storage.add_to_schedule(
            plan.fleet, plan_text, encode_part(state), state.revision
        )
        self._wrote = True
        return ScheduleEntry(entry_id(number), plan, state)

    def change_entry(self, change: EntryChange, deletes: str, now_us: int) -> None:
        """Replace the state of an entry; delete a run of it that never began."""
        self._storage.exclude_others()
        self._refuse_stale(change)
        if deletes:
            number = run_number(deletes)
            if self._position(number).last_seq:
                raise JournalError(f"{deletes} is not deleted: it has begun")
            self.delete([number], f"the schedule ({change.entry})", now_us, unended=True)
        self._replace_state(change)

    def _refuse_stale(self, change: EntryChange) -> None:
        row = self._connection.execute(
            "SELECT revision FROM schedule WHERE entry = ?", (known_entry(change.entry),)
        ).fetchone()
        if row is None:
            raise unknown_entry(change.entry)
        if row[0] != change.state.revision - 1:
            raise StaleEntryError(f"{change.entry} was changed by another executive")

    def _refuse_held(self, entry: EntryId) -> None:
        held = self._connection.execute(
            "SELECT 1 FROM schedule JOIN schedule_holds USING (fleet) WHERE entry = ?",
            (known_entry(entry),),
        ).fetchone()
        if held is not None:
            raise StaleEntryError(f"{entry} starts nothing: the schedule is held")

    def _replace_state(self, change: EntryChange) -> None:
        self._connection.execute(
            "UPDATE schedule SET state = ?, revision = ? WHERE entry = ?",
            (encode_part(change.state), change.state.revision, known_entry(change.entry)),
        )
        self._wrote = True

    def remove_entries(self, entries: Sequence[str]) -> None:
        """Remove entries that are not active any more."""
        self._storage.exclude_others()
        numbers = [known_entry(entry) for entry in entries]
        for entry, number in zip(entries, numbers, strict=True):
            row = self._connection.execute(
                "SELECT state FROM schedule WHERE entry = ?", (number,)
            ).fetchone()
            if row is None:
                raise unknown_entry(entry)
            if decode_part(row[0], EntryState).active:
                raise JournalError(f"{entry} is not removed: it may still start a mission")
        for number in numbers:
            self._connection.execute("DELETE FROM schedule WHERE entry = ?", (number,))
        self._wrote = True

    def hold_schedule(self, fleet: str, hold: Hold | None) -> None:
        """Note who holds the whole schedule of a fleet."""
        self._storage.exclude_others()
        if hold is None:
            self._connection.execute("DELETE FROM schedule_holds WHERE fleet = ?", (fleet,))
        else:
            self._connection.execute(
                "INSERT INTO schedule_holds VALUES (?, ?)"
                " ON CONFLICT (fleet) DO UPDATE SET hold = excluded.hold",
                (fleet, encode_part(hold)),
            )
        self._wrote = True

    # --- approvals ------------------------------------------------------------------------------

    def approve(self, approval: Approval) -> None:
        """Keep an approval, in place of an earlier one of the same person and content."""
        self._storage.exclude_others()
        self._connection.execute(
            "INSERT INTO approvals VALUES (?, ?, ?, ?)"
            " ON CONFLICT (fleet, digest, person) DO UPDATE SET approval = excluded.approval",
            (approval.fleet, approval.digest, approval.person, encode_part(approval)),
        )
        self._wrote = True

    def withdraw_approval(self, approval: Approval) -> None:
        """Keep an approval no more."""
        self._storage.exclude_others()
        self._connection.execute(
            "DELETE FROM approvals WHERE fleet = ? AND digest = ? AND person = ?",
            (approval.fleet, approval.digest, approval.person),
        )
        self._wrote = True

    def note_edit(self, edit: Edit) -> None:
        """Keep who has edited a file first."""
        self._storage.exclude_others()
        self._connection.execute(
            "INSERT INTO edits VALUES (?, ?) ON CONFLICT (digest) DO NOTHING",
            (edit.digest, encode_part(edit)),
        )
        self._wrote = True

    def write_numbered(
        self, kind: Numbered, fleet: str, texts: Mapping[int, str | None], last: int | None = None
    ) -> None:
        """Write or remove alerts or drawings of a fleet, if its last one is as expected."""
        self._refuse_while_short()
        table, column = kind.value, kind.column
        if last is not None:
            self._storage.exclude_others()
            found = self._connection.execute(
                f"SELECT max(number) FROM {table} WHERE fleet = ?", (fleet,)
            ).fetchone()[0]
            kind.refuse_stale(fleet, found or 0, last)
        for number, text in texts.items():
            if text is None:
                self._connection.execute(
                    f"DELETE FROM {table} WHERE fleet = ? AND number = ?", (fleet, number)
                )
            else:
                self._connection.execute(
                    f"INSERT INTO {table} VALUES (?, ?, ?)"
                    f" ON CONFLICT (fleet, number) DO UPDATE SET {column} = excluded.{column}",
                    (fleet, number, text),
                )
        self._wrote = True

    def append(self, rows: Sequence[EntryRow]) -> None:
        """Add entries."""
        changed: dict[int, RunPosition] = {}
        columns: list[tuple[Any, ...]] = []
        for row in rows:
            before = changed.get(row.number) or self._position(row.number)
            hash_ = row.hash_after(before.hash or self._header_hash(row.number))
            changed[row.number] = before.after(row.entry, hash_)
            columns.append(row.columns(hash_))
        for number in changed:
            if not self._owners.mine(number):
                raise InternalError(f"{run_id(number)}: written to without having been claimed")
            self._storage.refuse_lost(number)
        self._changed.update(changed)
        self._appended.update(changed)
        self._rows.extend(columns)

    def _header_hash(self, number: int) -> bytes:
        """Return the header's hash of a run that has none yet: it is from before the chain."""
        query = "SELECT * FROM runs WHERE run = ?"
        return header_hash(self._connection.execute(query, (number,)).fetchone())

    def forget(self, number: int) -> None:
        """Drop what is cached of a run that is released."""
        if self._owners.mine(number) and self._storage.give_up(number):
            self._wrote = True
        self._given_up.add(number)
        self._known.pop(number, None)
        self._lossy.discard(number)
        self._marks.forget(number)

    def commit(self) -> bool:
        """Make the transaction durable and write the marks; False: there was nothing to write.

        Raises:
            JournalError: the entries are in the journal, but must not be acknowledged: the files
                are not where they were, or the marks cannot be written.
            RetryError: nothing was written; carry out the calls again after `rollback`.
        """
        wrote = bool(self._changed) or self._wrote
        self._storage.commit(self._rows, self._changed, wrote)
        if wrote:
            self._storage.check()
            self._mark()
        self._known.update(self._changed)
        for number in self._given_up:
            self._known.pop(number, None)
        self._reset()
        return wrote

    def _mark(self) -> None:
        marks: dict[int, Mark] = {}
        for number, position in self._changed.items():
            if number in self._lossy:
                # The mark keeps the loss until an operator has resumed the run, or ended it.
                if position.paused or number not in self._appended:
                    continue
                self._lossy.discard(number)
            marks[number] = mark_of(position)
        try:
            self._marks.write(marks)
        except OSError as error:
            raise JournalError(
                f"{self._marks.path}: the mark cannot be written: {disk_fault(error)}"
            ) from error

    def rollback(self) -> None:
        """Write nothing of the transaction, and release the runs that it took."""
        for number in self._taken:
            self._owners.release(number)
        self._known.clear()
        self._reset()
        self._storage.rollback()

    def _take(self, number: int, position: RunPosition) -> None:
        run = run_id(number)
        if self._owners.mine(number):
            raise JournalError(f"run {run} is already driven, by this process ({os.getpid()})")
        try:
            taken = self._owners.acquire(number)
        except OSError as error:
            raise JournalError(f"run {run} cannot be locked: {error.strerror}") from error
        if not taken:
            driver = self._storage.driver(number, position)
            raise JournalError(f"run {run} is driven by {driver}, which is alive: end that first")
        self._taken.append(number)
        try:
            self._marks.reserve(number)
        except OSError as error:
            raise JournalError(f"{self._marks.path}: {error.strerror}") from error

    def _position(self, number: int) -> RunPosition:
        position = self._changed.get(number) or self._known.get(number)
        if position is None:
            query = f"SELECT * FROM standings WHERE run = ?{self._storage.locking}"
            row = self._connection.execute(query, (number,)).fetchone()
            mine = self._owners.mine(number)
            if mine and number not in self._lossy:
                # A server may have taken over meanwhile that does not have all that another had.
                loss = find_loss(self._connection, number, self._marks.of(number))
                if loss is not None:
                    raise JournalError(f"{run_id(number)}: {loss}")
            if row is None:
                raise no_run(self._connection, number)
            position = position_from(row)
            if mine:
                self._known[number] = position
        return position

    def _reset(self) -> None:
        self._changed.clear()
        self._rows.clear()
        self._appended.clear()
        self._taken.clear()
        self._given_up.clear()
        self._wrote = False


def no_run(connection: Connection, number: int) -> JournalError:
    """Return the error for a run that the journal does not have, or has no more."""
    found = deletions_in(connection, "WHERE run = ?", number)
    return JournalError(str(found[0])) if found else unknown_run(run_id(number))


def deletions_in(connection: Connection, where: str = "", *parameters: int) -> list[Deletion]:
    """Return the deletions of a journal that a clause selects, in order of their runs' numbers."""
    rows = connection.execute(
        f"SELECT run, last_seq, deleted_us, deleted_by FROM deletions {where} ORDER BY run",
        parameters,
    )
    return [Deletion(run_id(number), *columns) for number, *columns in rows]


def mark_of(position: RunPosition) -> Mark:
    """Return the mark of a run at a position."""
    state = MarkState.OPEN if position.outcome is None else MarkState.ENDED
    return Mark(position.epoch, position.last_seq, position.hash or NO_HASH, state)


def position_columns(number: int, s: RunPosition) -> tuple[Any, ...]:
    """Return the row of the table `standings` for a run at a position.

    No text of PostgreSQL has the character 0.
    """
    row = (
        number,
        s.epoch,
        s.pid,
        s.started_us,
        s.last_seq,
        int(s.paused),
        s.outcome,
        s.detail.replace("\0", "\ufffd"),
        s.ended_us,
        s.hash,
    )
    return *row, position_seal(row)


def position_from(row: Sequence[Any]) -> RunPosition:
    """Read a position from its row of the table `standings`.

    Raises:
        JournalError: it is damaged.
    """
    number, epoch, pid, started_us, last_seq, paused, outcome, detail, ended_us, hash_, sealed = row
    whole = sealed is None and hash_ is None  # from before the chain
    if not whole:
        with suppress(TypeError, ValueError, OverflowError):
            whole = sealed == position_seal(row[:-1])
    if not whole:
        raise JournalError(f"run {number}: its row in the table `standings` is damaged")
    return RunPosition(
        epoch=epoch,
        pid=pid,
        started_us=started_us,
        last_seq=last_seq,
        paused=bool(paused),
        outcome=None if outcome is None else RunOutcome(outcome),
        detail=detail,
        ended_us=ended_us,
        hash=hash_,
    )
