"""Polylines: distances along them, the nearest point, and lines moved and cut."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.geo.polyline import Polyline, Segment, shifted, trimmed

CORNER = Polyline([(0.0, 0.0), (100.0, 0.0), (100.0, 50.0)])


@pytest.mark.parametrize(
    ("along_m", "point"),
    [
        (-5.0, (0.0, 0.0)),
        (40.0, (40.0, 0.0)),
        (100.0, (100.0, 0.0)),
        (120.0, (100.0, 20.0)),
        (999.0, (100.0, 50.0)),
    ],
)
def test_a_point_of_a_polyline_is_found_by_its_distance_from_the_start(
    along_m: float, point: tuple[float, float]
) -> None:
    assert CORNER.length_m == 150.0
    assert CORNER.at(along_m) == pytest.approx(point, abs=1e-9)


@pytest.mark.parametrize(("along_m", "index"), [(-1, 0), (0, 0), (100, 0), (100.1, 1), (999, 1)])
def test_a_distance_at_a_corner_is_on_the_segment_before_it(along_m: float, index: int) -> None:
    assert CORNER.segment_at(along_m) == index


def test_a_polyline_of_one_point_is_that_point() -> None:
    single = Polyline([(3.0, 4.0)])
    assert (single.length_m, single.at(7.0), single.nearest((0.0, 0.0))) == (0, (3, 4), (3, 4))


def test_points_that_are_repeated_are_no_segment_to_be_near_to() -> None:
    line = Polyline([(0.0, 0.0), (0.0, 0.0), (10.0, 0.0), (10.0, 0.0)])
    assert [segment.length_m for *_, segment in line.feet((5.0, 1.0))] == [10.0]
    assert line.nearest((5.0, 1.0)) == (5.0, 0.0)


def test_the_feet_within_a_part_of_a_polyline_do_not_leave_it() -> None:
    feet = [(along_m, distance_m) for along_m, distance_m, _ in CORNER.feet((110, 50), 20, 120)]
    assert feet == [(100.0, pytest.approx(math.hypot(10, 50))), (120.0, pytest.approx(31.6228))]


COORDINATES = st.floats(-1e4, 1e4).map(lambda value: round(value, 3))
POINTS = st.tuples(COORDINATES, COORDINATES)


@given(st.lists(POINTS, min_size=2, max_size=6), POINTS)
def test_no_point_of_a_polyline_is_nearer_than_the_nearest(
    points: list[tuple[float, float]], place: tuple[float, float]
) -> None:
    line = Polyline(points)
    nearest_m = math.dist(line.nearest(place), place)
    for part in range(33):
        assert nearest_m <= math.dist(line.at(line.length_m * part / 32), place) + 1e-6


def test_a_segment_goes_on_before_its_start_and_beyond_its_end() -> None:
    segment = Segment.between((0.0, 0.0), (0.0, 10.0))
    assert segment.yaw_rad == pytest.approx(math.pi / 2)
    assert segment.along((5.0, -3.0)) == pytest.approx(-3.0)
    assert segment.at(12.0) == pytest.approx((0.0, 12.0), abs=1e-9)
    assert segment.distance_m((3.0, 14.0)) == pytest.approx(5.0)


def test_a_polyline_that_is_moved_aside_keeps_its_distance_at_a_right_angle() -> None:
    moved = shifted([(0.0, 0.0, 7.0), (100.0, 0.0, 8.0), (100.0, 50.0, 9.0)], 10.0)
    assert moved == [
        pytest.approx((0, 10, 7)),
        pytest.approx((90, 10, 8)),
        pytest.approx((90, 50, 9)),
    ]


@pytest.mark.parametrize(
    ("back_m", "end"),
    [(0.0, (100, 50, 0)), (20.0, (100, 30, 0)), (60.0, (90, 0, 0)), (-5.0, (100, 55, 0))],
)
def test_a_polyline_is_cut_short_or_made_longer_at_its_end(
    back_m: float, end: tuple[float, float, float]
) -> None:
    points = [(0.0, 0.0, 0.0), (100.0, 0.0, 0.0), (100.0, 50.0, 0.0)]
    assert trimmed(points, back_m)[-1] == pytest.approx(end)
