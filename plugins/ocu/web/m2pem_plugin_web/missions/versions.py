"""All versions of a mission that were saved or found, in a hidden folder beside the missions.

Files are written whole or not at all, and durably, also if the power fails in between.
"""

import os
import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import msgspec

_NEW_FILES_MODE = 0o666


def write(path: Path, content: bytes, *, new: bool = False) -> None:
    """Replace a file. `new`: fail if the file exists.

    Raises:
        FileExistsError: the file exists.
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
    """Sync a folder, so that its names are durable."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _mode_of(path: Path) -> int:
    """Return the mode of the file that is replaced, else that of new files of the process."""
    try:
        return path.stat().st_mode & 0o777
    except FileNotFoundError:
        mask = os.umask(0)
        os.umask(mask)
        return _NEW_FILES_MODE & ~mask


FOLDER = ".versions"
_FILE = re.compile(r"(\d{6,})\.json")


VERSION_LENGTH = 16


def version_of(source: bytes) -> str:
    """Return a hash of the content: the beginning of its SHA-256."""
    return sha256(source).hexdigest()[:VERSION_LENGTH]


@dataclass(frozen=True, slots=True)
class Version:
    """A version. `by`: the user who saved it, "" for one found on the disk; `deleted`: it was the
    last one before the mission was deleted. Times are microseconds since the Unix epoch."""

    number: int
    version: str
    saved_at_us: int
    by: str
    deleted: bool = False


class Versions:
    """The versions of one mission, the oldest first. Numbers count from 1."""

    def __init__(self, missions: Path, name: str) -> None:
        self._folder = missions / FOLDER / name

    def all(self) -> Sequence[Version]:
        """Return all versions."""
        found = []
        try:
            names = sorted(each.name for each in self._folder.iterdir())
        except (FileNotFoundError, NotADirectoryError):
            return ()
        for name in names:
            if _FILE.fullmatch(name):
                try:
                    found.append(
                        msgspec.json.decode((self._folder / name).read_bytes(), type=Version)
                    )
                except (OSError, msgspec.MsgspecError):
                    continue
        return sorted(found, key=lambda each: each.number)

    def source(self, number: int) -> bytes | None:
        """Return the content of a version; None if there is no such number."""
        try:
            return self._path(number, "bpmn").read_bytes()
        except FileNotFoundError:
            return None

    def add(self, source: bytes, at_us: int, by: str, *, deleted: bool = False) -> Version:
        """Add a content as a version, unless the newest one has the same."""
        known = self.all()
        version = version_of(source)
        newest = known[-1] if known else None
        if newest is not None and newest.version == version and not (by or deleted):
            return newest
        number = newest.number + 1 if newest is not None else 1
        self._folder.mkdir(parents=True, exist_ok=True)
        kept = Version(number, version, at_us, by, deleted)
        # The content comes first, so that a description always has its content.
        write(self._path(number, "bpmn"), source)
        write(self._path(number, "json"), msgspec.json.encode(kept))
        return kept

    def _path(self, number: int, suffix: str) -> Path:
        return self._folder / f"{number:06d}.{suffix}"
