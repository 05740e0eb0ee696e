"""Compares what the mark file says was acknowledged with what a journal has."""

import sqlite3
from collections.abc import Mapping

from m2pem.journal.base import Loss
from m2pem.journal.marks import NO_HASH, Mark, MarkState

_STANDING = "SELECT run, epoch, last_seq, hash, outcome FROM standings"


def losses(connection: sqlite3.Connection, marks: Mapping[int, Mark]) -> dict[int, Loss]:
    """What is missing, by the run's number. Read the marks first: both grow meanwhile."""
    rows = {row[0]: row[1:] for row in connection.execute(_STANDING)}
    found = {
        number: _loss(connection, number, rows.get(number), mark) for number, mark in marks.items()
    }
    return {number: loss for number, loss in found.items() if loss is not None}


def loss_of(connection: sqlite3.Connection, number: int, mark: Mark | None) -> Loss | None:
    """What is missing of one run."""
    if mark is None:
        return None
    row = connection.execute(f"{_STANDING} WHERE run = ?", (number,)).fetchone()
    return _loss(connection, number, None if row is None else row[1:], mark)


def _loss(
    connection: sqlite3.Connection,
    number: int,
    standing: tuple[int, int, bytes | None, str | None] | None,
    mark: Mark,
) -> Loss | None:
    if mark.state is MarkState.ACCEPTED:
        return None
    if standing is None:
        return Loss(mark.seq, None, resumable=False)
    epoch, last_seq, hash_, outcome = standing
    if epoch >= mark.epoch and last_seq >= mark.seq:
        if last_seq == mark.seq:
            there = hash_
        else:
            row = connection.execute(
                "SELECT hash FROM entries WHERE run = ? AND seq <= ? ORDER BY seq DESC LIMIT 1",
                (number, mark.seq),
            ).fetchone()
            there = row and row[0]
        # The mark before the first entry has the hash of the header, which no entry has.
        if (there or NO_HASH) == mark.hash or (mark.seq == 0 and last_seq > 0):
            return None
    return Loss(mark.seq, last_seq, resumable=last_seq > 0 and outcome is None)
