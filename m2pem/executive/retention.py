"""How long runs are kept: deleting runs, with what is kept of them beside the journal."""

import asyncio
import logging
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from uuid import UUID

from m2pem.api.clock import Clock
from m2pem.errors import JournalError, M2pemError
from m2pem.executive.lost_marks import LostMark, LostMarks, left_by
from m2pem.executive.runtime_directory import runtime_directory
from m2pem.fleet.fleet import Fleet
from m2pem.journal.base import Journal
from m2pem.mission.catalogue import ResourceId
from m2pem.units import US_PER_S

DAY_S = 86_400.0

log = logging.getLogger("m2pem.executive")


async def delete_runs(
    journal: Journal, runs: Sequence[str], *, by: str, unended: bool = False
) -> None:
    """Delete runs as `Journal.delete` does, then their tracks and the marks of their STOP.

    What vehicles may still do of a run that has not ended is noted for the next executive.

    Raises:
        JournalError: nothing was deleted; or a file beside the journal cannot be removed.
    """
    left = await _left_by(journal, runs) if unended else []
    await journal.delete(runs, by=by, unended=unended)
    for fleet, resources in left:
        marks = LostMarks(journal.file, journal.identity, fleet)
        for resource, mark in resources.items():
            marks.put(resource, mark)
        await marks.close()
    if journal.file is not None:
        await asyncio.to_thread(_remove_files, journal.file, journal.identity, runs)


async def _left_by(
    journal: Journal, runs: Sequence[str]
) -> list[tuple[Fleet, dict[ResourceId, LostMark]]]:
    found = []
    for line in await journal.runs():
        if line.run in runs and line.outcome is None and not line.gone and line.last_seq:
            try:
                found.append(await left_by(journal, line))
            except M2pemError as error:
                log.warning("%s: what its vehicles do cannot be read: %s", line.run, error)
    return found


def _remove_files(journal: Path, identity: UUID, runs: Sequence[str]) -> None:
    try:
        for run in runs:
            for file in _files(journal, identity, run):
                file.unlink(missing_ok=True)
    except OSError as error:
        raise JournalError(f"{error.filename} cannot be removed: {error.strerror}") from error


def _files(journal: Path, identity: UUID, run: str) -> Iterator[Path]:
    """Yield the files of a run beside the journal (docs/journal.md), if they exist or not."""
    yield journal.with_name(f"{journal.name}-tracks") / f"{run}.jsonl"
    yield journal.with_name(f"{journal.name}-stopped-{run}")
    with suppress(OSError):
        yield runtime_directory() / f"{identity}-stopped-{run}"


async def delete_old_runs(journal: Journal, keep_s: float, now_us: int, *, by: str) -> list[str]:
    """Delete the runs that ended more than `keep_s` before `now_us`, and return their ids.

    A run that has not ended, that an executive still has, or of which entries are lost, is kept.

    Raises:
        JournalError: the journal cannot be read or written.
    """
    before_us = now_us - round(keep_s * US_PER_S)
    old = [
        line.run
        for line in await journal.runs()
        if line.ended_us is not None
        and line.ended_us < before_us
        and not line.driven
        and line.loss is None
    ]
    if old:
        await delete_runs(journal, old, by=by)
    return old


async def keep_runs(journal: Journal, keep_s: float, clock: Clock, *, by: str) -> None:
    """Delete the old runs of a journal now and each day of the executive's clock, for ever.

    A journal that cannot be read or written now is tried again the next day.
    """
    while True:
        now_us = clock.now_us()
        try:
            deleted = await delete_old_runs(journal, keep_s, now_us, by=by)
        except JournalError as error:
            log.warning("old runs are not deleted: %s", error)
        else:
            if deleted:
                log.warning("deleted what ended longer ago than is kept: %s", ", ".join(deleted))
        await clock.sleep(DAY_S)
