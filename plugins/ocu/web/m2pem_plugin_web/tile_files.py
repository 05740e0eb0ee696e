"""Files of map tiles on this machine.

MBTiles 1.3 (github.com/mapbox/mbtiles-spec) is a table of tiles in SQLite; PMTiles 3
(github.com/protomaps/PMTiles) is an archive with directories of tiles.
"""

import gzip
import html
import logging
import os
import re
import sqlite3
import zlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from threading import Lock
from typing import Any, TypeAlias

from m2pem_plugin_web.settings import TILES, SettingError

log = logging.getLogger("m2pem.web.tiles")

MEDIA_TYPES = {
    "png": "image/png",
    "jpg": "image/jpeg",
    "jpeg": "image/jpeg",
    "webp": "image/webp",
    "avif": "image/avif",
}

_MARKUP = re.compile(r"<[^>]*>")
_MAGIC = b"PMTiles"
_DEEPEST_DIRECTORY = 4
"""Directories below each other that the specification of PMTiles permits, the root included."""
_MOST_DIRECTORIES = 64
"""Directories of a PMTiles archive that are kept in memory."""
_DAMAGED = (OSError, ValueError, LookupError, EOFError, OverflowError, zlib.error)
"""What reading a damaged archive raises."""


@dataclass(frozen=True, slots=True)
class Pictured:
    """The metadata of a file of tiles. `attribution`: text without markup."""

    media_type: str
    max_zoom: int
    attribution: str


class MbTiles:
    """The tiles of an MBTiles file.

    Raises:
        SettingError: the file cannot be read, is not MBTiles, or has vector data instead of images.
    """

    def __init__(self, file: Path) -> None:
        self._lock = Lock()
        try:
            self._database = sqlite3.connect(
                f"{file.resolve().as_uri()}?mode=ro", uri=True, check_same_thread=False
            )
            said = dict(self._database.execute("SELECT name, value FROM metadata"))
            deepest = self._database.execute("SELECT max(zoom_level) FROM tiles").fetchone()[0]
        except sqlite3.Error as error:
            raise SettingError(
                f"{TILES}={file} is neither a readable MBTiles file ({error}) nor a PMTiles file"
            ) from error
        try:
            media_type = _media_type(file, str(said.get("format", "png")))
        except SettingError:
            self.close()
            raise
        self.pictured = Pictured(media_type, int(deepest or 0), _plain(said.get("attribution", "")))

    def tile(self, zoom: int, column: int, row: int) -> bytes | None:
        """Return a tile; rows count from the north. None: the file does not have it."""
        from_south = (1 << zoom) - 1 - row
        with self._lock:
            found = self._database.execute(
                "SELECT tile_data FROM tiles"
                " WHERE zoom_level = ? AND tile_column = ? AND tile_row = ?",
                (zoom, column, from_south),
            ).fetchone()
        return None if found is None else bytes(found[0])

    def close(self) -> None:
        """Close the file."""
        self._database.close()


