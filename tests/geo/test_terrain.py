"""Elevation files that the tests write; rasterio, and what was written, judge what is read."""

import struct
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import rasterio
import tifffile
from hypothesis import given
from hypothesis import strategies as st
from rasterio.transform import from_origin

from m2pem.geo.elevation_files import Terrain, TerrainError
from m2pem.geo.terrain import lowest, profile
from m2pem.mission.geometry import Route
from tests.geo.test_elevation_files import write

SIDE = 1201


def plane(latitude: float, longitude: float) -> float:
    """A slope: 100 m at (38, -78), 1000 m higher a degree to the north, 500 m to the east."""
    return 100 + 1000 * (latitude - 38) + 500 * (longitude + 78)


def write_tile(folder: Path, height: Callable[[float, float], float] = plane) -> Path:
    rows = [
        [round(height(39 - row / 1200, -78 + column / 1200)) for column in range(SIDE)]
        for row in range(SIDE)
    ]
    path = folder / "N38W078.hgt"
    path.write_bytes(b"".join(struct.pack(f">{SIDE}h", *row) for row in rows))
    return path


@pytest.fixture(scope="module")
def tile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tile(tmp_path_factory.mktemp("dem"))


@given(latitude=st.floats(38.0, 38.9999), longitude=st.floats(-78.0, -77.0001))
def test_heights_of_a_tile_are_those_that_were_written(
    tile: Path, latitude: float, longitude: float
) -> None:
    height_m = Terrain(tile.parent).height_m((latitude, longitude))
    assert height_m == pytest.approx(plane(latitude, longitude), abs=0.51), "rounded to metres"


@pytest.mark.tried_with(
    "GDAL",
    "reads heights of SRTM tiles",
    kind="Maps and geodesy",
    result="the same samples",
    package="rasterio",
)
def test_rasterio_reads_the_same_samples(tile: Path) -> None:
    terrain = Terrain(tile.parent)
    with rasterio.open(tile) as judge:
        for row, column in ((0, 0), (600, 300), (1200, 1200), (17, 1111)):
            longitude, latitude = judge.xy(row, column)
            if longitude >= -77 or latitude >= 39:
                continue  # of the neighbours
            expected = judge.read(1)[row, column]
            assert terrain.height_m((latitude, longitude)) == pytest.approx(expected, abs=0.01)


def write_geotiff(path: Path, epsg: int, west: float, north: float, cell: float) -> None:
    """A float32 GeoTIFF by tifffile: 50 x 50 cells, the height is 2 m a column and 3 m a row."""
    rows, columns = np.mgrid[0:50, 0:50]
    heights = (2.0 * columns + 3.0 * rows).astype(np.float32)
    heights[40, 40] = -9999
    geographic = epsg == 4326
    model, system = (2, 2048) if geographic else (1, 3072)
    keys = (1, 1, 0, 3, 1024, 0, 1, model, 1025, 0, 1, 1, system, 0, 1, epsg)
    tifffile.imwrite(
        path,
        heights,
        extratags=[
            (33550, "d", 3, (cell, cell, 0.0), True),
            (33922, "d", 6, (0.0, 0.0, 0.0, west, north, 0.0), True),
            (34735, "H", len(keys), keys, True),
            (42113, "s", 0, "-9999", True),
        ],
    )


def test_a_geotiff_in_degrees(tmp_path: Path) -> None:
    write_geotiff(tmp_path / "dem.tif", 4326, west=7.0, north=53.0, cell=0.001)
    terrain = Terrain(tmp_path)
    # The middle of the cell in row 10 and column 20.
    assert terrain.height_m((53 - 0.0105, 7 + 0.0205)) == pytest.approx(70.0, abs=1e-3)
    assert terrain.height_m((53 - 0.0110, 7 + 0.0210)) == pytest.approx(72.5, abs=1e-3)
    assert terrain.height_m((53 - 0.0405, 7 + 0.0405)) is None, "there is no value"
    assert terrain.height_m((54.0, 7.0)) is None, "no file has it"


@pytest.mark.tried_with(
    "PROJ",
    "places of a GeoTIFF in UTM",
    kind="Maps and geodesy",
    result="the same heights",
    package="pyproj",
)
def test_a_geotiff_in_metres_of_utm(tmp_path: Path) -> None:
    write_geotiff(tmp_path / "dem.tiff", 32632, west=500_000.0, north=5_900_000.0, cell=10.0)
    terrain = Terrain(tmp_path)
    from pyproj import Transformer

    to_degrees = Transformer.from_crs(32632, 4326)
    place = to_degrees.transform(500_000 + 205.0, 5_900_000 - 105.0)
    assert terrain.height_m(place) == pytest.approx(70.0, abs=1e-3)


