"""Gets out of a damaged journal what is intact, into a new one. The damaged one is not changed.

The new journal has an identity of its own: vehicles know the behaviors of its runs by that of the
other one. So every run that had not ended counts as one that has lost entries, also if all of them
are there: an operator is asked before it goes on. The schedule is held.
"""

import sqlite3
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from uuid import UUID

from m2pem.errors import JournalError
from m2pem.journal.codec import decode_part, encode_part
from m2pem.journal.database import explained, open_for_writing
from m2pem.journal.inspection import Inspection, RunState, entry_rows, inspected
from m2pem.journal.marks import Mark, MarkFile, MarkState, beside
from m2pem.journal.transaction import mark_of, position_columns
from m2pem.scheduling.entry import EntryState, Hold, SchedulePlan

_ROWS = 500


def salvage(source: Path, target: Path, by: str) -> Inspection:
    """Copy all that is intact to a new journal; returns what was found. `by`: who asks.

    No executive may write to `source` meanwhile.

    Raises:
        JournalError: there is such a file already, it cannot be written, nothing of `source` can be
            read; no new journal is left then.
    """
    files = [target, *(beside(target, what) for what in ("wal", "shm", "mark"))]
    for file in files:
        if file.exists():
            raise JournalError(f"{file} exists already; name a new file")
    with inspected(source) as (reading, found):
        try:
            with explained(target), closing(open_for_writing(target)) as writing:
                _copy(reading, writing, found, target, by)
                writing.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        except BaseException:
            for file in files:
                file.unlink(missing_ok=True)
            raise
    return found


def _copy(
    reading: sqlite3.Connection,
    writing: sqlite3.Connection,
    found: Inspection,
    target: Path,
    by: str,
) -> None:
    (identity,) = writing.execute("SELECT uuid FROM identity").fetchone()
    marks = MarkFile(beside(target, "mark"), UUID(identity))
    try:
        writing.execute("BEGIN IMMEDIATE")
        for run in found.runs:
            if run.header is not None:
                _copy_run(reading, writing, run)
        for deletion in found.deletions:
            writing.execute("INSERT INTO deletions VALUES (?, ?, ?, ?, ?, ?, 1)", deletion[:6])
        _copy_schedule(writing, found)
        writing.executemany("INSERT INTO alerts VALUES (?, ?, ?)", found.alerts)
        writing.executemany("INSERT INTO drawings VALUES (?, ?, ?)", found.drawings)
        writing.execute(
            "INSERT INTO origin VALUES (?, ?, ?, ?)",
            (
                str(found.path),
                str(found.identity or ""),
                time.time_ns() // 1000,
                by,
            ),
        )
        # A journal without its mark would not ask about its runs: the mark comes first.
        if found.runs:
            marks.reserve(max(run.number for run in found.runs))
            marks.write({run.number: _mark(run) for run in found.runs})
        writing.execute("UPDATE identity SET marked = 1")
        writing.execute("COMMIT")
    finally:
        marks.close()


def _copy_run(reading: sqlite3.Connection, writing: sqlite3.Connection, run: RunState) -> None:
    assert run.header is not None
    writing.execute("INSERT INTO runs VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", run.header)
    writing.executemany(
        "INSERT INTO entries VALUES (?, ?, ?, ?, ?, ?, ?)", entry_rows(reading, run)
    )
    writing.execute(
        "INSERT INTO standings VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        position_columns(run.number, run.position),
    )


def _copy_schedule(writing: sqlite3.Connection, found: Inspection) -> None:
    """Copy the entries, and hold the schedule of each fleet that has one which may start."""
    now_us = time.time_ns() // 1000
    holds = dict(found.holds)
    for entry, fleet, plan, state, revision in found.schedule:
        writing.execute(
            "INSERT INTO schedule VALUES (?, ?, ?, ?, ?)", (entry, fleet, plan, state, revision)
        )
        if decode_part(state, EntryState).active:
            name = decode_part(plan, SchedulePlan).fleet
            holds.setdefault(name, Hold("", f"salvaged from {found.path}", now_us))
    for name, hold in holds.items():
        writing.execute("INSERT INTO schedule_holds VALUES (?, ?)", (name, encode_part(hold)))


def _mark(run: RunState) -> Mark:
    """What counts as acknowledged in the new journal: what no run has that had not ended."""
    if run.mark is not None and run.mark.state is MarkState.ACCEPTED:
        return run.mark
    own = mark_of(run.position)
    if run.header is not None and own.state is MarkState.ENDED and not run.problem:
        return own
    acknowledged = run.position.last_seq if run.mark is None else run.mark.seq
    # The hash of no entry: it is a loss until an operator has let the run go on.
    other = bytes(byte ^ 0xFF for byte in own.hash)
    seq = max(acknowledged, run.position.last_seq)
    return replace(own, seq=seq, hash=other, state=MarkState.SALVAGED)
