import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.sim.wgs84 import cartesian, geodetic

LATITUDES = st.floats(-90, 90)
LONGITUDES = st.floats(-179.9, 179.9)
HEIGHTS = st.floats(-500, 20_000)


@given(LATITUDES, LONGITUDES, HEIGHTS)
def test_cartesian_places_are_those_of_a_library(lat: float, lon: float, height: float) -> None:
    assert cartesian(lat, lon, height) == pytest.approx(
        pymap3d.geodetic2ecef(lat, lon, height), abs=1e-6
    )


@given(st.floats(-89, 89), LONGITUDES, HEIGHTS)
def test_there_and_back_is_the_same_place(lat: float, lon: float, height: float) -> None:
    assert geodetic(*cartesian(lat, lon, height)) == pytest.approx((lat, lon), abs=1e-9)


def test_the_poles_and_the_equator() -> None:
    assert geodetic(0.0, 0.0, 6_356_752.0) == (90.0, 0.0)
    assert geodetic(0.0, 0.0, -6_356_752.0) == (-90.0, 0.0)
    assert cartesian(0.0, 90.0, 0.0) == pytest.approx((0.0, 6_378_137.0, 0.0), abs=1e-6)
