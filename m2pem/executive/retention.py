"""How long runs are kept: deleting runs, with what is kept of them beside the journal.

A computer's clock that is years ahead, as after a start without network, must not delete what is
young. So the age of a run does not follow the clock alone: a time in which no run began or ended,
and this executive did not run, counts as half of what is kept at most.
"""

import asyncio
import logging
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from uuid import UUID

from m2pem.api.clock import Clock
from m2pem.errors import JournalError, M2pemError
from m2pem.executive.lost_marks import LostMark, LostMarks, left_by
from m2pem.executive.runtime_directory import runtime_directory
from m2pem.fleet.fleet import Fleet
from m2pem.journal.base import Journal
from m2pem.journal.marks import beside
from m2pem.mission.catalogue import ResourceId
from m2pem.units import US_PER_S

DAY_S = 86_400.0

log = logging.getLogger("m2pem.executive")


async def delete_runs(
    journal: Journal, runs: Sequence[str], *, by: str, unended: bool = False
) -> None:
    """Delete runs as `Journal.delete` does, then what is kept of them beside the journal.

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
    yield beside(journal, "tracks") / f"{run}.jsonl"
    yield from beside(journal, "tracks").glob(f"{run}-*")
    yield beside(journal, "replays") / f"{run}.index"
    yield from beside(journal, "recordings").glob(f"{run}-*.mcap")
    yield beside(journal, f"stopped-{run}")
    with suppress(OSError):
        yield runtime_directory() / f"{identity}-stopped-{run}"


async def delete_old_runs(
    journal: Journal, keep_s: float, since_us: int, now_us: int, *, by: str
) -> list[str]:
    """Delete the runs that ended more than `keep_s` before `now_us`, and return their ids.

    A run that has not ended, that an executive still has, or of which entries are lost, is kept;
    also one that is older by the clock alone, which is logged. `since_us`: when this executive was
    started, by the same clock.

    Raises:
        JournalError: the journal cannot be read or written.
    """
    keep_us = round(keep_s * US_PER_S)
    lines = await journal.runs()
    times_us = {at_us for each in lines for at_us in (each.started_us, each.ended_us or 0)}
    ages_us = _ages_us(times_us, since_us, now_us, keep_us // 2)
    old: list[str] = []
    doubtful: list[str] = []
    for line in lines:
        ended_us = line.ended_us
        if ended_us is None or now_us - ended_us <= keep_us or line.driven or line.loss is not None:
            continue
        (old if ages_us[ended_us] > keep_us else doubtful).append(line.run)
    if doubtful:
        log.warning(
            "kept: %s. By the clock, which shows %s UTC, they ended longer ago than is kept; but "
            "the journal has no run in most of that time, so the clock may be wrong. They are "
            "deleted when this executive has run for half of the time that is kept, or now with "
            "`m2pem runs --delete %s`",
            ", ".join(doubtful),
            datetime.fromtimestamp(now_us / US_PER_S, UTC).strftime("%Y-%m-%d %H:%M"),
            " ".join(doubtful),
        )
    if old:
        await delete_runs(journal, old, by=by)
    return old


def _ages_us(
    times_us: Iterable[int], since_us: int, now_us: int, longest_us: int
) -> dict[int, int]:
    """Return how long ago each time of a journal was. Each gap between them counts as `longest_us`
    at most, but not those since `since_us`, when this executive was started."""
    ages_us = {}
    age_us, later_us = now_us - since_us, since_us
    for at_us in sorted(times_us, reverse=True):
        if at_us < since_us:
            age_us += min(later_us - at_us, longest_us)
            later_us = at_us
        ages_us[at_us] = age_us if at_us < since_us else now_us - at_us
    return ages_us


async def keep_runs(journal: Journal, keep_s: float, clock: Clock, *, by: str) -> None:
    """Delete the old runs of a journal now and each day of the executive's clock, for ever.

    A journal that cannot be read or written now is tried again the next day.
    """
    since_us = clock.now_us()
    while True:
        try:
            deleted = await delete_old_runs(journal, keep_s, since_us, clock.now_us(), by=by)
        except JournalError as error:
            log.warning("old runs are not deleted: %s", error)
        else:
            if deleted:
                log.warning("deleted what ended longer ago than is kept: %s", ", ".join(deleted))
        await clock.sleep(DAY_S)
