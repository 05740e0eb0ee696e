"""Copies of a journal's file, made while its executive runs."""

import asyncio
import glob
import logging
import shutil
from datetime import UTC, datetime
from pathlib import Path

from m2pem.api.clock import Clock
from m2pem.errors import JournalError
from m2pem.journal.maintenance import back_up
from m2pem.journal.marks import beside
from m2pem.journal.storage_checks import min_free_mb

KEPT = 24
"""Copies that stay; of more, the oldest are removed."""

log = logging.getLogger("m2pem.executive")


async def keep_backups(journal: Path, folder: Path, every_s: float, clock: Clock) -> None:
    """Copy a journal to a folder now and after each `every_s` of the executive's clock, for ever.

    What fails gives operators a warning, and is tried again the next time.
    """
    while True:
        try:
            await asyncio.to_thread(add_backup, journal, folder)
        except JournalError as error:
            log.warning("the journal is not backed up: %s", error)
        await clock.sleep(every_s)


def add_backup(journal: Path, folder: Path) -> Path:
    """Copy a journal with its mark, and remove what is older than the newest `KEPT` copies.

    Returns the copy; its name has the time.

    Raises:
        JournalError: there is no such folder, it has too little room, the journal is damaged, ...
    """
    try:
        needed_mb = journal.stat().st_size / 1e6 + min_free_mb()
        if (free_mb := shutil.disk_usage(folder).free / 1e6) < needed_mb:
            raise JournalError(f"{free_mb:.0f} MB are free in {folder}; {needed_mb:.0f} are needed")
        unfinished = folder / f"{journal.name}-unfinished"
        for left in (unfinished, beside(unfinished, "mark")):  # by a crash
            left.unlink(missing_ok=True)
        back_up(journal, unfinished, lambda *_: None)
        copy = folder / f"{journal.stem}-{datetime.now(UTC):%Y%m%dT%H%M%S.%f}Z{journal.suffix}"
        beside(unfinished, "mark").rename(beside(copy, "mark"))
        unfinished.rename(copy)
        pattern = f"{glob.escape(journal.stem)}-????????T??????.??????Z{journal.suffix}"
        # What is dated after this one was made before it, while the clock was ahead.
        found = sorted(folder.glob(pattern), key=lambda each: (each.name <= copy.name, each.name))
        for old in found[:-KEPT]:
            old.unlink()
            beside(old, "mark").unlink(missing_ok=True)
    except OSError as error:
        raise JournalError(f"{error.filename or folder}: {error.strerror}") from error
    return copy
