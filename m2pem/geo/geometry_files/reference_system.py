"""Positions of other coordinate reference systems as WGS 84, and their heights above sea level.

PROJ converts them. Where no transformation of a datum is known, PROJ would leave positions as they
are ("ballpark"), some hundred metres away: such a system is refused, and so is a position outside
the area for which the chosen transformation is meant.
"""

import re
from collections.abc import Mapping, Sequence
from math import isfinite, isinf

from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError, ProjError

from m2pem.geo.geoid import mean_sea_level_m
from m2pem.geo.geometry_files.contents import Contents, FeatureProblemError

MAX_WKT_CHARACTERS = 20_000
_EXPORT = "export it as WGS 84 (EPSG:4326), with heights in metres"
_FILE_OF_ITS_OWN = re.compile(r"PROJ4_GRIDS|PARAMETERFILE|grids=(?!@null)", re.IGNORECASE)
"""A system that names a file: PROJ would open whatever file of this computer that is."""

_AUTHORITY = re.compile(
    r"(?:.*def[:/]crs[:/])?(EPSG|ESRI|IAU|IGNF|OGC)(?:[:/][\w.]*)?[:/](\w+)", re.I
)
_ALIGNED_WITH_WGS84 = frozenset({"China 2000"})
"""Datums that are within a decimetre of WGS 84 by their definition (CGCS2000: ITRF97 at the epoch
2000.0), of which PROJ 9.5 knows no transformation."""

_OF_TIDES = re.compile(
    r"\b(low|high|tid\w+|chart|MLLW|MLW|MHW|LAT|HAT)\b|low.?water|high.?water", re.I
)
"""Vertical datums that are metres away from mean sea level."""


class ReferenceSystem:
    """A coordinate reference system; its positions are read as x (east) and y (north).

    `has_heights`: it says what its Z values are, so that they can be above mean sea level.

    Raises:
        FeatureProblemError: positions of this system cannot be converted; it says why.
    """

    def __init__(self, crs: CRS) -> None:
        self.name = " ".join(crs.name.split())[:80]
        horizontal, self._vertical = (crs, None)
        if crs.is_compound:
            horizontal, self._vertical = crs.sub_crs_list[:2]
        if not (horizontal.is_geographic or horizontal.is_projected):
            raise self._refused(f"is neither geographic nor projected ({horizontal.type_name})")
        if self._vertical is not None and _OF_TIDES.search(_names(self._vertical)):
            raise self._refused(f"has heights above {self._vertical.name!r}, not above sea level")
        axes = (
            horizontal.source_crs or horizontal if horizontal.is_bound else horizontal
        ).axis_info
        self._is_3d = len(axes) == 3
        self.has_heights = self._is_3d or self._vertical is not None
        self._axis = self._vertical.axis_info[0] if self._vertical is not None else axes[-1]
        self._transformer = self._of(horizontal)
        self._accuracies_m: dict[str, float] = {}

    def _of(self, crs: CRS) -> Transformer:
        target = CRS.from_epsg(4979 if self._is_3d else 4326)
        datum = crs.datum or (crs.source_crs.datum if crs.source_crs else None)
        name = datum.name if datum else ""
        aligned = name in _ALIGNED_WITH_WGS84 or (
            # What GDAL writes of a system that says of its datum only the ellipsoid of WGS 84.
            bool(re.search("unknown", name, re.I))
            and "towgs84" not in name.lower()
            and crs.ellipsoid is not None
            and crs.ellipsoid.name.replace("_", " ").replace(" ", "") in ("WGS84", "WGS1984")
        )
        try:
            return Transformer.from_crs(crs, target, always_xy=True, allow_ballpark=aligned)
        except ProjError:
            raise self._refused(
                f"of its datum {name[:80]!r} no transformation to WGS 84 is known"
            ) from None

    def to_wgs84(
        self, positions: Sequence[tuple[float, float, float | None]], frame: str = ""
    ) -> list[list[float]]:
        """Return positions as [longitude, latitude], and the height in metres where one is given.

        `frame`: of the heights, if the file says it beside the reference system; else heights of a
        system that has some are above mean sea level afterwards.

        Raises:
            FeatureProblemError: a position, or a height, cannot be converted.
        """
        if not positions:
            return []
        raw = [0.0 if each[2] is None else each[2] for each in positions]
        converted = self._converted(
            [each[0] for each in positions], [each[1] for each in positions], raw
        )
        result = []
        for (x, y, z), (longitude, latitude, height) in zip(positions, converted, strict=True):
            if not (isfinite(longitude) and isfinite(latitude)):
                raise FeatureProblemError(f"({x:g}, {y:g}) is no place of {self.name!r}", _EXPORT)
            place = [longitude, latitude]
            if z is not None:
                place.append(self._height(z, height, place, frame))
            result.append(place)
        return result

    def warn_of_accuracy(self, contents: Contents, where: str) -> None:
        """Warn of each transformation that was used and is not known to be right within 1 m."""
        for description, accuracy_m in self._accuracies_m.items():
            said = (
                "an accuracy that is not known"
                if accuracy_m < 0
                else f"an accuracy of {accuracy_m:g} m"
            )
            contents.warn(where, f"is converted from {self.name!r} by {description!r} with {said}")

    def _height(self, z: float, converted: float, place: Sequence[float], frame: str) -> float:
        if self.has_heights and self._is_3d and not frame:
            return mean_sea_level_m(place[1], place[0], converted)
        factor: float = self._axis.unit_conversion_factor
        if self._vertical is None and not self._is_3d:
            angular = self._axis.unit_name.lower().startswith(("deg", "grad", "gon", "rad"))
            if z and not angular and factor != 1.0:
                raise FeatureProblemError(
                    f"{self.name!r} is in {self._axis.unit_name!r} and does not say in which unit "
                    f"the height {z:g} is",
                    _EXPORT,
                )
            return z
        return -z * factor if self._axis.direction == "down" else z * factor

    def _converted(
        self, xs: Sequence[float], ys: Sequence[float], zs: Sequence[float]
    ) -> list[tuple[float, float, float]]:
        places = list(zip(*self._transformer.transform(xs, ys, zs), strict=True))
        if self._is_meant_for(places):
            return places
        # PROJ chooses an operation for each position, and names only that of the last one.
        for index, (x, y, z) in enumerate(zip(xs, ys, zs, strict=True)):
            places[index] = self._transformer.transform(x, y, z)
            if not self._is_meant_for(places[index : index + 1]):
                longitude, latitude = places[index][:2]
                raise self._refused(
                    "no transformation to WGS 84 is known for latitude "
                    f"{latitude:.6g}, longitude {longitude:.6g}"
                )
        return places

    def _is_meant_for(self, places: Sequence[tuple[float, float, float]]) -> bool:
        try:
            operation = self._transformer.get_last_used_operation()
        except ProjError:  # there is only one, and it changes nothing (pyproj 3.7)
            operation = self._transformer
        if operation.accuracy == 0.0 or any(isinf(each[0]) for each in places):
            return True
        area = operation.area_of_use
        if area is not None:
            wraps = area.west > area.east
            for longitude, latitude, _ in places:
                east, west = longitude <= area.east, longitude >= area.west
                if not (
                    area.south <= latitude <= area.north
                    and (east or west if wraps else east and west)
                ):
                    return False
        if not 0.0 <= operation.accuracy <= 1.0:
            steps = [
                each for each in operation.description.split(" + ") if "axis order" not in each
            ]
            self._accuracies_m[steps[-1] if steps else operation.description] = operation.accuracy
        return True

    def _refused(self, why: str) -> FeatureProblemError:
        return FeatureProblemError(
            f"is of {self.name!r}, which cannot be converted: {why}", _EXPORT
        )


