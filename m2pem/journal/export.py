"""A run as JSON Lines: its mission and fleet in the first line, then its records (docs/journal.md).

Other programs, and later releases, read it without the journal.
"""

from base64 import b64encode
from collections.abc import AsyncIterator
from typing import Any

import msgspec

from m2pem.journal.base import Entry, Journal, RunInfo
from m2pem.journal.codec import record_line

VERSION = 1


async def exported_lines(journal: Journal, line: RunInfo) -> AsyncIterator[bytes]:
    """Yield the lines of a run's export, without newlines.

    Raises:
        JournalError: an entry is damaged or missing.
    """
    revisions = [_revision(entry) for entry in await journal.revisions(line.run) if entry.revision]
    yield msgspec.json.encode({**_head(journal, line), "revisions": revisions})
    async for entry in journal.read(line.run):
        for seq, record in enumerate(entry.records, entry.seq):
            yield record_line(line.run, seq, entry.t_us, record)


def _head(journal: Journal, line: RunInfo) -> dict[str, Any]:
    header = line.header
    return {
        "export": VERSION,
        "journal": journal.identity,
        "run": line.run,
        "created_us": header.created_us,
        "started_us": line.started_us,
        "ended_us": line.ended_us,
        "outcome": line.outcome,
        "detail": line.detail,
        "loss": None if line.loss is None else str(line.loss),
        "records": line.last_seq,
        "process": header.process,
        "simulated": header.simulated,
        "speed": header.speed,
        "mission": _file(header.mission_name, header.mission),
        "files": [_file(source.name, source.data) for source in header.library],
        "fleet": _fleet(header.fleet),
    }


def _revision(entry: Entry) -> dict[str, Any]:
    item = entry.revision
    assert item is not None
    return {
        "seq": entry.seq,
        "version": item.version,
        "by": item.by,
        "mission": _file(item.mission_name, item.mission),
        "files": [_file(source.name, source.data) for source in item.library],
    }


def _file(name: str, content: bytes) -> dict[str, str]:
    try:
        return {"name": name, "text": content.decode()}
    except UnicodeDecodeError:  # XML may have another encoding, which it names itself
        return {"name": name, "base64": b64encode(content).decode()}


def _fleet(content: bytes) -> Any:
    try:
        return msgspec.json.decode(content)["fleet"] if content else None
    except (msgspec.DecodeError, UnicodeDecodeError, KeyError, TypeError):
        return {"base64": b64encode(content).decode()}
