"""The encoding of entries, records and run ids, in the journal and for people.

An entry's input and records are one JSON text, `[input, [record, ...]]`, and come back as exactly
equal objects. It is JSON because a journal outlives the program that wrote it.
"""

import re
from enum import StrEnum
from typing import TypeAlias, TypeVar

import msgspec

from m2pem.engine.inputs import Input
from m2pem.engine.records import Record
from m2pem.errors import InternalError, JournalError, StaleAlertsError, StaleDrawingsError
from m2pem.fleet.approval import Approval, Edit
from m2pem.journal.base import Entry
from m2pem.mission.library import Source
from m2pem.scheduling.entry import EntryState, Hold, SchedulePlan, entry_number

# 18 digits: what the 64-bit keys of a database hold.
_RUN_ID = re.compile(r"r[1-9][0-9]{0,17}")

Body: TypeAlias = tuple[Input, tuple[Record, ...]]


_decoder: msgspec.json.Decoder[Body] = msgspec.json.Decoder(tuple[Input, tuple[Record, ...]])
_encoder = msgspec.json.Encoder()


def encode_body(entry: Entry) -> bytes:
    """The input and records of an entry as JSON.

    Raises:
        InternalError: JSON has no such value (NaN, infinity, half a surrogate pair).
    """
    content = (entry.input, entry.records)
    try:
        body = _encoder.encode(content)
        # msgspec writes NaN and infinities as null; a journal that reads back differently is none.
        exact = b"null" not in body or _decoder.decode(body) == content
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise InternalError(
            f"{entry.run}, record {entry.seq}: cannot be written: {error}"
        ) from error
    if not exact:
        raise InternalError(
            f"{entry.run}, record {entry.seq}: cannot be written: a value is not a finite number"
        )
    return body


BEGIN_OF_REVISION = b'[{"input":"Revise",'
"""With what the encoded body of an entry begins whose input is a revision."""


def decode_body(body: bytes | str) -> Body:
    """The input and records that `encode_body` wrote.

    Raises:
        JournalError: the text is damaged, or of a newer m2pem that has other records.
    """
    try:
        return _decoder.decode(body)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise JournalError(f"damaged, or written by a newer m2pem: {error}") from error


def encode_library(library: tuple[Source, ...]) -> str:
    """The other files of a mission as JSON; their bytes are base64."""
    return _encoder.encode(library).decode()


def decode_library(text: str) -> tuple[Source, ...]:
    """What `encode_library` wrote.

    Raises:
        JournalError: the text is damaged, or of a newer m2pem.
    """
    try:
        return msgspec.json.decode(text, type=tuple[Source, ...])
    except (msgspec.DecodeError, UnicodeError) as error:
        raise JournalError(f"damaged, or written by a newer m2pem: {error}") from error


Part = TypeVar("Part", SchedulePlan, EntryState, Hold, Approval, Edit)


def encode_part(part: SchedulePlan | EntryState | Hold | Approval | Edit) -> str:
    """A part of an entry of the schedule, an approval or an edit, as JSON.

    Raises:
        JournalError: JSON has no such value (NaN, infinity).
    """
    try:
        text = _encoder.encode(part)
        # msgspec writes NaN and infinities as null.
        exact = b"null" not in text or msgspec.json.decode(text, type=type(part)) == part
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise JournalError(f"{_what(type(part))} cannot be written: {error}") from error
    if not exact:
        raise JournalError(f"{_what(type(part))} cannot be written: a value is not a finite number")
    return text.decode()


def decode_part(text: str, kind: type[Part]) -> Part:
    """What `encode_part` wrote.

    Raises:
        JournalError: the text is damaged, or of a newer m2pem.
    """
    try:
        return msgspec.json.decode(text, type=kind)
    except (msgspec.DecodeError, UnicodeError) as error:
        raise JournalError(
            f"{_what(kind)} is damaged, or written by a newer m2pem: {error}"
        ) from error


def _what(kind: type) -> str:
    return "an approval" if kind in (Approval, Edit) else "the schedule"


def known_entry(entry: str) -> int:
    """Return the number of an entry's id.

    Raises:
        JournalError: it is not the id of an entry.
    """
    number = entry_number(entry)
    if number is None:
        raise unknown_entry(entry)
    return number


def unknown_entry(entry: str) -> JournalError:
    """Return the error for an entry that the journal does not have."""
    return JournalError(
        f"the journal has no entry {entry!r} of a schedule; `m2pem schedule` lists what it has"
    )


class Numbered(StrEnum):
    """What a journal keeps of a fleet by numbers that rise; the value is the name of its table."""

    ALERTS = "alerts"
    DRAWINGS = "drawings"

    @property
    def column(self) -> str:
        """The column of the table that has the text."""
        return self.value.removesuffix("s")

    def refuse_stale(self, fleet: str, found: int, last: int) -> None:
        """Refuse a writer that has read another `last` number than there is.

        Raises:
            StaleAlertsError, StaleDrawingsError: the numbers differ.
        """
        if found == last:
            return
        if self is Numbered.ALERTS:
            raise StaleAlertsError(
                f"the last alert of {fleet} is a{found}, not a{last}: read them again"
            )
        raise StaleDrawingsError(
            f"the last version of the drawings of {fleet} is {found}, not {last}: read them again"
        )


def record_line(run: str, seq: int, t_us: int, record: Record) -> bytes:
    """A record as the one line of JSON that people and scripts read; no newline at the end.

    `t_us` is its mission time in microseconds; the line has it in seconds, under "t".
    """
    head = _encoder.encode({"run": run, "seq": seq, "t": t_us / 1_000_000})
    return head[:-1] + b"," + _encoder.encode(record)[1:]


def run_id(number: int) -> str:
    """Return the id of a journal's `number`th run: r1, r2, ..."""
    return f"r{number}"


def run_number(run: str) -> int:
    """Return the number of a run's id.

    Raises:
        JournalError: it is not the id of a run.
    """
    if not _RUN_ID.fullmatch(run):
        raise unknown_run(run)
    return int(run[1:])


def unknown_run(run: str) -> JournalError:
    """Return the error for a run that the journal does not have."""
    return JournalError(f"the journal has no run {run!r}; `m2pem runs` lists what it has")
