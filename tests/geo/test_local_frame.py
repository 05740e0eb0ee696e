"""The one local frame against two libraries of geodesy, and what its docstring states."""

import math

import pymap3d
import pytest
from geographiclib.geodesic import Geodesic
from hypothesis import given
from hypothesis import strategies as st

from m2pem.geo.local_frame import LocalFrame, distance_m, offset
from m2pem.simulation.frame import FlatFrame

latitudes, longitudes = st.floats(-89.5, 89.5), st.floats(-180, 180)
altitudes = st.floats(-100, 5000)
metres = st.floats(-30_000, 30_000)


@given(latitudes, longitudes, altitudes, metres, metres, altitudes)
@pytest.mark.tried_with(
    "pymap3d",
    "east, north and up anywhere on Earth",
    kind="Maps and geodesy",
    result="the same within a micrometre",
)
def test_east_north_and_up_agree_with_pymap3d(lat, lon, alt, east, north, up) -> None:
    frame = LocalFrame((lat, lon, alt))
    place = frame.from_enu(east, north, up)
    expected = pymap3d.enu2geodetic(east, north, up, lat, lon, alt)
    assert place[0] == pytest.approx(expected[0], abs=1e-10)
    assert math.remainder(place[1] - expected[1], 360) == pytest.approx(0, abs=1e-8)
    assert place[2] == pytest.approx(expected[2], abs=1e-6)
    assert frame.to_enu(*place) == pytest.approx((east, north, up), abs=1e-6)
    assert frame.to_enu(*place) == pytest.approx(
        pymap3d.geodetic2enu(*place, lat, lon, alt), abs=1e-6
    )


def test_the_origin_in_ecef_is_at_its_height_above_the_ellipsoid() -> None:
    # 60 m above mean sea level, which is 33.97 m below the ellipsoid there.
    expected = pymap3d.geodetic2ecef(38.1075, -77.3192, 26.03)
    assert LocalFrame((38.1075, -77.3192, 60.0)).geocentric == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize(("within_m", "by_m"), [(50_000, 0.001), (100_000, 0.01), (500_000, 1.0)])
@given(latitudes, longitudes, altitudes, st.floats(0, math.tau), st.floats(0, 1))
def test_a_place_on_the_ground_comes_back(within_m, by_m, lat, lon, alt, bearing, part) -> None:
    frame = LocalFrame((lat, lon, alt))
    point = within_m * part * math.sin(bearing), within_m * part * math.cos(bearing)
    assert math.dist(frame.to_local(frame.to_latlon(point)), point) < by_m


@given(latitudes, longitudes, metres, metres)
def test_a_place_of_the_plane_is_on_the_ground_at_the_altitude_of_the_origin(
    lat, lon, east, north
) -> None:
    place = LocalFrame((lat, lon, 60.0)).to_latlon((east, north))
    there = pymap3d.geodetic2enu(*place, 60.0, lat, lon, 60.0)
    assert there[:2] == pytest.approx((east, north), abs=1e-3)


def test_a_degree_is_as_long_as_on_the_ellipsoid() -> None:
    """WGS-84's semi-axes are 6378137 m and 6356752.314245 m; at the equator a degree of longitude
    is a pi/180 and one of latitude b²/a pi/180."""
    east, _ = LocalFrame((0.0, 0.0)).to_local((0.0, 0.001))
    _, north = LocalFrame((0.0, 0.0)).to_local((0.001, 0.0))
    assert east == pytest.approx(6378137.0 * math.radians(0.001), rel=1e-6)
    assert north == pytest.approx(6356752.314245**2 / 6378137.0 * math.radians(0.001), rel=1e-6)


def test_the_antimeridian_is_no_edge() -> None:
    assert LocalFrame((0.0, 179.999)).to_local((0.0, -179.999))[0] == pytest.approx(222.6, abs=0.1)
    assert LocalFrame((0.0, 179.999)).to_latlon((300.0, 0.0))[1] < -179.99


@given(latitudes, longitudes, latitudes, longitudes)
def test_what_is_beyond_the_horizon_never_seems_near(lat, lon, to_lat, to_lon) -> None:
    point = LocalFrame((lat, lon)).to_local((to_lat, to_lon))
    true_m = Geodesic.WGS84.Inverse(lat, lon, to_lat, to_lon)["s12"]
    assert math.hypot(*point) >= 0.5 * true_m


@pytest.mark.parametrize(("within_m", "by_m"), [(10_000, 0.001), (50_000, 0.01), (500_000, 2.0)])
@given(latitudes, longitudes, st.floats(0, 360), st.floats(0, 1))
@pytest.mark.tried_with(
    "GeographicLib",
    "distances of geodesics",
    kind="Maps and geodesy",
    result="within 1 mm at 10 km",
    package="geographiclib",
)
def test_a_distance_is_that_of_the_geodesic(within_m, by_m, lat, lon, azimuth, part) -> None:
    there = Geodesic.WGS84.Direct(lat, lon, azimuth, within_m * part)
    found_m = distance_m((lat, lon), (there["lat2"], there["lon2"]))
    assert found_m == pytest.approx(within_m * part, abs=by_m)


def test_an_offset_is_so_far_away() -> None:
    place = offset((38.0, -77.0), 300.0, -400.0)
    assert distance_m((38.0, -77.0), place) == pytest.approx(500.0, abs=1e-6)
    assert place[0] < 38.0
    assert place[1] > -77.0


def test_a_simulation_is_over_flat_ground() -> None:
    frame = FlatFrame((38.1075, -77.3192, 60.0))
    position = frame.to_position((30_000.0, -20_000.0, 25.0))
    assert position.altitude_m == 85.0
    place = frame.to_place((position.latitude_deg, position.longitude_deg))
    assert place == pytest.approx((30_000.0, -20_000.0), abs=1e-3)


def test_a_place_far_from_the_origin_is_refused_with_the_distance_and_the_remedy() -> None:
    with pytest.raises(ValueError, match=r"km from the fleet's origin.*`origin`"):
        FlatFrame((38.1075, -77.3192, 60.0)).to_place((0.0, 0.0))
