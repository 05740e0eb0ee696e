"""Elevation files that rasterio (GDAL) writes, with what their heights are said to be."""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from hypothesis import given
from hypothesis import strategies as st
from rasterio.transform import Affine, from_origin

from m2pem.geo.elevation_files import Terrain, TerrainError

VIRGINIA = 38.1075, -77.3192
GEOID_M = -33.97
"""The undulation there: PROJ 9.5.1 with egm96_15.gtx, and egm96 0.3.0."""


def write(
    path: Path,
    heights: Any = 60.0,
    crs: str = "EPSG:4326",
    unit: str = "",
    scale: float = 1.0,
    offset: float = 0.0,
    transform: Affine | None = None,
    **profile: Any,
) -> None:
    """A GeoTIFF around `VIRGINIA`, of one height if no array is given."""
    dtype = profile.pop("dtype", "float32")
    array = np.full((4, 4), heights) if np.isscalar(heights) else np.asarray(heights)
    rows, columns = array.shape
    if transform is None:
        transform = from_origin(VIRGINIA[1] - 0.02, VIRGINIA[0] + 0.02, 0.01, 0.01)
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        height=rows,
        width=columns,
        count=1,
        dtype=dtype,
        crs=crs,
        transform=transform,
        **profile,
    ) as data:
        data.write(array.astype(dtype), 1)
        if unit:
            data.units = (unit,)
        data.scales, data.offsets = (scale,), (offset,)


def height(folder: Path, place: tuple[float, float] = VIRGINIA) -> float | None:
    return Terrain(folder).height_m(place)


# --- datums -------------------------------------------------------------------------------------


@pytest.mark.parametrize("crs", ["EPSG:4979", "EPSG:7912", "EPSG:4937", "EPSG:6319"])
def test_heights_above_the_ellipsoid_become_heights_above_mean_sea_level(
    tmp_path: Path, crs: str
) -> None:
    write(tmp_path / "dem.tif", 60.0, crs)
    assert height(tmp_path) == pytest.approx(60.0 - GEOID_M, abs=0.01)


@pytest.mark.parametrize(
    ("crs", "unit_m"),
    [
        ("EPSG:4326+5773", 1.0),  # EGM96
        ("EPSG:4326+5714", 1.0),  # MSL
        ("EPSG:4326+3855", 1.0),  # EGM2008
        ("EPSG:4269+5703", 1.0),  # NAVD88
        ("EPSG:4269+6360", 1200 / 3937),  # NAVD88 in US survey feet
        ("EPSG:4269+8228", 0.3048),  # NAVD88 in feet
    ],
)
def test_heights_near_mean_sea_level_are_taken_in_the_unit_of_their_system(
    tmp_path: Path, crs: str, unit_m: float
) -> None:
    write(tmp_path / "dem.tif", 60.0, crs)
    assert height(tmp_path) == pytest.approx(60.0 * unit_m, abs=1e-4)


# GDAL 3.12.4 writes the parameters of a system without a name into the name of its datum.
DATUM_NAMED_BY_GDAL = (
    'GEOGCS["unknown",DATUM["Unknown based on WGS 84 ellipsoid using_towgs84_-87_-98_-121",'
    'SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],'
    'UNIT["degree",0.0174532925199433]]'
)


@pytest.mark.parametrize(
    ("crs", "says"),
    [
        ("EPSG:4326+5798", r"dem\.tif: its heights are of 'EGM84 height', of which .*4326.5773"),
        ("EPSG:4326+5710", "its heights are of 'Ostend height'"),  # low water, 2.3 m lower
        ("EPSG:4326+5829", "its heights are of 'Instantaneous Water Level height'"),
        ("EPSG:4326+5861", "its heights are of 'LAT depth'"),
        ("EPSG:4978", "has no heights"),
        (DATUM_NAMED_BY_GDAL, "using_towgs84_-87_-98_-121' no transformation to WGS 84 is known"),
        ("+proj=utm +zone=18 +ellps=bessel", "no transformation to WGS 84 is known; gdalwarp"),
    ],
)
def test_heights_whose_distance_to_mean_sea_level_is_not_known_are_refused(
    tmp_path: Path, crs: str, says: str
) -> None:
    write(tmp_path / "dem.tif", 60.0, crs)
    with pytest.raises(TerrainError, match=says):
        height(tmp_path)


@pytest.mark.parametrize("crs", ["EPSG:4490", "EPSG:4269", "EPSG:4258"])
def test_a_datum_near_to_wgs_84_is_read(tmp_path: Path, crs: str) -> None:
    write(tmp_path / "dem.tif", 60.0, crs)
    assert height(tmp_path) == 60.0


