"""Positions of other coordinate reference systems as WGS 84, and their heights above sea level.

PROJ converts them. Where no transformation of a datum is known, PROJ would leave positions as they
are ("ballpark"), some hundred metres away: such a system is refused, and so is a position outside
the area for which the chosen transformation is meant.
"""

import re
from collections.abc import Sequence
from functools import cached_property
from math import isfinite

from pyproj import CRS
from pyproj.exceptions import CRSError, ProjError

from m2pem.geo.datums import DatumError, ToSeaLevel, heights_of, to_wgs84, unbound
from m2pem.geo.geojson import GeometryError, crs_name
from m2pem.geo.geometry_files.contents import Contents

MAX_WKT_CHARACTERS = 20_000
_EXPORT = "export it as WGS 84 (EPSG:4326), with heights in metres"
_EXPORT_HEIGHTS = "export it with EGM96 heights (EPSG:4326+5773)"
_NAMES_A_FILE = re.compile(r"PROJ4_GRIDS|PARAMETERFILE|grids=(?!@null)", re.IGNORECASE)
"""A system that names a file: PROJ would open whatever file of this computer that is."""

_AUTHORITY = re.compile(
    r"(?:.*def[:/]crs[:/])?(EPSG|ESRI|IAU|IGNF|OGC)(?:[:/][\w.]*)?[:/](\w+)", re.I
)
_SHIFT = re.compile(r'"Vertical_Shift"\s*,\s*([-+.\dEe]+)', re.IGNORECASE)
_ANGLE = re.compile(r"deg|grad|gon|rad", re.I)


class ReferenceSystem:
    """A coordinate reference system; its positions are read as x (east) and y (north).

    `has_heights`: it says what its Z values are, so that they can be above mean sea level.

    Raises:
        GeometryError: positions of this system cannot be converted; it says why.
    """

    def __init__(self, crs: CRS) -> None:
        self.name = " ".join(crs.name.split())[:80]
        self._crs = crs
        horizontal = crs.sub_crs_list[0] if crs.is_compound else crs
        if not (horizontal.is_geographic or horizontal.is_projected):
            raise self._refused(f"is neither geographic nor projected ({horizontal.type_name})")
        own = unbound(horizontal)
        self._is_3d = len(own.axis_info) == 3
        self.has_heights = self._is_3d or crs.is_compound
        self._axis = own.axis_info[0]
        try:
            self._transformer = to_wgs84(horizontal)
        except DatumError as error:
            raise self._refused(str(error)) from None
        self._accuracies_m: dict[str, float] = {}

    def to_wgs84(self, positions: Sequence[Sequence[float]], frame: str = "") -> list[list[float]]:
        """Return positions as [longitude, latitude], and the height in metres where one is given.

        `frame`: of the heights, if the file says it beside the reference system; else heights of a
        system that has some are above mean sea level afterwards.

        Raises:
            GeometryError: a position, or a height, cannot be converted.
        """
        result = []
        for given, (longitude, latitude, height) in zip(
            positions, self._converted(positions), strict=True
        ):
            place = [longitude, latitude]
            if len(given) > 2 and frame:
                place.append(given[2] * self._unit_m(given[2]))
            elif len(given) > 2:
                height_m = height if self._is_3d else given[2] * self._unit_m(given[2])
                place.append(self._heights[1](latitude, longitude, height_m))
                if not isfinite(place[2]):
                    what = f"the height {given[2]:g} at ({longitude:.10g}, {latitude:.10g})"
                    raise self._refused(f"of {what} no transformation is known")
            result.append(place)
        return result

    def warn_of_accuracy(self, contents: Contents, where: str) -> None:
        """Warn of each transformation that was used and is not known to be right within 1 m."""
        for description, accuracy_m in self._accuracies_m.items():
            accuracy = f"of {accuracy_m:g} m" if accuracy_m >= 0 else "that is not known"
            message = f"is converted from {self.name!r} by {description!r} with an accuracy"
            contents.warn(where, f"{message} {accuracy}")

    @cached_property
    def _heights(self) -> tuple[float, ToSeaLevel]:
        try:
            return heights_of(self._crs)
        except DatumError as error:
            raise GeometryError(str(error), _EXPORT_HEIGHTS) from None

    def _unit_m(self, height: float) -> float:
        is_metre = self._axis.unit_conversion_factor == 1.0 or _ANGLE.match(self._axis.unit_name)
        if height and not (self.has_heights or is_metre):
            what = f"{self.name!r} is in {self._axis.unit_name!r} and does not say in which"
            raise GeometryError(f"{what} unit the height {height:g} is", _EXPORT)
        return self._heights[0]

    def _converted(
        self, positions: Sequence[Sequence[float]]
    ) -> Sequence[tuple[float, float, float]]:
        rows = [(each[0], each[1], each[2] if len(each) > 2 else 0.0) for each in positions]
        xs, ys, zs = ([row[axis] for row in rows] for axis in range(3))
        places = list(zip(*self._transformer.transform(xs, ys, zs), strict=True))
        if self._is_meant_for(places):
            return places
        # PROJ chooses an operation for each position, and names only that of the last one.
        for index, row in enumerate(rows):
            places[index] = self._transformer.transform(row[0], row[1], row[2])
            if not self._is_meant_for(places[index : index + 1]):
                place = f"({row[0]:.10g}, {row[1]:.10g})"
                raise self._refused(f"no transformation to WGS 84 is known for {place}")
        return places

    def _is_meant_for(self, places: Sequence[tuple[float, float, float]]) -> bool:
        if not all(isfinite(each[0]) and isfinite(each[1]) for each in places):
            return False
        try:
            operation = self._transformer.get_last_used_operation()
        except ProjError:  # there is only one, and it changes nothing (pyproj 3.7)
            operation = self._transformer
        area = operation.area_of_use
        if area is not None and operation.accuracy != 0.0:
            width = (area.east - area.west) % 360 or 360
            for longitude, latitude, _ in places:
                is_within = (longitude - area.west) % 360 <= width
                if not (is_within and area.south <= latitude <= area.north):
                    return False
        if not 0.0 <= operation.accuracy <= 1.0:
            steps = operation.description.split(" + ")
            used = [each for each in steps if "axis order" not in each][-1:] or steps
            self._accuracies_m[used[0]] = operation.accuracy
        return True

    def _refused(self, why: str) -> GeometryError:
        message = f"is of {self.name!r}, which cannot be converted: {why}"
        return GeometryError(message, _EXPORT)


