"""Checks of where a journal is kept: free space, and files that were removed or replaced; and what
the faults of a disk are called.

Too little free space is reported before the disk is full. What is written to a removed file is gone
when the last process closes it, and SQLite does not report it.
"""

import errno
import os
from collections.abc import Iterable
from pathlib import Path

from m2pem.errors import JournalError

MIN_FREE_VARIABLE = "M2PEM_MIN_FREE_MB"
"""The environment variable with the bound, in megabytes; 0: no bound."""

DEFAULT_MB = 200

_BYTES = 1_000_000

DISK_FULL = "the disk is full; make room"
READ_ONLY = "it, its folder or its file system can only be read; allow writing"
DISK_FAILED = "the disk failed to read or write; look at it and its file system"

_FAULTS = {
    errno.ENOSPC: DISK_FULL,
    errno.EDQUOT: DISK_FULL,
    errno.EROFS: READ_ONLY,
    errno.EACCES: READ_ONLY,
    errno.EIO: DISK_FAILED,
}


def disk_fault(error: OSError) -> str:
    """Return what is wrong with the storage of a file, and the remedy."""
    fault = _FAULTS.get(error.errno or 0)
    return f"{fault} ({error.strerror})" if fault else str(error.strerror)


def min_free_mb() -> float:
    """Return the free space, in megabytes, below which no run begins and operators are warned.

    Raises:
        JournalError: the environment variable is not a number of megabytes.
    """
    text = os.environ.get(MIN_FREE_VARIABLE, "").strip()
    try:
        bound = float(text) if text else float(DEFAULT_MB)
    except ValueError:
        bound = -1.0
    if not 0 <= bound < float("inf"):
        raise JournalError(
            f"{MIN_FREE_VARIABLE}={text} is not a number of megabytes, such as {DEFAULT_MB};"
            " 0: no bound"
        )
    return bound


def free_space_mb(journal: Path) -> float:
    """Return the free space of a journal's disk for this user, in megabytes.

    Raises:
        OSError: it cannot be read.
    """
    disk = os.statvfs(journal.parent)
    return disk.f_bavail * disk.f_frsize / _BYTES


def space_shortage(journal: Path) -> str:
    """Say what is wrong with the free space of a journal's disk, and the remedy; "": nothing.

    Raises:
        OSError: the free space cannot be read.
    """
    free_mb = free_space_mb(journal)
    bound = min_free_mb()
    if free_mb >= bound:
        return ""
    return (
        f"{free_mb:.0f} MB are free where the journal is ({journal.parent}), and {bound:g} MB are "
        f"the least ({MIN_FREE_VARIABLE}): no run begins. Make room: when the disk is full, runs"
        " are held"
    )


class OpenFiles:
    """The files of an open journal, as they were when it was opened: `paths` must exist."""

    def __init__(self, paths: Iterable[Path]) -> None:
        self._files = {path: _identity(path) for path in paths}

    def check(self) -> None:
        """Check that each path still names the file that was opened.

        Raises:
            JournalError: a file was removed or replaced; it says which one, and the remedy.
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