def test_voids_and_places_without_a_tile_are_not_known(tmp_path: Path) -> None:
    def height(latitude: float, _: float) -> float:
        return -32768 if latitude > 38.5 else 10.0

    write_tile(tmp_path, height)
    terrain = Terrain(tmp_path)
    assert terrain.height_m((38.25, -77.5)) == 10.0
    assert terrain.height_m((38.75, -77.5)) is None
    assert terrain.height_m((37.75, -77.5)) is None


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("readme.txt", b"", "has no elevation file"),
        ("N38W078.hgt", b"12", "has 2 bytes; an SRTM tile has 2,884,802 or 25,934,402"),
        ("a.tif", b"II*\0", "cannot be read as GeoTIFF"),
    ],
)
def test_files_that_cannot_be_used_are_named(
    tmp_path: Path, name: str, content: bytes, says: str
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(TerrainError, match=says):
        Terrain(tmp_path).height_m((38.5, -77.5))
    with pytest.raises(TerrainError, match="cannot be read"):
        Terrain(tmp_path / "nowhere")


def test_a_geotiff_that_was_cut_off_is_named(tmp_path: Path) -> None:
    """It opens: what is missing is seen when it is read."""
    path = tmp_path / "dem.tif"
    write_geotiff(path, 4326, west=7.0, north=53.0, cell=0.001)
    path.write_bytes(path.read_bytes()[:-6_000])
    with pytest.raises(TerrainError, match=r"dem\.tif: is damaged"):
        Terrain(tmp_path).height_m((53 - 0.0405, 7 + 0.0205))


# --- profiles -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("frame", "above"),
    [
        # The ground rises by 10 m from the first waypoint to the second.
        ("amsl", [150 - 600, 150 - 610]),
        ("relative", [150, 140]),
        ("terrain", [150, 150]),
    ],
)
def test_a_profile_has_the_height_above_ground(tile: Path, frame: str, above: list[float]) -> None:
    route = Route(((38.5, -78.0, 150.0), (38.51, -78.0, 150.0)), frame)
    points = profile(route, Terrain(tile.parent))
    ends = [each for each in points if each.waypoint is not None]
    assert [each.waypoint for each in ends] == [0, 1]
    assert [each.above_ground_m for each in ends] == [
        pytest.approx(each, abs=1.1) for each in above
    ]
    gaps = [b.along_m - a.along_m for a, b in pairwise(points)]
    assert max(gaps) <= 30.01
    assert points[-1].along_m == pytest.approx(1110, abs=5)


def test_a_profile_of_different_frames_is_even_above_the_sea(tile: Path) -> None:
    # The ground is at 600 m at the first waypoint, and 10 m higher at each of the others.
    places = ((38.5, -78.0, 150.0), (38.51, -78.0, 760.0), (38.52, -78.0, 150.0))
    route = Route.of(places, ("relative", "amsl", "terrain"))
    points = profile(route, Terrain(tile.parent), home_m=590.0)
    ends = [each.altitude_m for each in points if each.waypoint is not None]
    assert ends == pytest.approx([740, 760, 770], abs=1.1)
    middle = min(points, key=lambda each: abs(each.place[0] - 38.505))
    assert middle.altitude_m == pytest.approx(750, abs=1.5)


def test_the_lowest_place_is_between_two_waypoints(tmp_path: Path) -> None:
    def ridge(latitude: float, _: float) -> float:
        return max(0.0, 100 - abs(latitude - 38.5) * 20_000)

    write_tile(tmp_path, ridge)
    route = Route(((38.49, -77.5, 120.0), (38.51, -77.5, 120.0)), "amsl")
    low = lowest(profile(route, Terrain(tmp_path)))
    assert low is not None
    assert low.above_ground_m == pytest.approx(20, abs=4)
    assert low.place[0] == pytest.approx(38.5, abs=0.0004)


def test_the_ground_may_be_highest_between_rows_and_columns(tmp_path: Path) -> None:
    """A tower of 100 m at one sample: in the middle of a cell beside it are 25 m."""
    transform = from_origin(7.0, 46.0, 0.002, 0.002)
    heights = np.zeros((9, 9))
    heights[4, 4] = 100.0
    write(tmp_path / "dem.tif", heights, transform=transform)
    # From row 2.7 and column 3.7 over (3.5, 4.5), on the diagonal that does not lead to the tower.
    north, west = 46.0 - 0.001, 7.0 + 0.001
    places = [(north - 0.002 * each, west + 0.002 * (each + 1)) for each in (2.7, 3.93)]
    route = Route(tuple((*each, 60.0) for each in places), "amsl")
    low = lowest(profile(route, Terrain(tmp_path), 100.0, drift_m=0.0))
    assert low is not None
    assert low.above_ground_m == pytest.approx(35, abs=0.01)
    assert low.place == pytest.approx((north - 0.007, west + 0.009), abs=2e-6)


def test_a_route_over_the_date_line_is_looked_at_where_it_is(tmp_path: Path) -> None:
    for west, height in ((179, 10), (-180, 30)):
        name = f"S17{'E' if west > 0 else 'W'}{abs(west)}.hgt"
        (tmp_path / name).write_bytes(struct.pack(f">{SIDE}h", *([height] * SIDE)) * SIDE)
    route = Route(((-16.5, 179.999, 100.0), (-16.5, -179.999, 100.0)), "amsl")
    points = profile(route, Terrain(tmp_path))
    assert points[-1].along_m == pytest.approx(213.7, abs=0.5)
    assert {round(each.above_ground_m or 0, 3) for each in points} == {90, 70}
    assert {round(each.place[1]) for each in points} == {180, -180}


def test_a_place_and_a_leg_without_a_length_have_a_profile(tile: Path) -> None:
    for waypoints in (((38.5, -78.0, 700.0),), ((38.5, -77.9, 900.0), (38.5, -77.9, 700.0))):
        low = lowest(profile(Route(waypoints, "amsl"), Terrain(tile.parent), drift_m=0.0))
        assert low is not None
        assert low.above_ground_m == pytest.approx(700 - plane(*waypoints[0][:2]), abs=1)


def test_what_has_no_altitude_has_no_height_above_ground(tile: Path) -> None:
    points = profile(Route(((38.5, -77.9, None), (38.51, -77.9, 5.0))), Terrain(tile.parent))
    assert points[0].above_ground_m is None
    assert points[0].ground_m == pytest.approx(650, abs=1)
    assert points[-1].above_ground_m is not None
