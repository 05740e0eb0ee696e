import math

import pymap3d
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.api import Area
from m2pem.geo.fence import MARGIN_M, Fence
from tests.seeds import examples

HOME = (38.1, -77.3)


def at(east: float, north: float) -> tuple[float, float]:
    """A place so far from home, in metres."""
    latitude, longitude, _ = pymap3d.enu2geodetic(east, north, 0.0, *HOME, 0.0)
    return float(latitude), float(longitude)


def ring(*corners: tuple[float, float]) -> tuple:
    return tuple((*at(*corner), None) for corner in (*corners, corners[0]))


HOLE = ring((40, 40), (60, 40), (60, 60), (40, 60))
FIELD = Area((ring((0, 0), (100, 0), (100, 100), (0, 100)), HOLE))
U_SHAPE = Area(
    (ring((0, 0), (100, 0), (100, 100), (70, 100), (70, 20), (30, 20), (30, 100), (0, 100)),)
)


@pytest.mark.parametrize(
    ("place", "by_m"),
    [((50, 10), 0), ((120, 50), 20), ((103, 104), 5), ((50, 45), 5), ((50, 50), 10)],
)
def test_a_place_outside_or_in_a_hole_is_as_far_out_as_the_way_back(place, by_m) -> None:
    assert Fence(FIELD).outside_m(at(*place)) == pytest.approx(by_m, abs=0.02)


def test_a_way_within_the_fence_is_no_breach() -> None:
    assert Fence(FIELD).breach([at(10, 10), at(90, 10), at(90, 90)], at(5, 5)) == ""


def test_a_way_along_the_fence_is_no_breach() -> None:
    assert Fence(FIELD).breach([at(0, 0), at(100, 0), at(100, 100)]) == ""


def test_a_point_outside_is_named_with_its_place_and_distance() -> None:
    said = Fence(FIELD).breach([at(10, 10), at(130, 10)])
    latitude, longitude = at(130, 10)
    assert said.startswith("waypoint 2, ")
    assert f"[{latitude:.6f}, {longitude:.6f}]" in said
    assert "30 m outside" in said


def test_a_way_that_cuts_a_corner_is_a_breach_where_it_is_farthest_out() -> None:
    said = Fence(U_SHAPE).breach([at(10, 90), at(90, 90)])
    assert "between waypoint 1 and waypoint 2" in said
    assert "by 20 m" in said


def test_a_way_through_a_hole_is_a_breach() -> None:
    said = Fence(FIELD).breach([at(10, 50), at(90, 50)])
    assert "by 10 m" in said


def test_a_way_to_the_first_point_is_checked_from_where_the_vehicle_is() -> None:
    assert "the way to waypoint 1" in Fence(FIELD).breach([at(90, 50)], at(10, 50))


def test_a_vehicle_that_is_outside_may_come_back() -> None:
    assert Fence(FIELD).breach([at(10, 10)], at(-50, 10)) == ""


@settings(max_examples=examples(37, 150), deadline=None)
@given(
    st.lists(st.floats(20, 100), min_size=3, max_size=8),
    st.tuples(st.floats(-110, 110), st.floats(-110, 110)),
    st.tuples(st.floats(-110, 110), st.floats(-110, 110)),
)
def test_a_way_is_a_breach_if_and_only_if_a_point_of_it_is_outside(radii, a, b) -> None:
    corners = [
        (radius * math.cos(math.tau * i / len(radii)), radius * math.sin(math.tau * i / len(radii)))
        for i, radius in enumerate(radii)
    ]
    fence = Fence(Area((ring(*corners),)))
    looks = [(a[0] + (b[0] - a[0]) * i / 60, a[1] + (b[1] - a[1]) * i / 60) for i in range(61)]
    farthest = max(fence.outside_m(at(*look)) for look in looks)
    breach = fence.breach([at(*a), at(*b)])
    if farthest > MARGIN_M:
        assert breach
    elif not breach:
        return
    else:  # what is farthest out lies between two looks
        assert math.dist(a, b) / 60 > MARGIN_M
