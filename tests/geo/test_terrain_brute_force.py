"""Least heights above the ground, judged by rasterio, SciPy and PROJ each 0.1 m.

Ridges, dams and towers of one sample and more, on the grids that people have: SRTM of 1 and 3
seconds of arc, GeoTIFF in degrees and in UTM of 1 to 30 m. `M2PEM_SRTM` may name a folder with
tiles of SRTM: the routes are then over these.
"""

import math
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
import rasterio
from pyproj import Geod, Transformer
from rasterio.transform import from_origin
from scipy.interpolate import RegularGridInterpolator

from m2pem.geo.elevation_files import Terrain
from m2pem.geo.geojson import GeometryError
from m2pem.geo.terrain import DRIFT_M, lowest, profile
from m2pem.geo.terrain_following import follow_terrain
from m2pem.mission.geometry import Coordinate, Route

GEOD = Geod(ellps="WGS84")
UTM = Transformer.from_crs(4326, 32632, always_xy=True)
STEP_M = 0.1
LONG = range(12, 200)


def relief(rows: int, columns: int, seed: int) -> np.ndarray[Any, Any]:
    """Hills, with ridges, dams and towers of one sample to twelve."""
    random = Random(seed)
    row, column = np.mgrid[0:rows, 0:columns]
    heights = 500 + 60 * np.sin(row / 37) * np.cos(column / 29) + row * 0.05
    for _ in range(rows * columns // 4_000):
        at = random.randrange(rows), random.randrange(columns)
        size = random.choice((1, 1, 1, 2, 12)), random.choice((1, 1, 12, 60))
        across, along = size if random.random() < 0.5 else size[::-1]
        heights[at[0] : at[0] + across, at[1] : at[1] + along] += random.uniform(5, 90)
    return heights


@dataclass(frozen=True)
class World:
    """A folder of elevation files, the judge's ground, and where routes may be."""

    folder: Path
    latitudes: tuple[float, float]
    longitudes: tuple[float, float]
    grounds: Any


def hgt(folder: Path, side: int) -> World:
    heights = relief(side, side, side).round().astype(">i2")
    path = folder / "N46E007.hgt"
    path.write_bytes(heights.tobytes())
    return of_tile(path)


def of_tile(path: Path) -> World:
    heights = np.fromfile(path, ">i2")
    side = math.isqrt(heights.size)
    south = int(path.name[1:3]) * (1 if path.name[0] == "N" else -1)
    west = int(path.name[4:7]) * (1 if path.name[3] == "E" else -1)
    axis = np.linspace(0, 1, side)
    rows = heights.reshape(side, side)[::-1].astype(float)
    between = RegularGridInterpolator((south + axis, west + axis), rows)
    latitudes, longitudes = (south + 0.1, south + 0.9), (west + 0.1, west + 0.9)
    return World(path.parent, latitudes, longitudes, between)


def geotiff(folder: Path, cell: float, epsg: int) -> World:
    """Of 2,000 times 2,000 cells around (46.5, 7.5), as two files side by side."""
    middle = (7.5, 46.5) if epsg == 4326 else UTM.transform(7.5, 46.5)
    west, north = middle[0] - cell * 1000, middle[1] + cell * 1000
    heights = relief(2000, 2000, int(cell * 1e6)).astype("float32")
    for name, first, end in (("a", 0, 900), ("b", 900, 2000)):
        with rasterio.open(
            folder / f"{name}.tif",
            "w",
            driver="GTiff",
            height=2000,
            width=end - first,
            count=1,
            dtype="float32",
            crs=f"EPSG:{epsg}",
            transform=from_origin(west + first * cell, north, cell, cell),
        ) as data:
            data.write(heights[:, first:end], 1)
    y, x = north - cell * (np.arange(2000) + 0.5), west + cell * (np.arange(2000) + 0.5)
    between = RegularGridInterpolator((y[::-1], x), heights[::-1].astype(float))

    def grounds(places: Any) -> Any:
        latitudes, longitudes = places.T
        if epsg == 4326:
            return between(places)
        return between(np.stack(UTM.transform(longitudes, latitudes)[::-1], axis=1))

    reach = cell * 900 if epsg == 4326 else cell * 900 / 111_200
    wide = reach if epsg == 4326 else reach / math.cos(math.radians(46.5))
    return World(folder, (46.5 - reach, 46.5 + reach), (7.5 - wide, 7.5 + wide), grounds)


GRIDS: dict[str, Callable[[Path], World]] = {
    "SRTM 3 seconds": lambda folder: hgt(folder, 1201),
    "SRTM 1 second": lambda folder: hgt(folder, 3601),
    "degrees 1 m": lambda folder: geotiff(folder, 1e-5, 4326),
    "degrees 30 m": lambda folder: geotiff(folder, 1 / 3600, 4326),
    "UTM 1 m": lambda folder: geotiff(folder, 1.0, 32632),
    "UTM 5 m": lambda folder: geotiff(folder, 5.0, 32632),
    "UTM 30 m": lambda folder: geotiff(folder, 30.0, 32632),
}
if folder := os.environ.get("M2PEM_SRTM"):
    GRIDS = {
        each.name: lambda _, path=each: of_tile(path) for each in sorted(Path(folder).glob("*.hgt"))
    }


@pytest.fixture(scope="module")
def worlds(tmp_path_factory: pytest.TempPathFactory) -> dict[str, World]:
    return {name: make(tmp_path_factory.mktemp("dem")) for name, make in GRIDS.items()}


def drawn(world: World, random: Random, altitude: tuple[float, float]) -> Route:
    """Of two to five waypoints, legs of 20 m to 3 km; some along the grid."""
    place = random.uniform(*world.latitudes), random.uniform(*world.longitudes)
    places: list[tuple[float, float, float]] = []
    middle = float(np.mean(world.latitudes)), float(np.mean(world.longitudes))
    while len(places) < random.randint(2, 5):
        if world.latitudes[0] < place[0] < world.latitudes[1] and (
            world.longitudes[0] < place[1] < world.longitudes[1]
        ):
            places.append((*place, random.uniform(*altitude)))
        else:
            place = places[-1][:2] if places else middle
        azimuth = random.choice((random.uniform(0, 360), 90.0 * random.randrange(4)))
        longitude, latitude, _ = GEOD.fwd(place[1], place[0], azimuth, random.uniform(20, 3000))
        exact = azimuth % 90 == 0
        place = (
            place[0] if exact and azimuth % 180 == 90 else latitude,
            place[1] if exact and azimuth % 180 == 0 else longitude,
        )
    return Route(tuple(places), "amsl")


def sampled(waypoints: tuple[Coordinate, ...]) -> Iterator[tuple[Any, Any, Any]]:
    """Yield latitudes, longitudes and altitudes each 0.1 m of each leg, the shortest way."""
    for a, b in pairwise(waypoints):
        assert a[2] is not None
        assert b[2] is not None
        azimuth, _, length_m = GEOD.inv(a[1], a[0], b[1], b[0])
        part = np.linspace(0, 1, max(2, math.ceil(length_m / STEP_M)))
        same = [np.full(part.shape, each) for each in (a[1], a[0], azimuth)]
        longitudes, latitudes, _ = GEOD.fwd(*same, part * length_m)
        yield latitudes, longitudes, a[2] + (b[2] - a[2]) * part


def least(world: World, route: Route, drift_m: float) -> float:
    """The least height that samples on the way, beside it and around waypoints have."""
    heights = []
    for latitudes, longitudes, altitudes in sampled(route.waypoints):
        azimuths, *_ = GEOD.inv(longitudes[:-1], latitudes[:-1], longitudes[1:], latitudes[1:])
        right = np.append(azimuths, azimuths[-1]) + 90
        for off_m in np.linspace(-drift_m, drift_m, 9 if drift_m else 1):
            places = GEOD.fwd(longitudes, latitudes, right, np.full(latitudes.shape, off_m))
            grounds = world.grounds(np.stack([places[1], places[0]], axis=1))
            heights.append((altitudes - grounds).min())
        # The straight line in degrees is up to 0.4 m beside.
        straight = [np.linspace(each[0], each[-1], each.size) for each in (latitudes, longitudes)]
        if drift_m:
            heights.append((altitudes - world.grounds(np.stack(straight, axis=1))).min())
        for end in (0, -1):
            around = np.arange(0.0, 360.0, 5.0)
            same = [np.full(around.shape, each[end]) for each in (longitudes, latitudes)]
            for off_m in np.linspace(0, drift_m, 9):
                places = GEOD.fwd(*same, around, np.full(around.shape, off_m))
                grounds = world.grounds(np.stack([places[1], places[0]], axis=1))
                heights.append((altitudes[end] - grounds).min())
    return float(min(heights))


def beside_m(place: tuple[float, float], route: Route) -> float:
    """How far a place is from the samples of a route."""
    return min(
        float(
            GEOD.inv(
                longitudes,
                latitudes,
                np.full(latitudes.shape, place[1]),
                np.full(latitudes.shape, place[0]),
            )[2].min()
        )
        for latitudes, longitudes, _ in sampled(route.waypoints)
    )


@pytest.mark.parametrize(
    "seed", [*range(12), *(pytest.param(each, marks=pytest.mark.long) for each in LONG)]
)
def test_the_least_height_is_the_least_there_is(worlds: dict[str, World], seed: int) -> None:
    random = Random(seed)
    world = worlds[list(GRIDS)[seed % len(GRIDS)]]
    route = drawn(world, random, (550, 750))
    drift_m = DRIFT_M if seed % 3 else 0.0
    step_m = random.choice((30.0, 250.0, 5_000.0))
    low = lowest(profile(route, Terrain(world.folder), step_m, drift_m=drift_m))
    assert low is not None
    assert low.above_ground_m is not None
    # Walls rise by up to 90 m over 1 m: the ground within 5 mm of the place.
    around = np.stack(np.meshgrid(*[np.linspace(-5e-8, 5e-8, 9)] * 2), axis=-1).reshape(-1, 2)
    grounds = world.grounds(around + low.place)
    assert grounds.min() - 0.02 < low.ground_m < grounds.max() + 0.02
    assert low.above_ground_m <= least(world, route, drift_m) + 0.01
    # The corners of a corridor are those of a rectangle.
    assert beside_m(low.place, route) <= drift_m * 1.42 + 0.6


@pytest.mark.parametrize(
    "seed", [*range(7), *(pytest.param(each, marks=pytest.mark.long) for each in range(7, 60))]
)
def test_a_route_that_follows_the_ground_is_everywhere_within_the_tolerance(
    worlds: dict[str, World], seed: int
) -> None:
    random = Random(seed)
    world = worlds[list(GRIDS)[seed % len(GRIDS)]]
    route = drawn(world, random, (30, 60))
    tolerance_m = random.choice((0.5, 2.0, 10.0))
    try:
        followed = follow_terrain(route, Terrain(world.folder), tolerance_m=tolerance_m)
    except GeometryError as error:
        assert "more than 500" in str(error)
        return
    legs = iter(followed.waypoints)
    at = next(legs)
    for (latitudes, longitudes, heights), end in zip(
        sampled(route.waypoints), route.waypoints[1:], strict=True
    ):
        alongs, altitudes = [0.0], [at[2]]
        while at[:2] != end[:2]:
            at = next(legs)
            alongs.append(GEOD.inv(longitudes[0], latitudes[0], at[1], at[0])[2])
            altitudes.append(at[2])
        flown = np.interp(np.linspace(0, alongs[-1], latitudes.size), alongs, altitudes)
        grounds = world.grounds(np.stack([latitudes, longitudes], axis=1))
        assert np.abs(flown - grounds - heights).max() <= tolerance_m
