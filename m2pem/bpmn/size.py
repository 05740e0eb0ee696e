"""The largest file that is read as a mission: a setting of the environment."""

import os

from m2pem.errors import M2pemError

VARIABLE = "M2PEM_MAX_MISSION_MIB"
DEFAULT_MIB = 64
_MIB = 1024 * 1024


def max_bytes() -> int:
    """The size limit of a mission file, in bytes.

    Raises:
        M2pemError: the environment variable is no whole number of MiB from 1.
    """
    text = os.environ.get(VARIABLE, "").strip() or str(DEFAULT_MIB)
    if not text.isascii() or not text.isdecimal() or int(text) < 1:
        raise M2pemError(
            f"{VARIABLE}={text!r} is no whole number of MiB from 1; write for example "
            f"{VARIABLE}={DEFAULT_MIB}"
        )
    return int(text) * _MIB


def too_large(has_bytes: int | None = None) -> tuple[str, str]:
    """What is wrong with a larger file, and what would be right; its size if that is known."""
    limit = max_bytes()
    has = f"has {has_bytes:,} bytes, more" if has_bytes is not None else "has more"
    return (
        f"the file {has} than the {limit:,} that m2pem reads",
        f"set {VARIABLE} to more than {limit // _MIB} (MiB), or split the mission",
    )