# --- scale, offset, unit ------------------------------------------------------------------------


@pytest.mark.tried_with(
    "GDAL",
    "GeoTIFF with scale, offset and feet is read",
    kind="Maps and geodesy",
    result="metres",
    package="rasterio",
)
@pytest.mark.parametrize(
    ("raw", "said", "height_m"),
    [
        (1200, {"scale": 0.1}, 120.0),
        (1200, {"scale": 0.1, "offset": -20.0}, 100.0),
        (394, {"unit": "ft"}, 394 * 0.3048),
        (394, {"unit": "foot"}, 394 * 0.3048),
        (394, {"unit": "US survey foot"}, 394 * 1200 / 3937),
        (3940, {"unit": "ft", "scale": 0.1}, 394 * 0.3048),
        (12000, {"unit": "cm"}, 120.0),
        (120, {"unit": "metre"}, 120.0),
        # The band says more of itself than its system.
        (120, {"unit": "m", "crs": "EPSG:4269+6360"}, 120.0),
    ],
)
def test_scale_offset_and_unit_of_the_band_are_applied(
    tmp_path: Path, raw: int, said: dict[str, Any], height_m: float
) -> None:
    # rasterio 1.4.4 and GDAL give raw values: scales and units are metadata.
    write(tmp_path / "dem.tif", raw, dtype="int16", **said)
    assert height(tmp_path) == pytest.approx(height_m, abs=1e-4)


def test_what_is_no_data_is_found_before_the_scale(tmp_path: Path) -> None:
    write(tmp_path / "dem.tif", -9999, dtype="int16", scale=0.1, offset=999.9, nodata=-9999)
    assert height(tmp_path) is None


@pytest.mark.parametrize("void", [-32768, -32767, -9999, -9999 * 3, 32767])
@pytest.mark.parametrize("said", [{}, {"scale": 0.9}])
def test_what_no_ground_can_be_is_not_known_even_if_the_file_does_not_say_so(
    tmp_path: Path, void: int, said: dict[str, Any]
) -> None:
    write(tmp_path / "dem.tif", void, dtype="int16", **said)
    assert height(tmp_path) is None


def test_a_unit_that_is_not_known_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "dem.tif", 20, unit="fathom")
    with pytest.raises(TerrainError, match="its heights are in 'fathom'; known are metres, feet"):
        height(tmp_path)


def test_a_file_that_does_not_say_where_it_is_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "dem.tif", transform=Affine.identity())
    with pytest.raises(TerrainError, match="does not say its projection or place"):
        height(tmp_path)


def test_a_picture_is_refused(tmp_path: Path) -> None:
    transform = from_origin(-77.4, 38.2, 0.1, 0.1)
    profile = {"width": 4, "height": 4, "dtype": "uint8", "crs": "EPSG:4326"}
    with rasterio.open(
        tmp_path / "photo.tif", "w", count=3, photometric="RGB", transform=transform, **profile
    ) as data:
        data.write(np.full((3, 4, 4), 120, "uint8"))
    with pytest.raises(TerrainError, match=r"photo\.tif: is a picture"):
        height(tmp_path)


# --- between files ------------------------------------------------------------------------------


def slope(latitude: float, longitude: float) -> float:
    return 500 + 100 * (latitude - 50) + 50 * longitude


def write_cell(
    folder: Path,
    south: int,
    west: int,
    columns: int,
    rows: int = 20,
    of: Callable[[float, float], float] = slope,
    **said: Any,
) -> None:
    """A degree in the layout of Copernicus GLO-30: its first sample is at its north-west corner,
    its last one step before the first of the next file. To the north, columns are farther apart."""
    step_x, step_y = 1 / columns, 1 / rows
    latitudes, longitudes = south + 1 - step_y * np.arange(rows), west + step_x * np.arange(columns)
    heights = [[of(latitude, longitude) for longitude in longitudes] for latitude in latitudes]
    transform = from_origin(west - step_x / 2, south + 1 + step_y / 2, step_x, step_y)
    write(folder / f"{south}_{west}.tif", np.array(heights), transform=transform, **said)


@pytest.fixture(scope="module")
def cells(tmp_path_factory: pytest.TempPathFactory) -> Terrain:
    folder = tmp_path_factory.mktemp("cells")
    for west in (-1, 0):
        write_cell(folder, 49, west, columns=20)
        write_cell(folder, 50, west, columns=12)
    return Terrain(folder)


@given(st.floats(49.06, 50.99), st.floats(-0.99, 0.9))
def test_there_is_no_gap_between_files_side_by_side(
    cells: Terrain, latitude: float, longitude: float
) -> None:
    expected = pytest.approx(slope(latitude, longitude), abs=1e-3)
    assert cells.height_m((latitude, longitude)) == expected


