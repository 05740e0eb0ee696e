import math

import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.simulation.frame import Frame

FRAME = Frame((38.1075, -77.3192, 60.0))


@given(st.floats(37.2, 39.0), st.floats(-78.3, -76.3), st.floats(-50, 3000))
def test_there_and_back_is_the_same_place(latitude: float, longitude: float, alt: float) -> None:
    east, north = FRAME.level(latitude, longitude)
    geo = FRAME.geo((east, north, alt - 60.0))
    assert geo.latitude_deg == pytest.approx(latitude, abs=2e-6)
    assert geo.longitude_deg == pytest.approx(longitude, abs=2e-6)
    assert geo.altitude_m == pytest.approx(alt)


def test_a_place_far_from_the_origin_is_refused_with_the_distance_and_the_remedy() -> None:
    with pytest.raises(ValueError, match=r"km from the fleet's origin.*`origin`"):
        FRAME.level(0.0, 0.0)


@given(
    st.floats(-89.5, 89.5),
    st.floats(-180, 180),
    st.floats(-50, 3000),
    st.floats(-30_000, 30_000),
    st.floats(-30_000, 30_000),
)
def test_it_agrees_with_a_library_of_geodesy(
    latitude: float, longitude: float, alt: float, east: float, north: float
) -> None:
    origin = latitude, longitude, alt
    frame = Frame(origin)
    geo = frame.geo((east, north, 0.0))
    sunk = -(east * east + north * north) / (2 * 6_371_000.0)
    expected = pymap3d.enu2geodetic(east, north, sunk, *origin)
    assert geo.latitude_deg == pytest.approx(expected[0], abs=1e-10)
    assert math.remainder(geo.longitude_deg - expected[1], 360) == pytest.approx(0, abs=1e-8)
    there = pymap3d.geodetic2enu(geo.latitude_deg, geo.longitude_deg, alt, *origin)
    assert frame.level(geo.latitude_deg, geo.longitude_deg) == pytest.approx(there[:2], abs=1e-6)
