"""Where tracks are kept: in a folder beside the journal, or in memory if that is there as well.

All of this waits for a disk: it is called in threads.
"""

import errno
import fcntl
import os
import re
from collections import OrderedDict
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Protocol

from m2pem.api import RunId

MOST_IN_MEMORY = 20
"""Runs; the oldest are forgotten."""

FILE_BYTES = 20_000_000
MEMORY_BYTES = 2_000_000
"""Of a run at most."""

_RUN = re.compile(r"r[1-9][0-9]{0,17}")
_SUFFIX = ".jsonl"
_CLOSED = -1


class HeldError(Exception):
    """Another page of the same executive keeps this track."""


class Kept(Protocol):
    """The text of a track that is written by this one alone. Raises OSError."""

    def read(self) -> bytes:
        """All of it."""
        ...

    def append(self, text: bytes) -> None:
        """Add all of `text`, or nothing."""
        ...

    def replace(self, text: bytes) -> None:
        """Have `text` instead, or what there was."""
        ...

    def close(self) -> None:
        """Write no more."""
        ...


class Place(Protocol):
    """Where there is a text for each run, of `most_bytes` at most. Raises OSError."""

    @property
    def most_bytes(self) -> int:
        """Beyond which a text is thinned."""
        ...

    def open(self, run: RunId) -> Kept:
        """For writing; made where it is missing.

        Raises:
            HeldError: another writes it.
        """
        ...

    def read(self, run: RunId, size: int = -1) -> bytes:
        """Its first `size` bytes, all of it with -1; b"": there is none."""
        ...

    def runs(self) -> Iterable[RunId]:
        """Those that there are."""
        ...

    def remove(self, run: RunId) -> None:
        """Forget one."""
        ...


def place_beside(journal: Path | None) -> Place:
    """Where the tracks of a journal's runs are; None: it ends with its process."""
    return Memory() if journal is None else Folder(journal.with_name(f"{journal.name}-tracks"))


class Folder:
    """A file a run; its owner alone may read it, as the journal. `path` is made when needed."""

    def __init__(self, path: Path, most_bytes: int = FILE_BYTES) -> None:
        self._path = path
        self.most_bytes = most_bytes

    def open(self, run: RunId) -> "File":
        """See `Place.open`."""
        file = self._file(run)
        self._path.mkdir(mode=0o700, exist_ok=True)
        if self._path.lstat().st_uid != os.geteuid():
            raise PermissionError(errno.EPERM, "the folder of tracks is another user's", self._path)
        return File(file)

    def read(self, run: RunId, size: int = -1) -> bytes:
        """See `Place.read`."""
        try:
            with self._file(run).open("rb") as file:
                return file.read(size)
        except (FileNotFoundError, NotADirectoryError):
            return b""

    def runs(self) -> Iterable[RunId]:
        """See `Place.runs`: files of others are left alone."""
        return [path.stem for path in self._path.glob(f"*{_SUFFIX}") if _RUN.fullmatch(path.stem)]

    def remove(self, run: RunId) -> None:
        """See `Place.remove`."""
        self._file(run).unlink(missing_ok=True)

    def _file(self, run: RunId) -> Path:
        if not _RUN.fullmatch(run):
            raise OSError(errno.EINVAL, f"{run!r} is no run of a journal")
        return self._path / f"{run}{_SUFFIX}"


class File:
    """A track's file, locked."""

    def __init__(self, path: Path) -> None:
        self._path = path
        while True:
            self._descriptor = _locked(path, os.O_APPEND)
            # Between opening and locking it, another may have replaced it.
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(self._descriptor), path.stat()):
                    return
            os.close(self._descriptor)

    def read(self) -> bytes:
        """See `Kept.read`."""
        return self._path.read_bytes()

    def append(self, text: bytes) -> None:
        """See `Kept.append`: what a full disk took of it is taken back."""
        size = os.fstat(self._descriptor).st_size
        try:
            _write(self._descriptor, text)
        except OSError:
            with suppress(OSError):
                os.ftruncate(self._descriptor, size)
            raise

    def replace(self, text: bytes) -> None:
        """See `Kept.replace`."""
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
        """See `Kept.close`."""
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


class Memory:
    """Ends with its process, as the journal does."""

    def __init__(self, most: int = MOST_IN_MEMORY, most_bytes: int = MEMORY_BYTES) -> None:
        self._most = most
        self.most_bytes = most_bytes
        self._texts: OrderedDict[RunId, Text] = OrderedDict()

    def open(self, run: RunId) -> "Text":
        """See `Place.open`."""
        text = self._texts.setdefault(run, Text())
        while len(self._texts) > self._most:
            self._texts.popitem(last=False)
        return text

    def read(self, run: RunId, size: int = -1) -> bytes:
        """See `Place.read`."""
        text = self._texts.get(run)
        whole = text.read() if text is not None else b""
        return whole if size < 0 else whole[:size]

    def runs(self) -> Iterable[RunId]:
        """See `Place.runs`."""
        return list(self._texts)

    def remove(self, run: RunId) -> None:
        """See `Place.remove`."""
        self._texts.pop(run, None)


class Text:
    """A track in memory."""

    def __init__(self) -> None:
        self._text = bytearray()

    def read(self) -> bytes:
        """See `Kept.read`."""
        return bytes(self._text)

    def append(self, text: bytes) -> None:
        """See `Kept.append`."""
        self._text += text

    def replace(self, text: bytes) -> None:
        """See `Kept.replace`."""
        self._text = bytearray(text)

    def close(self) -> None:
        """See `Kept.close`."""
