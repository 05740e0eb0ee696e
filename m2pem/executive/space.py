"""Warns operators while the disk of the journal has little free space."""

import asyncio
import logging
from pathlib import Path

from m2pem.api.control import Alert
from m2pem.executive.notices import Notices
from m2pem.journal.storage_checks import space_shortage

log = logging.getLogger("m2pem.executive")

EVERY_S = 10.0
"""Between two looks at the disk, in real seconds."""

AGAIN_AFTER = 30
"""Looks after which the same warning is given again: operators come and go."""

CODE = "JOURNAL_SPACE"


async def watch_space(journal: Path, notices: Notices) -> None:
    """Look at the disk until cancelled. A disk that hangs keeps nothing else waiting."""
    short_for = 0
    while True:
        try:
            text = await asyncio.to_thread(space_shortage, journal)
        except OSError as error:
            log.warning("%s: its disk cannot be asked for free space: %s", journal, error.strerror)
            text = ""
        if text and short_for % AGAIN_AFTER == 0:
            notices.publish(Alert("", CODE, text))
        elif not text and short_for:
            notices.publish(Alert("", CODE, f"there is room again in {journal.parent}"))
        short_for = short_for + 1 if text else 0
        await asyncio.sleep(EVERY_S)
