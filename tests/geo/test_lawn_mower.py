import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.geo.lawn_mower import MAX_STRIPS, Ring, longest_edge_yaw
from tests.geo.passes import lawn_mower

SQUARE: Ring = [(0, 0), (100, 0), (100, 60), (0, 60), (0, 0)]


def inside(rings: list[Ring], point: tuple[float, float]) -> bool:
    x, y = point
    odd = False
    for ring in rings:
        for (ax, ay), (bx, by) in pairwise(ring):
            if (ay > y) != (by > y) and x < (bx - ax) * (y - ay) / (by - ay) + ax:
                odd = not odd
    return odd


def distance(points: list[tuple[float, float]], place: tuple[float, float]) -> float:
    best = math.inf
    for a, b in pairwise(points):
        length2 = math.dist(a, b) ** 2
        part = 0.0
        if length2:
            dot = (place[0] - a[0]) * (b[0] - a[0]) + (place[1] - a[1]) * (b[1] - a[1])
            part = max(0.0, min(1.0, dot / length2))
        near = (a[0] + (b[0] - a[0]) * part, a[1] + (b[1] - a[1]) * part)
        best = min(best, math.dist(near, place))
    return best


def test_a_rectangle_is_covered_by_parallel_passes_to_and_fro() -> None:
    points = lawn_mower([SQUARE], 20.0, 0.0)
    assert points == [(0, 10), (100, 10), (100, 30), (0, 30), (0, 50), (100, 50)]


def test_overshoot_makes_each_pass_longer_at_both_ends() -> None:
    points = lawn_mower([SQUARE], 60.0, 0.0, overshoot_m=7.0)
    assert points == [(-7, 30), (107, 30)]


def test_a_hole_is_not_surveyed() -> None:
    hole = [(40, 20), (60, 20), (60, 40), (40, 40), (40, 20)]
    points = lawn_mower([SQUARE, hole], 20.0, 0.0)
    assert ((0, 30) in points, (40, 30) in points, (60, 30) in points) == (True, True, True)


def test_the_longest_edge_gives_the_direction() -> None:
    assert longest_edge_yaw([(0, 0), (0, 50), (10, 50), (0, 0)]) in (
        pytest.approx(math.pi / 2),
        pytest.approx(math.atan2(-50, -10)),
    )


def test_a_spacing_that_makes_too_many_passes_is_refused_with_their_number() -> None:
    with pytest.raises(ValueError, match=r"spacing.*6000 passes"):
        lawn_mower([SQUARE], 0.01, 0.0)
    assert MAX_STRIPS < 6000


@settings(max_examples=80, deadline=None)
@given(
    st.lists(st.floats(10, 100), min_size=3, max_size=9),
    st.floats(5, 60),
    st.floats(-math.pi, math.pi),
    st.lists(st.tuples(st.floats(-100, 100), st.floats(-100, 100)), min_size=10, max_size=20),
)
def test_every_point_of_any_area_is_within_half_a_spacing(
    radii: list[float], spacing: float, yaw: float, tries: list[tuple[float, float]]
) -> None:
    corners = [
        (radius * math.cos(math.tau * i / len(radii)), radius * math.sin(math.tau * i / len(radii)))
        for i, radius in enumerate(radii)
    ]
    ring = [*corners, corners[0]]
    points = lawn_mower([ring], spacing, yaw)
    for place in tries:
        if inside([ring], place):
            assert distance(points, place) <= spacing / 2 + 1e-6


@settings(max_examples=80, deadline=None)
@given(
    st.lists(st.floats(10, 100), min_size=3, max_size=9),
    st.floats(5, 60),
    st.floats(-math.pi, math.pi),
)
def test_passes_are_parallel_and_at_most_a_spacing_apart(
    radii: list[float], spacing: float, yaw: float
) -> None:
    corners = [
        (radius * math.cos(math.tau * i / len(radii)), radius * math.sin(math.tau * i / len(radii)))
        for i, radius in enumerate(radii)
    ]
    points = lawn_mower([[*corners, corners[0]]], spacing, yaw)
    across = [north * math.cos(yaw) - east * math.sin(yaw) for east, north in points]
    assert across[::2] == pytest.approx(across[1::2])
    assert all(0.0 <= b - a + 1e-9 <= spacing + 1e-6 for a, b in pairwise(across[::2]))
