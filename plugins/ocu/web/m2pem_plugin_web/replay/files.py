"""Indexes of ended runs in files: `journal.db-replays/r1.index` beside `journal.db`.

A file begins with a line of JSON; one of another version of m2pem, of another run of that name or
with damage is as if there were none. The functions wait for the disk: call them in threads.
"""

import logging
import zlib
from collections.abc import Iterable
from pathlib import Path

import msgspec

from m2pem.api import RunId
from m2pem_plugin_web.replay.index import FORMAT, Index
from m2pem_plugin_web.tracks.stores import FolderStore, HeldError

FILE_BYTES = 1 << 40
SUFFIX = ".index"
LONGEST_HEAD = 1000

log = logging.getLogger("m2pem.ocu.web")


class Head(msgspec.Struct, frozen=True):
    """The first line. `crc32`: of all that follows."""

    format: str
    run: RunId
    started_us: int
    crc32: int


_encode_head = msgspec.json.Encoder().encode
_head = msgspec.json.Decoder(Head)
_encode = msgspec.msgpack.Encoder().encode
_index = msgspec.msgpack.Decoder(Index)


class IndexFiles:
    """The files of a journal. `journal` None: a journal in memory, which has none."""

    def __init__(self, journal: Path | None) -> None:
        self._folder = (
            FolderStore(journal.with_name(f"{journal.name}-replays"), FILE_BYTES, SUFFIX)
            if journal is not None
            else None
        )

    def read(self, run: RunId, started_us: int) -> Index | None:
        """Return the index of a run; None if there is none that can be used."""
        if self._folder is None:
            return None
        try:
            content = self._folder.read(run)
        except OSError as error:
            log.warning("the index of %s cannot be read: %s", run, error)
            return None
        line, _, body = content.partition(b"\n")
        try:
            head = _head.decode(line)
            if head != Head(FORMAT, run, started_us, zlib.crc32(body)):
                return None
            return _index.decode(body)
        except (ValueError, msgspec.DecodeError):
            return None

    def write(self, index: Index) -> None:
        """Write the index of a run in place of an older one. It is logged if that fails: without
        it the index is made again when the run is opened."""
        if self._folder is None:
            return
        body = _encode(index)
        head = _encode_head(Head(FORMAT, index.run, index.started_us, zlib.crc32(body)))
        try:
            file = self._folder.open(index.run)
            try:
                file.replace(head + b"\n" + body)
            finally:
                file.close()
        except HeldError:
            return  # another page writes it
        except OSError as error:
            log.warning("the index of %s cannot be written: %s", index.run, error)

    def keep_only(self, runs: Iterable[tuple[RunId, int]]) -> None:
        """Remove the files of all runs but these, each with when it began."""
        if self._folder is None:
            return
        there = dict(runs)
        try:
            for run in list(self._folder.runs()):
                line = self._folder.read(run, LONGEST_HEAD).partition(b"\n")[0]
                if run not in there or _began_us(line) != there[run]:
                    self._folder.remove(run)
        except OSError as error:
            log.warning("indexes of removed runs cannot be deleted: %s", error)


def _began_us(line: bytes) -> int | None:
    try:
        return _head.decode(line).started_us
    except (ValueError, msgspec.DecodeError):
        return None
