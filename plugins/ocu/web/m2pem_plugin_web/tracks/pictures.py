"""Stores of pictures of detections: beside the tracks, or in memory if the journal is.

The functions wait for the disk: call them in threads, those that change something one at a time.
"""

import errno
import os
import re
from collections import OrderedDict
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import TypeAlias

from m2pem.api import RunId
from m2pem_plugin_web.tracks.camera_pictures import MEDIA_TYPES, Picture
from m2pem_plugin_web.tracks.stores import MOST_IN_MEMORY

FILE_BYTES = 200_000_000
MEMORY_BYTES = 10_000_000
"""The most bytes of the pictures of a run."""

_NAME = re.compile(rf"(r[1-9][0-9]{{0,17}})-([1-9][0-9]{{0,8}})\.({'|'.join(MEDIA_TYPES)})")


class FullError(Exception):
    """A run has as many pictures as it may have."""

    def __init__(self, most_bytes: int) -> None:
        super().__init__(f"the run has {most_bytes / 1e6:g} MB of pictures already")


class FolderPictures:
    """Pictures of runs by the numbers of detections: files in the folder of tracks, which only its
    owner may read. Methods raise OSError.
    """

    def __init__(self, path: Path, most_bytes: int = FILE_BYTES) -> None:
        self._path = path
        self._most = most_bytes
        self._sizes: dict[RunId, int] = {}

    def put(self, run: RunId, number: int, picture: Picture) -> None:
        """Keep a picture, in place of one of that number. A file is there whole, or not at all.

        Raises:
            FullError: the run has too many already.
        """
        name = f"{run}-{number}.{picture.suffix}"
        if not _NAME.fullmatch(name):
            raise OSError(errno.EINVAL, f"{run!r} is not the id of a run")
        file = self._path / name
        if run not in self._sizes:
            self._sizes[run] = sum(each.lstat().st_size for each, _ in self._files(run))
        if self._sizes[run] + len(picture.content) > self._most:
            raise FullError(self._most)
        new = self._path / f".{file.name}.new"
        new.unlink(missing_ok=True)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        try:
            with os.fdopen(os.open(new, flags, 0o600), "wb") as opened:
                opened.write(picture.content)
            for suffix in MEDIA_TYPES:
                file.with_suffix(f".{suffix}").unlink(missing_ok=True)
            new.replace(file)
            self._sizes[run] += len(picture.content)
        except OSError:
            with suppress(OSError):
                new.unlink()
            raise

    def get(self, run: RunId, number: int) -> Picture | None:
        """Return a picture; None if there is none."""
        for suffix in MEDIA_TYPES:
            name = f"{run}-{number}.{suffix}"
            if not _NAME.fullmatch(name):
                return None
            with suppress(FileNotFoundError, NotADirectoryError):
                return Picture((self._path / name).read_bytes(), suffix)
        return None

    def runs(self) -> Iterable[RunId]:
        """Return the runs that have pictures: files of others are left alone."""
        names = (_NAME.fullmatch(path.name) for path in self._path.glob("r*-*.*"))
        return {RunId(found[1]) for found in names if found}

    def remove(self, run: RunId, after: int = 0) -> None:
        """Remove the pictures of a run; those of later numbers than `after` alone."""
        self._sizes.pop(run, None)
        for file, number in self._files(run):
            if number > after:
                file.unlink(missing_ok=True)

    def _files(self, run: RunId) -> list[tuple[Path, int]]:
        names = ((path, _NAME.fullmatch(path.name)) for path in self._path.glob(f"{run}-*.*"))
        return [(path, int(found[2])) for path, found in names if found and found[1] == run]


class MemoryPictures:
    """As `FolderPictures`, for a journal in memory: of its last runs."""

    def __init__(self, most: int = MOST_IN_MEMORY, most_bytes: int = MEMORY_BYTES) -> None:
        self._most = most
        self._most_bytes = most_bytes
        self._kept: OrderedDict[RunId, dict[int, Picture]] = OrderedDict()

    def put(self, run: RunId, number: int, picture: Picture) -> None:
        pictures = self._kept.setdefault(run, {})
        size = sum(len(each.content) for each in pictures.values())
        if size + len(picture.content) > self._most_bytes:
            raise FullError(self._most_bytes)
        pictures[number] = picture
        while len(self._kept) > self._most:
            self._kept.popitem(last=False)

    def get(self, run: RunId, number: int) -> Picture | None:
        return self._kept.get(run, {}).get(number)

    def runs(self) -> Iterable[RunId]:
        return list(self._kept)

    def remove(self, run: RunId, after: int = 0) -> None:
        pictures = self._kept.get(run, {})
        for number in [each for each in pictures if each > after]:
            del pictures[number]
        if not pictures:
            self._kept.pop(run, None)


PictureStore: TypeAlias = FolderPictures | MemoryPictures


def pictures_beside(journal: Path | None) -> PictureStore:
    """Return the store of a journal's pictures. `journal` None: a journal in memory."""
    return (
        MemoryPictures()
        if journal is None
        else FolderPictures(journal.with_name(f"{journal.name}-tracks"))
    )
