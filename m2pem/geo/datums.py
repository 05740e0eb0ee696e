"""How the positions of a coordinate reference system become WGS 84, and its heights altitudes above
mean sea level (EGM96).

Those of a system that says nothing of heights are taken as they are. Heights above the ellipsoid
are converted by the geoid; the ellipsoids of WGS 84, ITRF, ETRS89 and NAD83 are taken as
the same (at most 2 m apart). Heights of another vertical datum are converted by PROJ where it has
the grid for it; without the grid, those of `NEAR` are taken as they are.
"""

import re
from collections.abc import Callable, Collection
from functools import cache

from pyproj import CRS, Transformer
from pyproj.crs import CompoundCRS
from pyproj.exceptions import ProjError

from m2pem.geo.geoid import mean_sea_level_m
from m2pem.geo.local_frame import SEMI_MAJOR_M

ToSeaLevel = Callable[[float, float, float], float]
"""Makes latitude, longitude and a height in metres an altitude above mean sea level; NaN or
infinite: not known there."""

_SEA_LEVEL = (5773, 5714)
"""EPSG's vertical systems "EGM96 height" and "MSL height"."""

# NAVD88, NGVD29, CGVD28, CGVD2013.
_NORTH_AMERICA = (5703, 5702, 5713, 6647, 9245, 20035)
# EVRF; Germany, Austria, Switzerland, France, the Netherlands.
_EUROPE = (5730, 5621, 9389, 9390, 9651, 9274, 5783, 5784, 7837, 5778, 5728, 5729, 5720, 5709)
# Great Britain, Ireland, Norway, Sweden, Finland, Denmark, Spain, Portugal, Italy; Baltic 1977.
_COASTS = (5701, 5732, 5731, 5776, 5941, 5613, 3900, 5717, 5733, 5782, 5780, 5214, 5705)
# Australia, New Zealand, Japan, China, South Africa.
_SOUTH_AND_EAST = (5711, 5712, 9458, 7839, 5723, 6694, 6695, 5737, 9279)
_EGM2008 = 3855
NEAR = frozenset({_EGM2008, *_NORTH_AMERICA, *_EUROPE, *_COASTS, *_SOUTH_AND_EAST})
"""EPSG's vertical systems, one of each datum, whose zero is within about 2 m of mean sea level by
EGM96 (EGM2008 mostly within 1 m, in high mountains and Antarctica several)."""


class DatumError(ValueError):
    """Heights cannot be converted; the text says which, and what would be right."""


def to_wgs84(crs: CRS) -> Transformer:
    """Return the conversion of a system's x (east), y (north), and height if it is
    three-dimensional, to WGS-84 longitude, latitude and height.

    Raises:
        DatumError: it is not known how the system lies on the Earth.
    """
    own = unbound(crs)
    target = "EPSG:4979" if len(own.axis_info) > 2 else "EPSG:4326"
    datum = own.datum.name if own.datum else ""
    try:
        return Transformer.from_crs(crs, target, always_xy=True, allow_ballpark=False)
    except ProjError:
        # Of a datum without a known conversion, which on this ellipsoid is near to WGS 84, if it
        # does not name one: GDAL 3.12 writes parameters into the name of the datum.
        near = own.ellipsoid is not None and own.ellipsoid.semi_major_metre == SEMI_MAJOR_M
        if near and "towgs84" not in datum.lower():
            return Transformer.from_crs(crs, target, always_xy=True)
    raise DatumError(f"of its datum {datum[:80]!r} no transformation to WGS 84 is known")


def heights_of(crs: CRS) -> tuple[float, ToSeaLevel]:
    """Return the unit of a system's heights, in metres (1 if it has none, negative: they count
    downwards), and what makes heights in metres altitudes above mean sea level.

    Raises:
        DatumError: they count from something that is not known.
    """
    horizontal, *vertical = map(unbound, crs.sub_crs_list if crs.is_compound else [crs])
    if horizontal.is_geocentric:
        raise DatumError(f"'{crs.name}' has no heights: use geographic or projected coordinates")
    if not vertical:
        if len(horizontal.axis_info) < 3:
            return 1.0, _as_it_is
        return horizontal.axis_info[2].unit_conversion_factor, mean_sea_level_m
    # GDAL 3.10 writes a system of EPSG with its name, and sometimes with the datum of another one.
    code = _codes().get(vertical[0].name)
    heights = vertical[0] if code is None else CRS.from_epsg(code)
    datum = _datum(heights)
    convert = _as_it_is if datum in _datums(_SEA_LEVEL) else _by_grid(heights)
    if convert is None and datum in _datums(NEAR):
        convert = _as_it_is
    if convert is None:
        raise DatumError(
            f"its heights are of '{vertical[0].name}', of which the distance to mean sea level is"
            " not known"
        )
    return _unit_m(vertical[0]), convert


def unbound(crs: CRS) -> CRS:
    """Return a system without the transformation that its text names."""
    return crs.source_crs if crs.is_bound and crs.source_crs is not None else crs


def _datum(vertical: CRS) -> str:
    """Return the name of its datum without what differs between Esri's and EPSG's."""
    return re.sub(r"[\W_]+", "", vertical.datum.name).lower() if vertical.datum else ""


def _unit_m(vertical: CRS) -> float:
    axis = vertical.axis_info[0]
    return axis.unit_conversion_factor * (-1 if axis.direction == "down" else 1)


@cache
def _codes() -> dict[str, int]:
    return {CRS.from_epsg(code).name: code for code in (*_SEA_LEVEL, *NEAR)}


@cache
def _datums(codes: Collection[int]) -> frozenset[str]:
    return frozenset(_datum(CRS.from_epsg(code)) for code in codes)


def _as_it_is(_latitude_deg: float, _longitude_deg: float, height_m: float) -> float:
    return height_m


def _by_grid(vertical: CRS) -> ToSeaLevel | None:
    """Return the conversion by PROJ; None: it has no grid for it here."""
    unit_m = _unit_m(vertical)
    system = CompoundCRS(vertical.name, [CRS("EPSG:4326"), vertical])
    try:
        # Without `allow_ballpark`, PROJ gives heights back as they were where a grid is missing.
        to_ellipsoid = Transformer.from_crs(
            system, "EPSG:4979", always_xy=True, allow_ballpark=False
        )
    except ProjError:
        return None

    def convert(latitude_deg: float, longitude_deg: float, height_m: float) -> float:
        _, _, ellipsoidal_m = to_ellipsoid.transform(longitude_deg, latitude_deg, height_m / unit_m)
        return mean_sea_level_m(latitude_deg, longitude_deg, ellipsoidal_m)

    return convert
