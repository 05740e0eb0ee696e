"""Notices that a journal's files were removed or replaced while they are open.

What is written to a removed file is gone when its last user closes it, and SQLite says nothing.
"""

import os
from collections.abc import Iterable
from pathlib import Path

from m2pem.errors import JournalError


class Presence:
    """The files as they were opened: `paths` must exist."""

    def __init__(self, paths: Iterable[Path]) -> None:
        self._files = {path: _identity(path) for path in paths}

    def check(self) -> None:
        """Compare what the paths name now with what was opened.

        Raises:
            JournalError: a file was removed or replaced; which one, and what to do.
        """
        for path, opened in self._files.items():
            try:
                there = _identity(path)
            except OSError:
                there = None
            if there != opened:
                raise JournalError(
                    f"{path} was {'removed' if there is None else 'replaced'} while it was in use, "
                    "so what is written would be lost. Move the files of the journal back if you "
                    "still have them; else look at the vehicles before you begin a new journal"
                )


def _identity(path: Path) -> tuple[int, int]:
    status = os.stat(path)  # noqa: PTH116  # several at each commit
    return status.st_dev, status.st_ino
