"""Locks on runs that an executive drives: one byte a run, in a file beside the journal.

The kernel holds a lock for as long as its process lives, so a killed executive frees its runs at
once, without a time-out. The file has no content and is never removed: a lock on a removed file
excludes no other process.

Classic POSIX locks belong to a process and are lost when it closes *any* descriptor of the file.
Linux's open file description locks belong to the open file; they are used where they are.
"""

import errno
import fcntl
import os
import struct
import sys
import threading
import weakref
from pathlib import Path
from typing import ClassVar

_HELD_ELSEWHERE = (errno.EAGAIN, errno.EACCES)


class RunLocks:
    """The locks of one journal, held through one open file. Needs Linux."""

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        self._held: set[int] = set()
        _open_locks.add(self)

    def acquire(self, number: int) -> bool:
        """Take a run's lock; False when it is held already, be it through this same object."""
        if number in self._held or not self._lock(number):
            return False
        self._held.add(number)
        return True

    def release(self, number: int) -> None:
        """Release a run's lock, if it is held through this object."""
        if number in self._held:
            self._held.remove(number)
            self._unlock(number)

    def mine(self, number: int) -> bool:
        """Whether a run's lock is held through this object."""
        return number in self._held

    def held(self, number: int) -> bool:
        """Whether a living process holds a run's lock."""
        return number in self._held or self._locked_elsewhere(number)

    def close(self) -> None:
        """Release all locks. Only `close` and `release`, which then do nothing, may follow."""
        for number in tuple(self._held):
            self.release(number)
        if self in _open_locks:
            _open_locks.discard(self)
            self._close()

    def forget(self) -> None:
        """In a forked child: the parent holds the locks, and they must not outlive it here."""
        self._held.clear()
        self._close()

    def _lock(self, number: int) -> bool:
        try:
            fcntl.fcntl(self._file, fcntl.F_OFD_SETLK, _flock(fcntl.F_WRLCK, number))
        except OSError as error:
            if error.errno in _HELD_ELSEWHERE:
                return False
            raise
        return True

    def _unlock(self, number: int) -> None:
        fcntl.fcntl(self._file, fcntl.F_OFD_SETLK, _flock(fcntl.F_UNLCK, number))

    def _locked_elsewhere(self, number: int) -> bool:
        asked = _flock(fcntl.F_WRLCK, number)
        found = fcntl.fcntl(self._file, fcntl.F_OFD_GETLK, asked)
        return bool(struct.unpack_from("h", found)[0] != fcntl.F_UNLCK)

    def _close(self) -> None:
        os.close(self._file)


def _flock(kind: int, number: int) -> bytes:
    """Linux's struct flock for one byte."""
    return struct.pack("hhqqi0q", kind, os.SEEK_SET, number, 1, 0)


class PosixRunLocks(RunLocks):
    """The same with classic POSIX locks.

    All objects of one process share one descriptor of a file, which stays open until the process
    ends, and what the process itself holds is kept in `_taken`.
    """

    _files: ClassVar[dict[tuple[int, int], int]] = {}
    _taken: ClassVar[set[tuple[int, int]]] = set()
    _guard = threading.Lock()

    def __init__(self, path: Path) -> None:
        path.touch(0o600)
        status = path.stat()
        with self._guard:
            known = self._files.get((status.st_dev, status.st_ino))
            if known is None:
                super().__init__(path)
                self._files[status.st_dev, status.st_ino] = self._file
            else:
                self._file = known
                self._held = set()
                _open_locks.add(self)

    def forget(self) -> None:
        """In a forked child: it has inherited nothing of what the parent holds."""
        super().forget()
        self._files.clear()
        self._taken.clear()

    def _lock(self, number: int) -> bool:
        with self._guard:
            if (self._file, number) in self._taken or not self._lockf(number):
                return False
            self._taken.add((self._file, number))
            return True

    def _lockf(self, number: int) -> bool:
        try:
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, number)
        except OSError as error:
            if error.errno in _HELD_ELSEWHERE:
                return False
            raise
        return True

    def _unlock(self, number: int) -> None:
        with self._guard:
            fcntl.lockf(self._file, fcntl.LOCK_UN, 1, number)
            self._taken.remove((self._file, number))

    def _locked_elsewhere(self, number: int) -> bool:
        if self._lock(number):
            self._unlock(number)
            return False
        return True

    def _close(self) -> None:
        """Leave the file open: closing it would free what other objects hold."""


_open_locks: "weakref.WeakSet[RunLocks]" = weakref.WeakSet()


def _forget_in_child() -> None:
    for locks in tuple(_open_locks):
        locks.forget()
    _open_locks.clear()


os.register_at_fork(after_in_child=_forget_in_child)


def run_locks(path: Path) -> RunLocks:
    """The locks of the journal whose lock file is `path`; makes the file where it is missing."""
    return RunLocks(path) if sys.platform == "linux" else PosixRunLocks(path)
