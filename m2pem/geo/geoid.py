"""The geoid: how high mean sea level is above the WGS-84 ellipsoid, by EGM96.

Inside m2pem, an altitude is above mean sea level (EGM96), as MAVLink, KML and people's maps have
it. ROS's NavSatFix, CoT's `hae` and ECEF count from the ellipsoid; the two differ by -107 to +85 m.
What goes in or out there is converted here.

The grid is that of the NGA, every 15 minutes of arc, bilinear between: within 0.01 m of PROJ with
the same grid, and within 0.7 m of EGM96 itself. Its file holds centimetres as little-endian 16-bit
integers from south to north and from -180 degrees eastwards, each less that of the row below, and
that less its neighbor's, compressed by zlib (`tools/geoid_grid.py` makes it).
"""

import math
import sys
import zlib
from array import array
from functools import cache
from itertools import accumulate
from operator import add
from pathlib import Path

ROWS, COLUMNS = 721, 1440
GRID_FILE = Path(__file__).with_name("egm96_15.bin")

_PER_DEGREE = 4


def undulation_m(latitude_deg: float, longitude_deg: float) -> float:
    """Return the height of mean sea level above the ellipsoid, in metres.

    NaN: it is no place (a latitude beyond the poles, or what is not finite).
    """
    if not (-90.0 <= latitude_deg <= 90.0 and math.isfinite(longitude_deg)):
        return math.nan
    row = (latitude_deg + 90.0) * _PER_DEGREE
    column = (longitude_deg + 180.0) % 360.0 * _PER_DEGREE
    below, left = min(int(row), ROWS - 2), int(column)
    up, right = row - below, column - left
    left %= COLUMNS
    start, step = below * COLUMNS + left, 1 if left < COLUMNS - 1 else 1 - COLUMNS
    cm = _grid_cm()
    south = cm[start] + (cm[start + step] - cm[start]) * right
    start += COLUMNS
    north = cm[start] + (cm[start + step] - cm[start]) * right
    return (south + (north - south) * up) / 100


def mean_sea_level_m(latitude_deg: float, longitude_deg: float, ellipsoidal_m: float) -> float:
    """Return the altitude above mean sea level of a height above the ellipsoid."""
    return ellipsoidal_m - undulation_m(latitude_deg, longitude_deg)


def ellipsoidal_m(latitude_deg: float, longitude_deg: float, mean_sea_level_m: float) -> float:
    """Return the height above the ellipsoid of an altitude above mean sea level."""
    return mean_sea_level_m + undulation_m(latitude_deg, longitude_deg)


@cache
def _grid_cm() -> "array[int]":
    """Return the undulations. Read once, within 0.2 s, when the first is asked for."""
    steps = array("h", zlib.decompress(GRID_FILE.read_bytes()))
    if sys.byteorder == "big":
        steps.byteswap()
    rises = array("h", accumulate(steps))
    grid = array("h", rises[:COLUMNS])
    for start in range(COLUMNS, len(rises), COLUMNS):
        grid.extend(map(add, grid[-COLUMNS:], rises[start : start + COLUMNS]))
    return grid
