"""Free space where a journal is: too little of it is reported before the disk is full."""

import os
from pathlib import Path

from m2pem.errors import JournalError

VARIABLE = "M2PEM_MIN_FREE_MB"
"""The environment variable with the bound, in megabytes; 0: no bound."""

DEFAULT_MB = 200

_BYTES = 1_000_000


def bound_mb() -> float:
    """The free space below which no run begins and operators are warned, in megabytes.

    Raises:
        JournalError: the environment variable is not a number of megabytes.
    """
    text = os.environ.get(VARIABLE, "").strip()
    try:
        bound = float(text) if text else float(DEFAULT_MB)
    except ValueError:
        bound = -1.0
    if not 0 <= bound < float("inf"):
        raise JournalError(
            f"{VARIABLE}={text} is not a number of megabytes, such as {DEFAULT_MB}; 0: no bound"
        )
    return bound


def shortage(journal: Path) -> str:
    """What is wrong with the free space of a journal's disk, and what to do; "": nothing.

    Raises:
        OSError: the disk cannot be asked.
    """
    disk = os.statvfs(journal.parent)
    free_mb = disk.f_bavail * disk.f_frsize / _BYTES
    bound = bound_mb()
    if free_mb >= bound:
        return ""
    return (
        f"{free_mb:.0f} MB are free where the journal is ({journal.parent}), and {bound:g} MB are "
        f"the least ({VARIABLE}): no run begins. Make room: when the disk is full, runs are held"
    )
