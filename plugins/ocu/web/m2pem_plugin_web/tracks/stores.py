"""Stores of tracks: a folder beside the journal, or memory if the journal is in memory, too.

The functions wait for the disk: call them in threads.
"""

import errno
import fcntl
import os
import re
from collections import OrderedDict
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import TypeAlias

from m2pem.api import RunId

MOST_IN_MEMORY = 20
"""Most runs with a track; the oldest are removed."""

FILE_BYTES = 20_000_000
MEMORY_BYTES = 2_000_000
"""The most bytes of the track of a run."""

_RUN = re.compile(r"r[1-9][0-9]{0,17}")
TRACKS = ".jsonl"
"""How the names of files of tracks end."""
_CLOSED = -1


class HeldError(Exception):
    """Another page of the same executive writes this track."""


class FolderStore:
    """A file for each run, which only its owner may read. `path` is made when needed. Methods raise
    OSError.

    `most_bytes`: the size beyond which a text is thinned. `suffix`: how names of the files end.
    """

    def __init__(self, path: Path, most_bytes: int = FILE_BYTES, suffix: str = TRACKS) -> None:
        self._path = path
        self._suffix = suffix
        self.most_bytes = most_bytes

    def open(self, run: RunId) -> "TextFile":
        """Open the text of a run for writing; create it if it is missing.

        Raises:
            HeldError: another page writes it.
        """
        file = self._file(run)
        self._path.mkdir(mode=0o700, exist_ok=True)
        if self._path.lstat().st_uid != os.geteuid():
            raise PermissionError(errno.EPERM, "the folder belongs to another user", self._path)
        return TextFile(file)

    def read(self, run: RunId, size: int = -1) -> bytes:
        """Return the first `size` bytes of a text, all of it with -1; b"" if there is none."""
        try:
            with self._file(run).open("rb") as file:
                return file.read(size)
        except (FileNotFoundError, NotADirectoryError):
            return b""

    def runs(self) -> Iterable[RunId]:
        """Return the runs that have a text: files of others are left alone."""
        return [
            path.stem for path in self._path.glob(f"*{self._suffix}") if _RUN.fullmatch(path.stem)
        ]

    def remove(self, run: RunId) -> None:
        """Remove the text of a run."""
        self._file(run).unlink(missing_ok=True)

    def _file(self, run: RunId) -> Path:
        if not _RUN.fullmatch(run):
            raise OSError(errno.EINVAL, f"{run!r} is not the id of a run")
        return self._path / f"{run}{self._suffix}"


class TextFile:
    """A track's file, locked for one writer. Methods raise OSError."""

    def __init__(self, path: Path) -> None:
        self._path = path
        while True:
            self._descriptor = _locked(path, os.O_APPEND)
            # Another process may have replaced the file between opening and locking.
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(self._descriptor), path.stat()):
                    return
            os.close(self._descriptor)

    def read(self) -> bytes:
        """Return the whole text."""
        return self._path.read_bytes()

    def append(self, text: bytes) -> None:
        """Add all of `text`, or nothing: a partial write to a full disk is undone."""
        size = os.fstat(self._descriptor).st_size
        try:
            _write(self._descriptor, text)
        except OSError:
            with suppress(OSError):
                os.ftruncate(self._descriptor, size)
            raise

    def replace(self, text: bytes) -> None:
        """Replace the content by `text`, or leave it unchanged."""
        new = self._path.with_name(f".{self._path.name}.new")
        new.unlink(missing_ok=True)
        descriptor = _locked(new, os.O_APPEND | os.O_EXCL)
        try:
            _write(descriptor, text)
            os.fsync(descriptor)
            new.replace(self._path)
        except OSError:
            os.close(descriptor)
            with suppress(OSError):
                new.unlink()
            raise
        os.close(self._descriptor)
        self._descriptor = descriptor

    def close(self) -> None:
        """Close the track for writing."""
        if self._descriptor != _CLOSED:
            os.close(self._descriptor)
        self._descriptor = _CLOSED


def _locked(path: Path, flags: int) -> int:
    flags |= os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC
    descriptor = os.open(path, flags, 0o600)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise HeldError(path.name) from None
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


def _write(descriptor: int, text: bytes) -> None:
    rest = memoryview(text)
    while rest:
        rest = rest[os.write(descriptor, rest) :]


class MemoryStore:
    """As `FolderStore`, for a journal in memory."""

    def __init__(self, most: int = MOST_IN_MEMORY, most_bytes: int = MEMORY_BYTES) -> None:
        self._most = most
        self.most_bytes = most_bytes
        self._texts: OrderedDict[RunId, MemoryText] = OrderedDict()

    def open(self, run: RunId) -> "MemoryText":
        text = self._texts.setdefault(run, MemoryText())
        while len(self._texts) > self._most:
            self._texts.popitem(last=False)
        return text

    def read(self, run: RunId, size: int = -1) -> bytes:
        text = self._texts.get(run)
        whole = text.read() if text is not None else b""
        return whole if size < 0 else whole[:size]

    def runs(self) -> Iterable[RunId]:
        return list(self._texts)

    def remove(self, run: RunId) -> None:
        self._texts.pop(run, None)


class MemoryText:
    """As `TextFile`, in memory."""

    def __init__(self) -> None:
        self._text = bytearray()

    def read(self) -> bytes:
        return bytes(self._text)

    def append(self, text: bytes) -> None:
        self._text += text

    def replace(self, text: bytes) -> None:
        self._text = bytearray(text)

    def close(self) -> None:
        """See `TextFile.close`."""


TrackText: TypeAlias = TextFile | MemoryText
TrackStore: TypeAlias = FolderStore | MemoryStore


def store_beside(journal: Path | None) -> TrackStore:
    """Return the store of a journal's tracks. `journal` None: a journal in memory."""
    return (
        MemoryStore()
        if journal is None
        else FolderStore(journal.with_name(f"{journal.name}-tracks"))
    )
