"""The folder of missions: reads and saves them, and lists each with its title.

A save never overwrites the changes of another user; deleted content is kept as a version.
"""

import fcntl
import os
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

from m2pem.api import Draft, MissionControl, Severity
from m2pem.errors import M2pemError, MissionError
from m2pem_plugin_web.missions.names import SUFFIX, why_not
from m2pem_plugin_web.missions.versions import (
    FOLDER,
    Version,
    Versions,
    sync_folder,
    version_of,
    write,
)

LARGEST_BYTES = 20 * 1024 * 1024
"""The most bytes of a mission that m2pem reads."""


class NoMissionError(M2pemError):
    """The mission or the version does not exist."""


class BadNameError(M2pemError):
    """The name of a mission is not allowed."""


class ChangedError(M2pemError):
    """The mission on the disk has changed. `current`: the present one; None if it was deleted."""

    def __init__(self, name: str, current: "Saved | None") -> None:
        what = "was changed" if current is not None else "was deleted"
        super().__init__(f"{name} {what} since it was read")
        self.current = current


class FolderError(M2pemError):
    """The folder cannot be read or written."""


@dataclass(frozen=True, slots=True)
class Saved:
    """A mission on the disk. `by`: the user who saved it; "" if another program wrote it."""

    name: str
    path: Path
    source: bytes
    version: str
    saved_at_us: int
    by: str