@pytest.mark.parametrize(
    "place", [(50.5, -0.01), (49.5, -0.01), (50.01, -0.5), (50.01, -0.01), (50.02, -0.04), (50, 0)]
)
def test_the_strip_between_files_and_its_corners_are_known(
    cells: Terrain, place: tuple[float, float]
) -> None:
    assert cells.height_m(place) == pytest.approx(slope(*place), abs=1e-3)


def test_beyond_the_last_file_the_height_is_not_known(cells: Terrain) -> None:
    assert cells.height_m((49.5, 0.97)) is None
    assert cells.height_m((51.01, 0.5)) is None


def test_files_side_by_side_are_put_together_in_one_datum(tmp_path: Path) -> None:
    def ellipsoidal(latitude: float, longitude: float) -> float:
        return slope(latitude, longitude) + 45.4

    write_cell(tmp_path, 49, -1, columns=20, of=ellipsoidal, crs="EPSG:4979")
    write_cell(tmp_path, 49, 0, columns=20)
    # The undulation at 49.5, 0 is 45.4 m.
    assert height(tmp_path, (49.5, -0.025)) == pytest.approx(slope(49.5, -0.025), abs=0.5)


def test_files_meet_at_the_date_line(tmp_path: Path) -> None:
    def ground(_: float, longitude: float) -> float:
        return 100 + (longitude % 360 - 180)

    write_cell(tmp_path, -17, 179, columns=20, of=ground)
    write_cell(tmp_path, -17, -180, columns=20, of=ground)
    for longitude in (179.96, 179.99, 180.0, -180.0, -179.99):
        expected = pytest.approx(ground(0, longitude), abs=1e-3)
        assert height(tmp_path, (-16.5, longitude)) == expected


def test_a_file_of_the_whole_world_meets_itself_at_the_date_line(tmp_path: Path) -> None:
    heights = np.tile(np.abs(np.arange(-179.5, 180)), (180, 1))
    write(tmp_path / "world.tif", heights, transform=from_origin(-180, 90, 1, 1))
    assert height(tmp_path, (10, 179.9)) == pytest.approx(179.5)
    assert height(tmp_path, (10, -179.9)) == pytest.approx(179.5)
    assert height(tmp_path, (10, -170)) == pytest.approx(170)


@pytest.mark.parametrize(
    ("heights", "beside"),
    [
        (
            "Copernicus_DSM_COG_10_N38_00_W078_00_DEM.tif",
            "Copernicus_DSM_COG_10_N38_00_W078_00_EDM.tif",
        ),
        ("ASTGTMV003_N38W078_dem.tif", "ASTGTMV003_N38W078_num.tif"),
        ("ALPSMLC30_N038W078_DSM.tif", "ALPSMLC30_N038W078_MSK.tif"),
    ],
)
def test_masks_and_counts_beside_the_heights_are_not_heights(
    tmp_path: Path, heights: str, beside: str
) -> None:
    write(tmp_path / heights, -9999, nodata=-9999)
    write(tmp_path / beside, 3, dtype="uint8")
    (tmp_path / f"._{heights}").write_bytes(b"AppleDouble")
    assert height(tmp_path) is None
    write(tmp_path / heights, 60)
    assert height(tmp_path) == 60


def test_where_a_file_has_no_value_one_that_overlaps_it_has(tmp_path: Path) -> None:
    write(tmp_path / "a.tif", -9999, nodata=-9999)
    write(tmp_path / "b.tif", 60)
    assert height(tmp_path) == 60


def write_hgt(path: Path, value: int, at_east_edge: int | None = None) -> None:
    row = [value] * 1200 + [value if at_east_edge is None else at_east_edge]
    path.write_bytes(struct.pack(">1201h", *row) * 1201)


def test_tiles_of_srtm_share_their_edges(tmp_path: Path) -> None:
    write_hgt(tmp_path / "N38W078.hgt", 10, at_east_edge=-32768)
    write_hgt(tmp_path / "N38W077.hgt", 20)
    write_hgt(tmp_path / "N38E179.hgt", 30)
    assert height(tmp_path, (38.5, -77.0)) == 20
    assert height(tmp_path, (39.0, -76.5)) == 20, "the northern edge, without a tile beyond"
    assert height(tmp_path, (38.5, -76.0)) == 20, "the eastern edge"
    assert height(tmp_path, (38.5, 180.0)) == height(tmp_path, (38.5, -180.0)) == 30
    assert height(tmp_path, (38.5, -75.9)) is None
