"""What a file of geometries holds: named routes, areas and points, and what is wrong with it."""

import re
import unicodedata
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice

from m2pem.findings import Severity
from m2pem.geo.geojson import GeometryError, above_sea_level, kind_of
from m2pem.geo.positions import positions
from m2pem.mission.geometry import Area, Point, Route

MAX_FEATURES = 1_000
MAX_POSITIONS = 200_000
MAX_NAME_CHARACTERS = 100
MAX_PROBLEMS = 100
"""Of a file: of more, only their number is told."""

_NO_NAME = re.compile(r"[^\w.\-]+")


@dataclass(frozen=True, slots=True)
class NamedGeometry:
    """A geometry with the name by which missions may call it."""

    name: str
    geometry: Point | Route | Area


@dataclass(frozen=True, slots=True)
class FileProblem:
    """What is wrong with a file, or with one feature of it, and what would be right.

    ERROR: the feature was left out. WARNING: it was read, and something of it was not kept.
    `feature`: how people find it in the file; "" means the whole file. `kind`: the geometries that
    it is about, "route", "area" or "point"; "": any.
    """

    severity: Severity
    feature: str
    message: str
    remedy: str = ""
    kind: str = ""

    def __str__(self) -> str:
        where = f"{self.feature}: " if self.feature else ""
        remedy = f"; {self.remedy}" if self.remedy else ""
        return f"{where}{self.message}{remedy}"


@dataclass(frozen=True, slots=True)
class GeometryFile:
    """What was read of a file. Each geometry is whole, and has a name of its own."""

    geometries: tuple[NamedGeometry, ...]
    problems: tuple[FileProblem, ...]


class Contents:
    """Collects the geometries and problems of one file.

    `stem`: the file's name without suffix; `kind`: that of geometries of which the file does not
    say it, "": not known; `is_full`: a feature was beyond the limit, the rest need not be read.
    """

    def __init__(self, stem: str, kind: str = "") -> None:
        self.kind = kind
        self.is_full = False
        self._stem = stem
        self._geometries: list[NamedGeometry] = []
        self._names: set[str] = set()
        self._problems: dict[FileProblem, None] = {}
        self._untold = 0
        self._has_error = False
        self._positions = 0

    @contextmanager
    def feature(self, name: str, kind: str = "") -> Iterator[None]:
        """Turn a `GeometryError` of the block into a problem of the feature with that name."""
        try:
            yield
        except GeometryError as error:
            self.note(FileProblem(Severity.ERROR, name, str(error), error.remedy, kind))

    def add(self, name: str, geometry: Point | Route | Area) -> None:
        """Add a geometry under a valid and unique form of its name, with altitudes above mean sea
        level in place of those above the ellipsoid.

        Raises:
            GeometryError: the file has too many features or positions.
        """
        if len(self._geometries) >= MAX_FEATURES:
            self.is_full = True
            raise GeometryError(f"is beyond the first {MAX_FEATURES} features", "split the file")
        self._positions += self.expect(positions(geometry))
        self._geometries.append(
            NamedGeometry(self._unique(name, geometry), above_sea_level(geometry))
        )

    def expect(self, positions: Iterable[object]) -> int:
        """Count positions that are to come, or what stands for each, before the work of reading
        them.

        Raises:
            GeometryError: the file has too many; no more of them are looked at.
        """
        count = sum(1 for _ in islice(positions, MAX_POSITIONS + 1))
        if self._positions + count > MAX_POSITIONS:
            raise GeometryError(
                f"the file has more than {MAX_POSITIONS:,} positions", "simplify its lines"
            )
        return count

    def warn(self, feature: str, message: str, remedy: str = "", kind: str = "") -> None:
        """Add a warning: the feature was read, and something of it was not kept."""
        self.note(FileProblem(Severity.WARNING, feature, message, remedy, kind))

    def note(self, problem: FileProblem) -> None:
        """Add a problem, once, if the file has not too many."""
        if problem in self._problems:
            return
        self._has_error = self._has_error or problem.severity is Severity.ERROR
        if len(self._problems) < MAX_PROBLEMS:
            self._problems[problem] = None
        else:
            self._untold += 1

    def whole(self) -> GeometryFile:
        """Return what was collected. A file of which nothing could be read has an error."""
        if not self._geometries and not self._has_error:
            remedy = "" if self._problems else "export the features, not links to them or styles"
            nothing = FileProblem(Severity.ERROR, "", "has no route, area or point", remedy)
            self._problems[nothing] = None
        if self._untold:
            message = f"has {self._untold:,} problems more"
            self._problems[FileProblem(Severity.ERROR, "", message, "mend these first")] = None
        return GeometryFile(tuple(self._geometries), tuple(self._problems))

    def _unique(self, name: str, geometry: Point | Route | Area) -> str:
        valid = valid_name(name) or valid_name(self._stem) or kind_of(geometry)
        unique, number = valid, 1
        while unique in self._names:
            number += 1
            suffix = f"_{number}"
            unique = valid[: MAX_NAME_CHARACTERS - len(suffix)] + suffix
        self._names.add(unique)
        return unique


def valid_name(text: str) -> str:
    """Return a text as a name of fleets and missions: letters, digits, `-`, `_` and points.

    It is "" if nothing of the text can be kept.
    """
    name = _NO_NAME.sub("_", unicodedata.normalize("NFC", text))
    return name.strip("._")[:MAX_NAME_CHARACTERS].rstrip(".")
