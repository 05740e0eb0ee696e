"""Routes, areas and points that operators have handed over for all runs, with former versions.

The journal keeps them, so that they outlive a restart. A run has its own copy of what it uses, in
its records: nothing here changes a run that is under way.
"""

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence

import msgspec

from m2pem.api.runs import GeometryVersion, HandedOver
from m2pem.errors import JournalError, OperatorError
from m2pem.executive.emergency import WRITTEN_WITHIN_S
from m2pem.geo.geojson import GeometryError, parse_geojson
from m2pem.journal.base import Journal
from m2pem.mission.values import Value

log = logging.getLogger("m2pem.drawings")

MOST_VERSIONS = 20
"""Of one geometry: of more, the oldest are removed."""


class _Written(msgspec.Struct, frozen=True):
    """A version as the journal has it."""

    name: str
    geometry: dict[str, Value] | None
    by: str
    at_us: int


class Drawings:
    """The versions of one fleet's drawings. `now_us`: the executive's clock."""

    def __init__(self, fleet: str, journal: Journal, now_us: Callable[[], int]) -> None:
        self._fleet = fleet
        self._journal = journal
        self._now_us = now_us
        self._versions: dict[str, list[GeometryVersion]] = {}
        self._handed_over: dict[str, HandedOver] = {}
        self._loaded: set[str] = set()
        self._last = 0
        self._unwritten: dict[int, str | None] = {}

    @property
    def handed_over(self) -> Mapping[str, HandedOver]:
        """The latest version of each that was not deleted."""
        return self._handed_over

    @property
    def given_here(self) -> Mapping[str, HandedOver]:
        """Those that were handed over since this executive began."""
        given = self._handed_over.items()
        return {name: each for name, each in given if name not in self._loaded}

    def versions(self, name: str) -> Sequence[GeometryVersion]:
        """Return the versions of a drawing, the newest last."""
        return tuple(self._versions.get(name, ()))

    async def load(self) -> None:
        """Read what former executives were given.

        Raises:
            JournalError: the journal cannot be read.
        """
        for number, text in (await self._journal.drawings(self._fleet)).items():
            self._last = max(self._last, number)
            try:
                read = msgspec.json.decode(text, type=_Written)
                if read.geometry is not None:
                    parse_geojson(read.geometry)
            except (msgspec.MsgspecError, GeometryError) as error:
                log.warning("version %d of a drawing in the journal is left out: %s", number, error)
                continue
            self._loaded.add(read.name)
            self._note(read.name, GeometryVersion(number, read.geometry, read.by, read.at_us))

    def change(self, name: str, geometry: Mapping[str, Value] | None, by: str) -> None:
        """Make a version the latest one at once; None: delete the drawing. `write` keeps it."""
        self._last += 1
        self._loaded.discard(name)
        given = None if geometry is None else dict(geometry)
        version = GeometryVersion(self._last, given, by, self._now_us())
        self._note(name, version)
        written = _Written(name, given, by, version.at_us)
        self._unwritten[version.number] = msgspec.json.encode(written).decode()
        versions = self._versions[name]
        self._unwritten.update((each.number, None) for each in versions[:-MOST_VERSIONS])
        del versions[:-MOST_VERSIONS]

    async def write(self, done: str) -> None:
        """Write what has changed to the journal. `done`: what was done, for the error.

        Raises:
            OperatorError: it is not written in time, or cannot be.
        """
        taken, self._unwritten = self._unwritten, {}
        try:
            async with asyncio.timeout(WRITTEN_WITHIN_S):
                await self._journal.write_drawings(self._fleet, taken)
        except TimeoutError:
            why = f"has not written it within {WRITTEN_WITHIN_S:g} s"
        except JournalError as error:
            why = f"cannot write it: {error}"
        else:
            return
        self._unwritten = {**taken, **self._unwritten}
        raise OperatorError(f"{done} here, but the journal {why}: it may not outlive a restart")

    def _note(self, name: str, version: GeometryVersion) -> None:
        self._versions.setdefault(name, []).append(version)
        if version.geometry is None:
            self._handed_over.pop(name, None)
        else:
            self._handed_over[name] = HandedOver(version.geometry, version.by, version.at_us)
