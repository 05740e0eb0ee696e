"""What one transaction of the SQLite journal writes. Used by the writing thread alone.

Every call is checked before anything of it is written, so that a refused one leaves nothing behind
and the others of its group go on. An SQLite error ends the whole transaction.
"""

import os
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import chain
from typing import Any

from m2pem.engine.records import RunOutcome
from m2pem.errors import InternalError, JournalError
from m2pem.journal.base import Entry, RunHeader
from m2pem.journal.codec import encode_library, run_id, unknown_run
from m2pem.journal.lease import RunLocks
from m2pem.journal.standing import Standing


@dataclass(frozen=True, slots=True)
class Row:
    """An entry, ready to be written."""

    number: int
    entry: Entry
    body: str

    @property
    def columns(self) -> tuple[Any, ...]:
        """As the table has them."""
        entry = self.entry
        return self.number, entry.seq, entry.epoch, entry.at_us, entry.t_us, self.body


_ROWS = 100
"""To a statement: SQLite before 3.32 takes 999 parameters."""


class Ledger:
    """`begin`, any number of calls, then `commit` or `rollback`; and again."""

    def __init__(self, connection: sqlite3.Connection, locks: RunLocks) -> None:
        self._connection = connection
        self._locks = locks
        self._known: dict[int, Standing] = {}
        self._data_version = 0
        self._changed: dict[int, Standing] = {}
        self._rows: list[Row] = []
        self._locked: list[int] = []

    def begin(self) -> None:
        """Start a transaction; what another process has written before is seen in it."""
        self._connection.execute("BEGIN IMMEDIATE")
        (version,) = self._connection.execute("PRAGMA data_version").fetchone()
        if version != self._data_version:
            self._known.clear()
            self._data_version = version

    def create(self, header: RunHeader) -> str:
        """Add a run, claimed with epoch 1."""
        last = self._connection.execute("SELECT max(run) FROM runs").fetchone()[0]
        number = 1 + (last or 0)
        standing = Standing(epoch=1, pid=os.getpid(), started_us=header.created_us)
        self._take(number, standing)
        self._connection.execute(
            "INSERT INTO runs VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (
                number,
                header.mission_name,
                header.mission,
                header.process,
                header.fleet,
                header.simulated,
                header.speed,
                header.created_us,
                encode_library(header.library),
            ),
        )
        self._changed[number] = standing
        return run_id(number)

    def claim(self, number: int) -> int:
        """Take a run's lock and raise its epoch, which is returned."""
        standing = self._standing(number)
        self._take(number, standing)
        self._changed[number] = standing.claimed(os.getpid())
        return standing.epoch + 1

    def append(self, rows: Sequence[Row]) -> None:
        """Add entries."""
        changed: dict[int, Standing] = {}
        for row in rows:
            before = changed.get(row.number) or self._standing(row.number)
            changed[row.number] = before.after(row.entry)
        for number in changed:
            if not self._locks.mine(number):
                raise InternalError(f"{run_id(number)}: written to without having been claimed")
        self._changed.update(changed)
        self._rows.extend(rows)

    def forget(self, number: int) -> None:
        """Drop what is remembered of a run that is let go of."""
        self._known.pop(number, None)

    def commit(self) -> bool:
        """Make it durable; False when there was nothing to write."""
        self._write("INSERT INTO entries", [row.columns for row in self._rows])
        self._write(
            "REPLACE INTO standings", [_columns(*changed) for changed in self._changed.items()]
        )
        self._connection.execute("COMMIT")
        wrote = bool(self._changed)
        self._known.update(self._changed)
        self._reset()
        return wrote

    def _write(self, into: str, rows: Sequence[tuple[Any, ...]]) -> None:
        # Many rows to a statement: each execution gives the interpreter's lock away, and with a
        # busy event loop it takes 5 ms to get it back.
        for first in range(0, len(rows), _ROWS):
            some = rows[first : first + _ROWS]
            statement = f"{into} VALUES {_placeholders(len(some), len(some[0]))}"
            self._connection.execute(statement, tuple(chain.from_iterable(some)))

    def rollback(self) -> None:
        """Write nothing of it."""
        for number in self._locked:
            self._locks.release(number)
        self._known.clear()
        self._reset()
        if self._connection.in_transaction:
            self._connection.execute("ROLLBACK")

    def _take(self, number: int, standing: Standing) -> None:
        run = run_id(number)
        if self._locks.mine(number):
            raise JournalError(f"run {run} is already driven, by this process ({os.getpid()})")
        try:
            taken = self._locks.acquire(number)
        except OSError as error:
            raise JournalError(f"run {run} cannot be locked: {error.strerror}") from error
        if not taken:
            raise JournalError(
                f"run {run} is driven by process {standing.pid}, which is alive: end that first"
            )
        self._locked.append(number)

    def _standing(self, number: int) -> Standing:
        standing = self._changed.get(number) or self._known.get(number)
        if standing is None:
            row = self._connection.execute(
                "SELECT * FROM standings WHERE run = ?", (number,)
            ).fetchone()
            if row is None:
                raise unknown_run(run_id(number))
            standing = self._known[number] = standing_of(row[1:])
        return standing

    def _reset(self) -> None:
        self._changed.clear()
        self._rows.clear()
        self._locked.clear()


@cache
def _placeholders(rows: int, columns: int) -> str:
    return ", ".join([f"({', '.join('?' * columns)})"] * rows)


def _columns(number: int, s: Standing) -> tuple[Any, ...]:
    return (
        number,
        s.epoch,
        s.pid,
        s.started_us,
        s.last_seq,
        s.paused,
        s.outcome,
        s.detail,
        s.ended_us,
    )


def standing_of(columns: Sequence[Any]) -> Standing:
    """A standing from its columns of the table, after the run's number."""
    epoch, pid, started_us, last_seq, paused, outcome, detail, ended_us = columns
    return Standing(
        epoch=epoch,
        pid=pid,
        started_us=started_us,
        last_seq=last_seq,
        paused=bool(paused),
        outcome=None if outcome is None else RunOutcome(outcome),
        detail=detail,
        ended_us=ended_us,
    )