class MissionFolder:
    """A folder of missions, created at the first save. Calls block: use threads."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = Lock()

    def file(self, name: str) -> Path:
        """Return the path of a mission, which need not exist.

        Raises:
            BadNameError: the name is not allowed.
        """
        reason = why_not(name)
        if reason:
            raise BadNameError(f"{name!r}: {reason}")
        return self.path / f"{name}{SUFFIX}"

    def names(self) -> Sequence[str]:
        """Return the names of all missions in alphabetical order."""
        try:
            files = [each.name for each in os.scandir(self.path) if each.is_file()]
        except FileNotFoundError:
            return ()
        except OSError as error:
            raise FolderError(f"{self.path}: {error.strerror}") from error
        names = [each.removesuffix(SUFFIX) for each in files if each.endswith(SUFFIX)]
        return sorted((each for each in names if not why_not(each)), key=str.casefold)

    def read(self, name: str) -> Saved:
        """Read a mission from the disk.

        Raises:
            NoMissionError: the mission or version does not exist.
        """
        path = self.file(name)
        try:
            with path.open("rb") as file:
                source = file.read(LARGEST_BYTES + 1)
                changed_us = os.fstat(file.fileno()).st_mtime_ns // 1000
        except (FileNotFoundError, IsADirectoryError):
            raise NoMissionError(f"there is no mission {name!r}") from None
        except OSError as error:
            raise FolderError(f"{path}: {error.strerror}") from error
        if len(source) > LARGEST_BYTES:
            raise FolderError(f"{path} is larger than {LARGEST_BYTES:,} bytes")
        version = version_of(source)
        kept = next((v for v in reversed(self.versions(name)) if v.version == version), None)
        if kept is None or kept.deleted:
            return Saved(name, path, source, version, changed_us, "")
        return Saved(name, path, source, version, kept.saved_at_us, kept.by)

    def save(self, name: str, source: bytes, base: str | None, by: str) -> Saved:
        """Save a mission that was edited from version `base`; None for a new one.

        Raises:
            ChangedError: the disk has another version.
            FolderError: it cannot be written.
        """
        path = self.file(name)
        with locked(self.path, ".lock", self._lock):
            current = self._current(name)
            if (current.version if current is not None else None) != base:
                raise ChangedError(name, current)
            if current is not None and current.source == source:
                return current
            versions = Versions(self.path, name)
            try:
                if current is not None:
                    versions.add(current.source, current.saved_at_us, "")
                kept = versions.add(source, time.time_ns() // 1000, by)
                write(path, source, new=current is None)
            except FileExistsError:
                raise ChangedError(name, self._current(name)) from None
            except OSError as error:
                raise FolderError(f"{path}: {error.strerror}") from error
        return Saved(name, path, source, kept.version, kept.saved_at_us, kept.by)

    def delete(self, name: str, by: str) -> None:
        """Delete a mission; its last content is kept as a version.

        Raises:
            NoMissionError: the mission or version does not exist.
        """
        path = self.file(name)
        with locked(self.path, ".lock", self._lock):
            current = self.read(name)
            try:
                versions = Versions(self.path, name)
                versions.add(current.source, time.time_ns() // 1000, by, deleted=True)
                path.unlink()
                sync_folder(self.path)
            except OSError as error:
                raise FolderError(f"{path}: {error.strerror}") from error

    def versions(self, name: str) -> Sequence[Version]:
        """Return all versions of a mission, the oldest first."""
        self.file(name)
        return Versions(self.path, name).all()

    def version(self, name: str, number: int) -> tuple[Version, bytes]:
        """Return a version with its content.

        Raises:
            NoMissionError: the mission or version does not exist.
        """
        found = next((each for each in self.versions(name) if each.number == number), None)
        source = Versions(self.path, name).source(number) if found is not None else None
        if found is None or source is None:
            raise NoMissionError(f"there is no version {number} of {name!r}")
        return found, source

    def source(self, name: str, version: str | None) -> bytes:
        """Return the content of a mission: the one on the disk, or that of a version.

        Raises:
            NoMissionError: the mission or version does not exist.
        """
        if version is not None:
            for each in reversed(self.versions(name)):
                if each.version == version:
                    return self.version(name, each.number)[1]
        current = self.read(name)
        if version not in (None, current.version):
            raise NoMissionError(f"there is no version {version!r} of {name!r}")
        return current.source

    def _current(self, name: str) -> Saved | None:
        try:
            return self.read(name)
        except NoMissionError:
            return None


@contextmanager
def locked(folder: Path, file: str, lock: Lock) -> Iterator[None]:
    """Lock what is kept in a folder: by `lock` in this process, by `file` in others of m2pem.

    Raises:
        FolderError: the disk refuses.
    """
    with lock:
        try:
            hidden = folder / FOLDER
            hidden.mkdir(parents=True, exist_ok=True)
            handle = os.open(hidden / file, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o666)
        except OSError as error:
            raise FolderError(f"{folder}: {error.strerror}") from error
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
            yield
        finally:
            os.close(handle)


_USES_OTHERS = (b"callActivity", b"import")
"""A file with one of these texts may depend on other files of the folder."""


@dataclass(frozen=True, slots=True)
class Summary:
    """A mission of the folder. `runnable`: a check finds no errors."""

    saved: Saved
    title: str
    runnable: bool


class Summaries:
    """Summaries of missions, cached until a file changes. Calls block: use threads."""

    def __init__(self, control: MissionControl, folder: MissionFolder) -> None:
        self._control = control
        self._folder = folder
        self._known: dict[tuple[str, str, tuple[str, ...]], tuple[str, bool]] = {}

    def all(self) -> Sequence[Summary]:
        """Return the summaries of all missions in alphabetical order.

        Raises:
            FolderError: it cannot be read.
        """
        found = []
        for name in self._folder.names():
            try:
                found.append(self._folder.read(name))
            except (NoMissionError, FolderError):  # it was deleted meanwhile, or is not readable
                continue
        together = tuple(f"{each.name} {each.version}" for each in found)
        known: dict[tuple[str, str, tuple[str, ...]], tuple[str, bool]] = {}
        summaries = []
        for saved in found:
            others = any(each in saved.source for each in _USES_OTHERS)
            key = (saved.name, saved.version, together if others else ())
            known[key] = self._known.get(key) or self._look(saved)
            summaries.append(Summary(saved, *known[key]))
        self._known = known
        return summaries

    def _look(self, saved: Saved) -> tuple[str, bool]:
        draft = Draft(saved.path, saved.source)
        try:
            processes = self._control.outline(draft).processes
        except MissionError:
            return "", False
        main = next((each for each in processes if each.starts), None)
        findings = self._control.check(draft)
        runnable = not any(each.severity is Severity.ERROR for each in findings)
        return (main.name or main.id) if main is not None else "", runnable
