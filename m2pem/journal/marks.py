"""The mark file: the last acknowledged entry of each run (a high-water mark), outside SQLite.

SQLite drops what follows a damaged frame of its log, without an error. The mark file, `FILE-mark`
beside the journal, says what was acknowledged. It is written and flushed after each commit and
before that commit is reported as durable. So the journal may be ahead of the mark, and never behind
it.

The file has slots of 128 bytes. Slot 0 is the head: `m2pem mark 1`, the journal's identity, a
checksum. Slot N is run rN: two copies of 64 bytes, written in turn, so that a write that a power
cut tears leaves the copy before it. A copy has big-endian numbers of 8 bytes: the run, the
generation (the copy with the higher one counts), epoch, last record, state; then the last entry's
hash (16 bytes) and a checksum (8).

A loss is what the mark file says was acknowledged and the journal does not have any more.
"""

import os
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from hashlib import blake2b
from pathlib import Path
from uuid import UUID

from m2pem.errors import JournalError
from m2pem.journal.base import Loss
from m2pem.journal.hash_chain import HASH_BYTES
from m2pem.journal.storage import Connection

_MAGIC = b"m2pem mark 1\n\0\0\0"
_SLOT_BYTES = 128
_COPY = struct.Struct(">qqqqq16s")
_CHECK_BYTES = 8
_COPY_BYTES = _COPY.size + _CHECK_BYTES
_PAGE_BYTES = 4096
_flush = getattr(os, "fdatasync", os.fsync)

NO_HASH = bytes(HASH_BYTES)
"""In the mark of a run whose entries are all from before the chain."""


class MarkState(IntEnum):
    """State of a run: not ended, ended, its loss was accepted by a person, or it was salvaged from
    another journal and has not gone on since."""

    OPEN = 0
    ENDED = 1
    ACCEPTED = 2
    SALVAGED = 3


@dataclass(frozen=True, slots=True)
class Mark:
    """The last acknowledged entry of a run: its epoch, last record and hash."""

    epoch: int
    seq: int
    hash: bytes
    state: MarkState = MarkState.OPEN


class MarkFile:
    """The mark file of one open journal. A run's slot is written by the executive that drives it.

    `new`: the file was missing or empty.

    Raises:
        OSError: the file cannot be opened or written.
        JournalError: it is of another journal, or no mark file.
    """

    def __init__(self, path: Path, identity: UUID) -> None:
        self.path = path
        self._generations: dict[int, int] = {}
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            self.new = os.fstat(self._file).st_size == 0
            if self.new:
                self._begin(identity)
            elif identity_in(path) != identity:
                raise of_another_journal(path)
        except BaseException:
            os.close(self._file)
            raise
        self._size = os.fstat(self._file).st_size

    def _begin(self, identity: UUID) -> None:
        head = _MAGIC + identity.bytes
        os.pwrite(self._file, (head + _check(head)).ljust(_PAGE_BYTES, b"\0"), 0)
        os.fsync(self._file)
        _flush_folder(self.path.parent)

    def read(self) -> dict[int, Mark]:
        """The marks of all runs, by the run's number. Read them before the journal's tables."""
        return _marks_in(os.pread(self._file, os.fstat(self._file).st_size, 0))

    def of(self, number: int) -> Mark | None:
        """The mark of one run."""
        newest = _newest(os.pread(self._file, _SLOT_BYTES, number * _SLOT_BYTES), number)
        return None if newest is None else newest[1]

    def reserve(self, number: int) -> None:
        """Make the file long enough for a run's slot. One executive at a time may do so."""
        needed = (number + 1) * _SLOT_BYTES
        if needed > self._size:
            self._size = os.fstat(self._file).st_size
        if needed > self._size:
            longer = -(-needed // _PAGE_BYTES) * _PAGE_BYTES
            os.pwrite(self._file, bytes(longer - self._size), self._size)
            self._size = longer

    def write(self, marks: Mapping[int, Mark]) -> None:
        """Write marks and flush them."""
        for number, mark in marks.items():
            generation = self._generations.get(number)
            if generation is None:
                slot = os.pread(self._file, _SLOT_BYTES, number * _SLOT_BYTES)
                newest = _newest(slot, number)
                generation = 0 if newest is None else newest[0]
            generation += 1
            copy = _COPY.pack(number, generation, mark.epoch, mark.seq, mark.state, mark.hash)
            place = number * _SLOT_BYTES + generation % 2 * _COPY_BYTES
            os.pwrite(self._file, copy + _check(copy), place)
            self._generations[number] = generation
        _flush(self._file)

    def forget(self, number: int) -> None:
        """Forget a run's slot: another executive may write it from now on."""
        self._generations.pop(number, None)

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)