class PmTiles:
    """The tiles of a PMTiles archive.

    Raises:
        SettingError: the archive cannot be read, has another version than 3, is compressed in a way
            that is not known here, or has vector data instead of images.
    """

    def __init__(self, file: Path) -> None:
        # Takes time to load, and most pages have no such file.
        from pmtiles.reader import Reader  # noqa: PLC0415
        from pmtiles.tile import (  # noqa: PLC0415
            Compression,
            MagicNumberNotFound,
            SpecVersionUnsupported,
            deserialize_directory,
        )

        self._file = file
        self._descriptor: int | None = os.open(file, os.O_RDONLY)
        try:
            reader: Any = Reader  # it has no types
            archive = reader(self._read)
            self._header = archive.header()
            if self._header["internal_compression"] != Compression.GZIP:
                raise SettingError(
                    f"{TILES}={file} has directories that are compressed by "
                    f"{self._header['internal_compression'].name.lower()}: convert it to gzip"
                )
            packing = self._header["tile_compression"]
            if packing not in (Compression.NONE, Compression.UNKNOWN, Compression.GZIP):
                raise SettingError(
                    f"{TILES}={file} has tiles that are compressed by {packing.name.lower()}: "
                    "convert it to images that are not compressed again"
                )
            kind = self._header["tile_type"].name.lower()
            said = archive.metadata()
            attribution = said.get("attribution", "") if isinstance(said, dict) else ""
            self.pictured = Pictured(
                _media_type(file, kind), self._header["max_zoom"], _plain(attribution)
            )
        except SettingError:
            self.close()
            raise
        except (MagicNumberNotFound, SpecVersionUnsupported, *_DAMAGED) as error:
            self.close()
            why = (
                "its version is not 3: convert it with `pmtiles convert`"
                if isinstance(error, SpecVersionUnsupported)
                else str(error) or type(error).__name__
            )
            raise SettingError(f"{TILES}={file} is not a readable PMTiles file: {why}") from error
        self._is_packed = packing == Compression.GZIP
        self._directory = lru_cache(_MOST_DIRECTORIES)(
            lambda offset, length: deserialize_directory(self._read(offset, length))
        )

    def tile(self, zoom: int, column: int, row: int) -> bytes | None:
        """See `MbTiles.tile`. A part of the archive that is damaged has no tiles."""
        if column >> zoom or row >> zoom:
            return None
        try:
            return self._find(zoom, column, row)
        except _DAMAGED as error:
            place = f"{zoom}/{column}/{row}"
            log.warning("%s: tile %s cannot be read: %s", self._file, place, error)
            return None

    def _find(self, zoom: int, column: int, row: int) -> bytes | None:
        from pmtiles.tile import find_tile, zxy_to_tileid  # noqa: PLC0415

        header = self._header
        number = zxy_to_tileid(zoom, column, row)
        offset, length = header["root_offset"], header["root_length"]
        for _ in range(_DEEPEST_DIRECTORY):
            entry = find_tile(self._directory(offset, length), number)
            if entry is None:
                return None
            if entry.run_length:
                data = self._read(header["tile_data_offset"] + entry.offset, entry.length)
                return gzip.decompress(data) if self._is_packed else data
            offset, length = header["leaf_directory_offset"] + entry.offset, entry.length
        raise ValueError("its directories are too deep")

    def _read(self, offset: int, length: int) -> bytes:
        if self._descriptor is None:
            raise ValueError("it is closed")
        data = os.pread(self._descriptor, length, offset)
        if len(data) < length:
            raise EOFError(f"the file ends at byte {offset + len(data)}")
        return data

    def close(self) -> None:
        """Close the file."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            os.close(descriptor)


def _media_type(file: Path, kind: str) -> str:
    """Return the media type of a format of tiles.

    Raises:
        SettingError: it is none of images.
    """
    try:
        return MEDIA_TYPES[kind.lower()]
    except KeyError:
        raise SettingError(
            f"{TILES}={file} has tiles of the format {kind.lower()!r}: the map shows images only "
            f"({', '.join(MEDIA_TYPES)})"
        ) from None


def _plain(attribution: object) -> str:
    return html.unescape(_MARKUP.sub("", str(attribution))).strip()


Tiles: TypeAlias = MbTiles | PmTiles


def open_tiles(file: Path) -> Tiles:
    """Open a file of tiles; its first bytes say which format it has.

    Raises:
        SettingError: the file cannot be read, is neither MBTiles nor PMTiles, or has vector data
            instead of images.
    """
    try:
        with file.open("rb") as opened:
            begins = opened.read(len(_MAGIC))
    except OSError as error:
        raise SettingError(f"{TILES}={file} cannot be read: {error.strerror}") from error
    return PmTiles(file) if begins == _MAGIC else MbTiles(file)
