"""Routes, areas and points that operators have handed over for all runs, with former versions; and
those that one run has alone.

The journal keeps them, so that they outlive a restart. A run has its own copy of what it uses, in
its records: nothing here changes a run that is under way.
"""

import asyncio
import json
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress

import msgspec

from m2pem.api.runs import GeometryVersion, HandedOver
from m2pem.engine.state import RunState
from m2pem.errors import StaleDrawingsError
from m2pem.executive.emergency import written_in_time
from m2pem.fleet.fleet import Fleet
from m2pem.geo.geojson import GeometryError, parse_geojson
from m2pem.journal.base import Journal
from m2pem.mission.geometry import Area, Geometry, Point, Route
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
    """The versions of one fleet's drawings. `now_us`: the executive's clock.

    Those of a simulated fleet are kept apart. It begins with what the real one of its name has, and
    changes nothing of that.
    """

    def __init__(self, fleet: Fleet, journal: Journal, now_us: Callable[[], int]) -> None:
        self._fleet = fleet
        self._journal = journal
        self._now_us = now_us
        self._versions: dict[str, list[GeometryVersion]] = {}
        self._handed_over: dict[str, HandedOver] = {}
        self._loaded: set[str] = set()
        self._last = 0
        self._unwritten: dict[int, str | None] = {}
        self._last_kept: int | None = None
        self._writing = asyncio.Lock()

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

    @property
    def names(self) -> Sequence[str]:
        """The names that have versions, also of those that were deleted."""
        return tuple(self._versions)

    @property
    def geometries(self) -> Mapping[str, Geometry]:
        """Those that missions may name now."""
        return {name: parse_geojson(each.geometry) for name, each in self._handed_over.items()}

    @property
    def drawn_by(self) -> Mapping[str, str]:
        """Who has handed over which of them."""
        return {name: each.by for name, each in self._handed_over.items()}

    async def load(self) -> None:
        """Read what other executives were given. What is not written yet of this one is newer.

        Raises:
            JournalError: the journal cannot be read; it is read before the next version is written.
        """
        fleet = self._fleet
        kept = await self._journal.drawings(fleet.kept_as)
        real = await self._journal.drawings(fleet.name) if fleet.kept_as != fleet.name else {}
        # From here on nothing is awaited: what is given meanwhile has the numbers after these.
        here = set(self.given_here)
        given = sorted(
            (
                (each, name)
                for name, versions in self._versions.items()
                for each in versions
                if self._unwritten.get(each.number) is not None
            ),
            key=lambda version: version[0].number,
        )
        self._versions, self._handed_over, self._unwritten = {}, {}, {}
        self._last = self._last_kept = max(kept, default=0)
        for version, name in _read(kept):
            self._note(name, version)
        for version, name in _read(real):
            own = self._versions.get(name)
            if own is None or own[-1].at_us < version.at_us:
                self._hand_over(name, version)
        self._loaded = self._handed_over.keys() - here
        written = [(name, each.geometry, each.by, each.at_us) for each, name in _read(kept)]
        for version, name in given:
            if (name, version.geometry, version.by, version.at_us) in written:
                continue  # its writing was given up, and was done all the same
            self._add(name, version.geometry, version.by, version.at_us)

    def change(self, name: str, geometry: Mapping[str, Value] | None, by: str) -> None:
        """Make a version the latest one at once; None: delete the drawing. `write` keeps it."""
        self._add(name, geometry, by, self._now_us())

    def _add(self, name: str, geometry: Mapping[str, Value] | None, by: str, at_us: int) -> None:
        self._last += 1
        self._loaded.discard(name)
        geometry = None if geometry is None else dict(geometry)
        version = GeometryVersion(self._last, geometry, by, at_us)
        self._note(name, version)
        written = _Written(name, geometry, by, at_us)
        self._unwritten[version.number] = msgspec.json.encode(written).decode()
        versions = self._versions[name]
        self._unwritten.update((each.number, None) for each in versions[:-MOST_VERSIONS])
        del versions[:-MOST_VERSIONS]

    async def write(self, done: str) -> None:
        """Write what has changed to the journal. `done`: what was done, for the error.

        Raises:
            OperatorError: it is not written in time, or cannot be.
        """
        await written_in_time(self._write, done)

    async def _write(self) -> None:
        async with self._writing:
            while True:
                if self._last_kept is None:
                    await self.load()
                taken, self._unwritten = self._unwritten, {}
                if not taken:
                    return  # the one before has written it
                last = self._last_kept or 0
                try:
                    await self._journal.write_drawings(self._fleet.kept_as, taken, last=last)
                except BaseException as error:
                    # The next one writes it: who asked for it may be gone.
                    self._unwritten = {**taken, **self._unwritten}
                    # Whether the journal has what was on its way is not known.
                    self._last_kept = None
                    if not isinstance(error, StaleDrawingsError):
                        raise
                else:
                    self._last_kept = max((last, *taken))
                    return

    def _note(self, name: str, version: GeometryVersion) -> None:
        self._versions.setdefault(name, []).append(version)
        self._hand_over(name, version)

    def _hand_over(self, name: str, version: GeometryVersion) -> None:
        if version.geometry is None:
            self._handed_over.pop(name, None)
        else:
            self._handed_over[name] = HandedOver(version.geometry, version.by, version.at_us)


def _read(kept: Mapping[int, str]) -> Iterator[tuple[GeometryVersion, str]]:
    """Yield the versions that a journal has, each with the name of its drawing."""
    for number, text in kept.items():
        try:
            read = msgspec.json.decode(text, type=_Written)
            if read.geometry is not None:
                parse_geojson(read.geometry)
        except (msgspec.MsgspecError, GeometryError) as error:
            log.warning("version %d of a drawing in the journal is left out: %s", number, error)
            continue
        yield GeometryVersion(number, read.geometry, read.by, read.at_us), read.name


def own_geometries(
    state: RunState, handed_over: Mapping[str, HandedOver], of_all: Mapping[str, Geometry]
) -> dict[str, Route | Area | Point]:
    """Return what a run's tasks get by name and other runs do not.

    `handed_over`: the latest of operators for all runs; `of_all`: those and the fleet file's.
    """
    used: dict[str, Geometry] = dict(state.mission.geometries)
    for name, geometry in state.geometries.items():
        latest = handed_over.get(name)
        if name in used or latest is None or latest.geometry != geometry:
            with suppress(GeometryError):  # one of an older release, which this one does not read
                used[name] = parse_geojson(geometry)
    for scope in state.scopes.values():
        for name in state.mission.remaining_names & scope.data.keys():
            with suppress(GeometryError, ValueError, TypeError):  # the name of one, or nothing left
                used[name] = parse_geojson(json.loads(scope.data[name]))  # type: ignore[arg-type]
    return {
        name: geometry
        for name, geometry in used.items()
        if isinstance(geometry, Route | Area | Point) and geometry != of_all.get(name)
    }