def beside(journal: Path, what: str) -> Path:
    """Return the path of a file that is kept beside a journal: `FILE-what`."""
    return journal.with_name(f"{journal.name}-{what}")


def identity_in(path: Path) -> UUID | None:
    """The identity of the journal that a mark file belongs to; None: there is no such file.

    Raises:
        JournalError: it is damaged, or not a mark file.
    """
    return read_marks(path)[0]


def read_marks(path: Path) -> tuple[UUID | None, dict[int, Mark]]:
    """The identity of a mark file's journal, and the marks by run number; None: no such file.

    Raises:
        JournalError: it is damaged, or not a mark file.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return None, {}
    except OSError as error:
        raise JournalError(f"{path} cannot be read: {error.strerror}") from error
    if not content:
        return None, {}
    head = content[: len(_MAGIC) + 16 + _CHECK_BYTES]
    if head[: len(_MAGIC)] != _MAGIC or _check(head[:-_CHECK_BYTES]) != head[-_CHECK_BYTES:]:
        raise JournalError(
            f"{path} is damaged, or not the mark file of a journal: what was acknowledged cannot "
            f"be compared with the journal. Look at the vehicles, and remove {path.name} to go on "
            "without the comparison"
        )
    return UUID(bytes=head[len(_MAGIC) : -_CHECK_BYTES]), _marks_in(content)


def _marks_in(content: bytes) -> dict[int, Mark]:
    return {
        number: newest[1]
        for number in range(1, len(content) // _SLOT_BYTES)
        if (newest := _newest(content[number * _SLOT_BYTES :], number)) is not None
    }


def _newest(slot: bytes, number: int) -> tuple[int, Mark] | None:
    """The generation and mark of a slot; None: none was written whole."""
    found: list[tuple[int, Mark]] = []
    for place in (0, _COPY_BYTES):
        copy = slot[place : place + _COPY.size]
        check = slot[place + _COPY.size : place + _COPY_BYTES]
        if len(check) == _CHECK_BYTES and _check(copy) == check:
            run, generation, epoch, seq, state, hash_ = _COPY.unpack(copy)
            if run == number:
                found.append((generation, Mark(epoch, seq, hash_, MarkState(state))))
    return max(found, key=lambda each: each[0], default=None)


def _check(content: bytes) -> bytes:
    return blake2b(content, digest_size=_CHECK_BYTES).digest()


def _flush_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def of_another_journal(path: Path) -> JournalError:
    """Return the error for when a mark file and the journal beside it do not belong together."""
    journal = path.name.removesuffix("-mark")
    return JournalError(
        f"{path} is the mark of another journal: {journal} has been replaced, or has lost all that "
        f"it had. Put the right {journal} back; or, if you replaced it yourself, look at the "
        f"vehicles and remove {path.name}"
    )


_POSITIONS = "SELECT run, epoch, last_seq, hash, outcome FROM standings"


def find_losses(connection: Connection, marks: Mapping[int, Mark]) -> dict[int, Loss]:
    """Return the losses by run number. Read the marks first: both grow meanwhile."""
    rows = {row[0]: row[1:] for row in connection.execute(_POSITIONS)}
    found = {
        number: _loss(connection, number, rows.get(number), mark) for number, mark in marks.items()
    }
    return {number: loss for number, loss in found.items() if loss is not None}


def find_loss(connection: Connection, number: int, mark: Mark | None) -> Loss | None:
    """Return what one run has lost."""
    if mark is None:
        return None
    row = connection.execute(f"{_POSITIONS} WHERE run = ?", (number,)).fetchone()
    return _loss(connection, number, None if row is None else row[1:], mark)


def _loss(
    connection: Connection,
    number: int,
    position: tuple[int, int, bytes | None, str | None] | None,
    mark: Mark,
) -> Loss | None:
    if mark.state is MarkState.ACCEPTED:
        return None
    if position is None:
        if is_deleted(connection, number, mark):
            return None
        return Loss(mark.seq, None, resumable=False)
    epoch, last_seq, hash_, outcome = position
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
    resumable = last_seq > 0 and outcome is None
    return Loss(mark.seq, last_seq, resumable, mark.state is MarkState.SALVAGED)


def is_deleted(connection: Connection, number: int, mark: Mark) -> bool:
    """Whether the run was deleted on request, with all that had been acknowledged."""
    row = connection.execute(
        "SELECT epoch, last_seq, hash FROM deletions WHERE run = ?", (number,)
    ).fetchone()
    if row is None:
        return False
    epoch, last_seq, hash_ = row
    if epoch < mark.epoch or last_seq < mark.seq:
        return False
    # What came after the mark was written, and not acknowledged, before a crash.
    return last_seq > mark.seq or (hash_ or NO_HASH) == mark.hash
