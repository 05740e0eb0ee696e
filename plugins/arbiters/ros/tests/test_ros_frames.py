import math
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from m2pem_plugin_ros.frames import quaternion_of_yaw, to_geodetic, to_local, yaw_of_quaternion

from m2pem.api import GeoPosition

ORIGIN = (38.1075, -77.3192, 60.0)
metres = st.floats(-20_000, 20_000)
unit = st.floats(-1, 1)


@given(metres, metres, st.floats(-500, 5_000), st.floats(-89, 89), st.floats(-180, 180))
def test_a_place_comes_back_from_the_earth(east, north, up, latitude, longitude) -> None:
    origin = (latitude, longitude, 60.0)
    there = to_local(to_geodetic(east, north, up, origin), origin)
    assert there == pytest.approx((east, north, up), abs=1e-3)


def test_a_degree_is_as_long_as_on_the_ellipsoid() -> None:
    """WGS-84's semi-axes are 6378137 m and 6356752.314245 m; at the equator a degree of longitude
    is a pi/180 and one of latitude b²/a pi/180."""
    # The ellipsoid is 17.16 m below mean sea level there.
    east, _, _ = to_local(GeoPosition(0.0, 0.001, -17.16), (0.0, 0.0, -17.16))
    _, north, _ = to_local(GeoPosition(0.001, 0.0, -17.16), (0.0, 0.0, -17.16))
    assert east == pytest.approx(6378137.0 * math.radians(0.001), rel=1e-6)
    assert north == pytest.approx(6356752.314245**2 / 6378137.0 * math.radians(0.001), rel=1e-6)


def test_up_is_up_and_the_origin_is_the_origin() -> None:
    assert to_local(GeoPosition(*ORIGIN), ORIGIN) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    above = GeoPosition(ORIGIN[0], ORIGIN[1], ORIGIN[2] + 25.0)
    assert to_local(above, ORIGIN) == pytest.approx((0.0, 0.0, 25.0), abs=1e-6)


@given(st.floats(-50, 50))
def test_a_yaw_comes_back_from_its_quaternion(yaw) -> None:
    back = yaw_of_quaternion(quaternion_of_yaw(yaw))
    assert math.remainder(back - yaw, math.tau) == pytest.approx(0.0, abs=1e-9)
    assert -math.pi <= back <= math.pi


@given(unit, unit, unit, unit, st.floats(0.1, 10))
def test_the_yaw_is_that_of_the_turned_bow_whatever_the_length(x, y, z, w, length) -> None:
    size = math.sqrt(x * x + y * y + z * z + w * w)
    if size < 0.01:
        return
    q = SimpleNamespace(**{k: v / size * length for k, v in zip("xyzw", (x, y, z, w), strict=True)})
    x, y, z, w = x / size, y / size, z / size, w / size
    east, north = 1 - 2 * (y * y + z * z), 2 * (x * y + w * z)  # the body's x axis, turned
    if math.hypot(east, north) > 1e-3:
        difference = yaw_of_quaternion(q) - math.atan2(north, east)
        assert math.remainder(difference, math.tau) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("w", [0.0, math.nan, math.inf])
def test_what_is_no_rotation_is_refused(w: float) -> None:
    with pytest.raises(ValueError, match="is not a rotation"):
        yaw_of_quaternion(SimpleNamespace(x=0.0, y=0.0, z=0.0, w=w))
