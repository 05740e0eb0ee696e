"""All versions of a mission that were saved or found, in a hidden folder beside the missions."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import msgspec

from m2pem_plugin_web.missions.writing import write

FOLDER = ".versions"
_FILE = re.compile(r"(\d{6,})\.json")


def version_of(source: bytes) -> str:
    """What tells one content from another."""
    return sha256(source).hexdigest()[:16]


@dataclass(frozen=True, slots=True)
class Version:
    """One of them. `by`: who saved it, "" for what was found on the disk; `deleted`: it was the
    last one before the mission was deleted. Times are microseconds since the Unix epoch."""

    number: int
    version: str
    saved_at_us: int
    by: str
    deleted: bool = False


class Versions:
    """Those of one mission, the oldest first. Numbers count from 1."""

    def __init__(self, missions: Path, name: str) -> None:
        self._folder = missions / FOLDER / name

    def all(self) -> Sequence[Version]:
        """Every one."""
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
        """The content of one; None: there is none of that number."""
        try:
            return self._path(number, "bpmn").read_bytes()
        except FileNotFoundError:
            return None

    def add(self, source: bytes, at_us: int, by: str, *, deleted: bool = False) -> Version:
        """Keep a content; nothing is new if it is that of the newest one."""
        known = self.all()
        version = version_of(source)
        newest = known[-1] if known else None
        if newest is not None and newest.version == version and not (by or deleted):
            return newest
        number = newest.number + 1 if newest is not None else 1
        self._folder.mkdir(parents=True, exist_ok=True)
        kept = Version(number, version, at_us, by, deleted)
        # The content comes first: what has a description is there.
        write(self._path(number, "bpmn"), source)
        write(self._path(number, "json"), msgspec.json.encode(kept))
        return kept

    def _path(self, number: int, suffix: str) -> Path:
        return self._folder / f"{number:06d}.{suffix}"