def system_of_wkt(text: str) -> ReferenceSystem:
    """Return the system of a .prj: WKT as Esri or GDAL write it, or WKT 2 (OGC 18-010r7).

    Raises:
        GeometryError: it is none, or one whose positions cannot be converted.
    """
    name = " ".join(text.partition('"')[2].partition('"')[0].split())[:80]
    if len(text) > MAX_WKT_CHARACTERS or _NAMES_A_FILE.search(text):
        raise GeometryError(f"its .prj {name!r} refers to a grid, or is too long", _EXPORT)
    if (shift := _SHIFT.search(text)) and shift[1].strip("+-0.Ee"):
        message = f"its .prj {name!r} shifts heights by {shift[1]}, which PROJ leaves out"
        raise GeometryError(message, _EXPORT_HEIGHTS)
    try:
        return ReferenceSystem(CRS.from_wkt(text))
    except CRSError as error:
        message = f"its .prj {name!r} cannot be read: {str(error)[:120]}"
        raise GeometryError(message, _EXPORT) from None


def system_named(crs: object) -> ReferenceSystem:
    """Return a system by its name, such as EPSG:25832, or by the `crs` of GeoJSON of 2008.

    Raises:
        GeometryError: it names none by authority and code, or one that cannot be converted.
    """
    name = crs_name(crs)
    found = _AUTHORITY.fullmatch(name)
    if found is None:
        message = f"its 'crs' {(name or str(crs))[:80]!r} is not known"
        raise GeometryError(message, "name it as EPSG:25832, say")
    try:
        return ReferenceSystem(CRS.from_authority(found[1].upper(), found[2]))
    except CRSError:
        message = f"its 'crs' {name[:80]!r} is not known to PROJ"
        raise GeometryError(message, _EXPORT) from None