def system_of_wkt(text: str) -> ReferenceSystem:
    """Return the system of a .prj: WKT as Esri or GDAL write it, or WKT 2 (OGC 18-010r7).

    Raises:
        FeatureProblemError: it is none, or one whose positions cannot be converted.
    """
    name = " ".join(text.partition('"')[2].partition('"')[0].split())[:80]
    if len(text) > MAX_WKT_CHARACTERS or _FILE_OF_ITS_OWN.search(text):
        raise FeatureProblemError(f"its .prj {name!r} refers to a grid, or is too long", _EXPORT)
    try:
        return ReferenceSystem(CRS.from_wkt(text))
    except CRSError as error:
        raise FeatureProblemError(
            f"its .prj {name!r} cannot be read: {str(error)[:120]}", _EXPORT
        ) from None


def system_of_geojson(crs: object) -> ReferenceSystem:
    """Return the system that the member `crs` of GeoJSON of 2008 names, such as EPSG:25832.

    Raises:
        FeatureProblemError: it names none by authority and code, or one that cannot be converted.
    """
    properties = crs.get("properties") if isinstance(crs, Mapping) else None
    given = properties if isinstance(properties, Mapping) else {}
    name = f"EPSG:{given['code']}" if "code" in given else str(given.get("name", ""))
    found = _AUTHORITY.fullmatch(name.strip())
    if found is None:
        raise FeatureProblemError(
            f"its 'crs' {(name or str(crs))[:80]!r} is not known", "name it as EPSG:25832, say"
        )
    try:
        return ReferenceSystem(CRS.from_authority(found[1].upper(), found[2]))
    except CRSError:
        raise FeatureProblemError(
            f"its 'crs' {name[:80]!r} is not known to PROJ", _EXPORT
        ) from None


def _names(vertical: CRS) -> str:
    return f"{vertical.name} {vertical.datum.name if vertical.datum else ''}".replace("_", " ")
