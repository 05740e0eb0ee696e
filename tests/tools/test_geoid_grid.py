import struct
import zlib
from array import array

import pytest

from m2pem.geo.geoid import COLUMNS, GRID_FILE, ROWS, undulation_m
from tools.geoid_grid import packed


def test_the_grid_of_the_package_is_made_again_from_its_values() -> None:
    values = [
        undulation_m(row / 4 - 90, column / 4 - 180)
        for row in range(ROWS)
        for column in range(COLUMNS)
    ]
    metres = array("f", values)
    metres.byteswap()
    gtx = struct.pack(">4d2i", -90, -180, 0.25, 0.25, ROWS, COLUMNS) + metres.tobytes()

    assert zlib.decompress(packed(gtx)) == zlib.decompress(GRID_FILE.read_bytes())


def test_another_grid_is_refused() -> None:
    with pytest.raises(ValueError, match="EGM96 every 15 minutes"):
        packed(struct.pack(">4d2i", -90, -180, 1, 1, 181, 360))
