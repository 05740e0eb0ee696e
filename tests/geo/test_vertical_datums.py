"""What of a coordinate system's heights is known; those of files are in test_elevation_files."""

import struct
import subprocess
import sys
from pathlib import Path

import pytest
from pyproj import CRS

from m2pem.geo.vertical_datums import NEAR, DatumError, heights_of


@pytest.mark.parametrize("code", sorted(NEAR))
def test_what_is_taken_as_near_is_a_height_of_epsg_and_no_depth(code: int) -> None:
    vertical = CRS.from_epsg(code)
    assert vertical.is_vertical
    unit_m, _ = heights_of(CRS(f"EPSG:4326+{code}"))
    assert unit_m == vertical.axis_info[0].unit_conversion_factor


def test_the_unit_of_the_plane_is_not_that_of_heights() -> None:
    unit_m, to_sea_level = heights_of(CRS("EPSG:2263"))  # in US survey feet
    assert unit_m == 1.0
    assert to_sea_level(40.7, -74.0, 60.0) == 60.0


def test_depths_are_refused() -> None:
    with pytest.raises(DatumError, match="'MSL depth' counts depths"):
        heights_of(CRS("EPSG:4326+5715"))


CONVERTS = """
import sys, pyproj
from m2pem.geo.vertical_datums import heights_of
pyproj.datadir.append_data_dir(sys.argv[1])
_, to_sea_level = heights_of(pyproj.CRS("EPSG:4326+3855"))
print(to_sea_level(38.1075, -77.3192, 60.0))
"""


def test_where_proj_has_the_grid_it_converts(tmp_path: Path) -> None:
    # A grid under the name of EGM2008's, 30 m everywhere: 60 m above it are 90 m above the
    # ellipsoid, and 123.97 m above mean sea level.
    grid = struct.pack(">4d2i", -90, -180, 1, 1, 181, 361) + struct.pack(">f", 30) * 181 * 361
    (tmp_path / "egm08_25.gtx").write_bytes(grid)
    # In a process of its own: where PROJ looks is of the process.
    converted = subprocess.run(
        [sys.executable, "-c", CONVERTS, tmp_path], check=True, capture_output=True, text=True
    )
    assert float(converted.stdout) == pytest.approx(123.97, abs=0.01)
