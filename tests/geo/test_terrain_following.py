"""Routes that follow the ground, over a hill that the test makes."""

import numpy as np
import pytest
from rasterio.transform import from_origin

from m2pem.geo.elevation_files import Terrain, TerrainError
from m2pem.geo.geojson import GeometryError
from m2pem.geo.terrain import profile
from m2pem.geo.terrain_following import follow_terrain
from m2pem.mission.geometry import Route
from tests.geo.test_elevation_files import write

SOUTH, NORTH = (38.10, -77.30), (38.12, -77.30)
HILL_M, FOOT_M = 80.0, 50.0


@pytest.fixture(scope="module")
def hill(tmp_path_factory: pytest.TempPathFactory) -> Terrain:
    """Even ground with a hill in the middle; nothing is known east of it."""
    folder = tmp_path_factory.mktemp("dem")
    latitudes = 38.13 - 0.0001 * np.arange(400)[:, None] + 0 * np.arange(3_400)
    heights = FOOT_M + HILL_M * np.exp(-(((latitudes - 38.11) / 0.002) ** 2))
    transform = from_origin(-77.33995, 38.13005, 0.0001, 0.0001)
    write(folder / "dem.tif", heights, transform=transform)
    return Terrain(folder)


def test_a_route_keeps_its_height_over_a_hill_within_the_tolerance(hill: Terrain) -> None:
    route = Route(((*SOUTH, 40.0), (*NORTH, 40.0)))
    followed = follow_terrain(route, hill, tolerance_m=3.0)
    assert followed.altitude_frame == "amsl"
    assert followed.waypoints[0] == (*SOUTH, pytest.approx(FOOT_M + 40, abs=0.1))
    heights = [each.above_ground_m for each in profile(followed, hill, step_m=10)]
    assert min(h for h in heights if h is not None) > 40 - 3.5
    assert max(h for h in heights if h is not None) < 40 + 3.5
    coarse = follow_terrain(route, hill, tolerance_m=20.0)
    assert 2 < len(coarse.waypoints) < len(followed.waypoints)


def test_even_ground_needs_no_more_waypoints_and_one_height_is_that_of_all(hill: Terrain) -> None:
    west = Route(((38.10, -77.30, None), (38.10, -77.31, None), (38.10, -77.32, None)))
    followed = follow_terrain(west, hill, height_m=25.0)
    assert len(followed.waypoints) == 3
    assert {altitude for *_, altitude in followed.waypoints} == {FOOT_M + 25}
    with pytest.raises(GeometryError, match="waypoint 1 has no altitude"):
        follow_terrain(west, hill)


def test_ground_that_no_file_has_is_said_with_the_file_that_would_have_it(hill: Terrain) -> None:
    east = Route(((38.10, -77.001, 20.0), (38.10, -76.99, 20.0)))
    with pytest.raises(TerrainError, match=r"no elevation file has .* put N38W077.hgt"):
        follow_terrain(east, hill)


def test_altitudes_of_different_frames_are_no_heights_above_ground(hill: Terrain) -> None:
    mixed = Route.of(((*SOUTH, 40.0), (*NORTH, 140.0)), ("relative", "amsl"))
    with pytest.raises(GeometryError, match="count from different heights: say a height above"):
        follow_terrain(mixed, hill)
    assert follow_terrain(mixed, hill, height_m=40.0).altitude_frame == "amsl"
