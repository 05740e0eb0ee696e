"""Make the geoid grid of `m2pem.geo.geoid` again: `python -m tools.geoid_grid egm96_15.gtx`.

The file is that of Debian's package `proj-data`: EGM96 of the NGA (public domain), every 15 minutes
of arc, in the format GTX of NOAA's VDatum. Rows go from south to north, as big-endian 32-bit
floats.
"""

import struct
import sys
import zlib
from array import array
from pathlib import Path

from m2pem.geo.geoid import COLUMNS, GRID_FILE, ROWS

_HEADER = struct.Struct(">4d2i")
_LAYOUT = (-90.0, -180.0, 0.25, 0.25, ROWS, COLUMNS)


def packed(gtx: bytes) -> bytes:
    """Return the grid as the package holds it: see `m2pem.geo.geoid`.

    Raises:
        ValueError: it is another grid.
    """
    layout = _HEADER.unpack_from(gtx)
    if layout != _LAYOUT:
        raise ValueError(f"the grid begins with {layout}; EGM96 every 15 minutes with {_LAYOUT}")
    metres = array("f", gtx[_HEADER.size :])
    if sys.byteorder == "little":
        metres.byteswap()
    rows = [array("h", [0] * COLUMNS)]
    steps = array("h")
    last = 0
    for start in range(0, ROWS * COLUMNS, COLUMNS):
        rows.append(array("h", (round(each * 100) for each in metres[start : start + COLUMNS])))
        for below, here in zip(*rows[-2:], strict=True):
            steps.append(here - below - last)
            last = here - below
    if sys.byteorder == "big":
        steps.byteswap()
    return zlib.compress(steps.tobytes(), 9)


if __name__ == "__main__":
    GRID_FILE.write_bytes(packed(Path(sys.argv[1]).read_bytes()))
