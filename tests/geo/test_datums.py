"""What of a coordinate system's heights is known; those of files are in test_elevation_files."""

import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import rasterio
from pyproj import CRS
from rasterio.transform import from_origin

from m2pem.geo.datums import NEAR, heights_of


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


def test_depths_below_mean_sea_level_count_downwards() -> None:
    unit_m, to_sea_level = heights_of(CRS("EPSG:4326+5715"))
    assert to_sea_level(40.7, -74.0, 60.0 * unit_m) == -60.0


def test_a_datum_is_known_by_its_name_whatever_the_unit_and_the_name_of_the_system() -> None:
    datum = 'VDATUM["North_American_Vertical_Datum_1988"],PARAMETER["Vertical_Shift",0.0]'
    unit = 'PARAMETER["Direction",1.0],UNIT["Foot_US",0.3048006096012192]'
    horizontal = CRS.from_epsg(4326).to_wkt("WKT1_ESRI")
    system = CRS.from_wkt(f'{horizontal},VERTCS["NAVD_1988_Foot_US",{datum},{unit}]')
    assert heights_of(system)[0] == pytest.approx(1200 / 3937)


CONVERTS = """
import sys, pyproj
from m2pem.geo.datums import heights_of
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


@pytest.mark.parametrize("code", [7415, 7405, 6349])
def test_a_system_of_epsg_is_known_by_its_name_where_gdal_names_another_datum(code: int) -> None:
    """GDAL 3.10.3 in rasterio 1.4.4 writes "Ibiza" for NAP, given pyproj's WKT."""
    grid = {"width": 1, "height": 1, "count": 1, "dtype": "float32"}
    with rasterio.MemoryFile() as file:
        with file.open(
            driver="GTiff",
            crs=CRS.from_epsg(code).to_wkt(),
            transform=from_origin(0, 1, 1, 1),
            **grid,
        ) as written:
            written.write(np.zeros((1, 1, 1), "float32"))
        with file.open() as read:
            system = CRS.from_wkt(read.crs.to_wkt())
    _, to_sea_level = heights_of(system)
    assert to_sea_level(52.0, 5.0, 12.0) == 12.0
