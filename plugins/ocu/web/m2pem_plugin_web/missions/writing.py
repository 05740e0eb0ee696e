"""Writes files whole or not at all, and durably: also if the power fails in between."""

import os
import tempfile
from pathlib import Path

_NEW_FILES_MODE = 0o666


def write(path: Path, content: bytes, *, new: bool = False) -> None:
    """Put a file there, in place of the one that was; `new`: unless there is one.

    Raises:
        FileExistsError: there is one.
        OSError: it cannot be written.
    """
    handle, name = tempfile.mkstemp(prefix=".m2pem-", suffix=".part", dir=path.parent)
    part = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fchmod(file.fileno(), _mode_of(path))
            os.fsync(file.fileno())
        if new:
            os.link(part, path)
        else:
            part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Make durable which names a folder has."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _mode_of(path: Path) -> int:
    """That of the file that is replaced, else what the process gives to new ones."""
    try:
        return path.stat().st_mode & 0o777
    except FileNotFoundError:
        mask = os.umask(0)
        os.umask(mask)
        return _NEW_FILES_MODE & ~mask
