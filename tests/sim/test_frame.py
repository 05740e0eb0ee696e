import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.sim.frame import Frame

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


def test_places_that_are_near_each_other_are_where_each_alone_is() -> None:
    middle = (20_000.0, -15_000.0, 30.0)
    places = [(25_000.0, -15_000.0, 0.0), (20_003.0, -14_000.0, 5.0), (16_000.0, -18_000.0, 0.0)]
    for near, place in zip(FRAME.geo_near(middle, places), places, strict=True):
        east, north = FRAME.level(near.latitude_deg, near.longitude_deg)
        off = math.dist((east, north), place[:2])
        assert off < 4e-3 * math.dist(middle[:2], place[:2])
        assert near.altitude_m == 60.0 + place[2]
