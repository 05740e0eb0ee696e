"""Where a vehicle is along a path."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from m2pem_plugin_ros.behaviors.path import Path, Progress

SHARP_RAD = math.radians(50.0)
places = st.tuples(st.floats(-50, 50), st.floats(-50, 50))


def test_a_sharp_corner_is_not_passed_by_coming_near_to_what_is_after_it() -> None:
    progress = Progress(Path([(0.0, 0.0), (20.0, 0.0), (0.0, 2.0)]), SHARP_RAD)
    progress.advance((15.0, 0.0), 100.0)
    progress.advance((18.0, 0.8), 100.0)
    assert progress.driven_m == pytest.approx(18.0)
    progress.advance((19.95, 0.8), 100.0)
    assert progress.driven_m == pytest.approx(20.0)
    progress.advance((18.0, 0.2), 100.0)
    assert progress.driven_m == pytest.approx(22.0, abs=0.1)


def test_what_is_farther_ahead_than_the_window_is_not_gone_on_to() -> None:
    circle = [(10 * math.sin(k / 3), 10 - 10 * math.cos(k / 3)) for k in range(40)]
    progress = Progress(Path(circle), SHARP_RAD)
    progress.advance((0.0, 0.0), 3.0)
    assert progress.driven_m < 1.0


def test_before_a_sharp_corner_and_at_the_end_one_steers_straight_on() -> None:
    progress = Progress(Path([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]), SHARP_RAD)
    progress.advance((8.0, 0.0), 20.0)
    assert progress.point_ahead(5.0) == pytest.approx((13.0, 0.0))
    progress.advance((10.0, 0.0), 20.0)
    progress.advance((10.0, 9.0), 20.0)
    assert progress.point_ahead(5.0) == pytest.approx((10.0, 14.0))


def test_a_shallow_corner_is_steered_round() -> None:
    progress = Progress(Path([(0.0, 0.0), (10.0, 0.0), (20.0, 5.0)]), SHARP_RAD)
    progress.advance((8.0, 0.0), 20.0)
    east, north = progress.point_ahead(5.0)
    assert east > 12.0
    assert north == pytest.approx((east - 10.0) / 2)


def test_waypoints_at_one_place_are_one() -> None:
    path = Path([(0.0, 0.0), (0.0, 0.01), (5.0, 0.0), (5.0, 0.0)])
    assert path.length_m == pytest.approx(5.0)
    assert path.leg(1) is None


def test_a_lap_goes_back_to_where_it_begins_not_to_the_way_there() -> None:
    path = Path([(-5.0, 0.0), (0.0, 0.0), (10.0, 0.0), (10.0, 10.0)], lap_from=1)
    starts = [leg.start for number in range(8) if (leg := path.leg(number)) is not None]
    lap = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]
    assert starts == [(-5.0, 0.0), *lap, *lap, (0.0, 0.0)]


@given(
    path=st.lists(places, min_size=2, max_size=8),
    seen=st.lists(places, max_size=30),
    window_m=st.floats(0.5, 20.0),
    loop=st.booleans(),
)
def test_progress_never_goes_back_and_never_by_more_than_the_window(
    path: list[tuple[float, float]],
    seen: list[tuple[float, float]],
    window_m: float,
    loop: bool,
) -> None:
    progress = Progress(Path(path, 0 if loop else None), SHARP_RAD)
    before = 0.0
    for place in seen:
        progress.advance(place, window_m)
        assert before - 1e-9 <= progress.driven_m <= before + window_m + 0.2
        assert progress.left_m >= -1e-6
        before = progress.driven_m


@given(path=st.lists(places, min_size=2, max_size=8), share=st.floats(0.0, 1.0))
def test_who_is_found_again_on_the_path_is_on_it(
    path: list[tuple[float, float]], share: float
) -> None:
    made = Path(path)
    progress = Progress(made, SHARP_RAD)
    leg = made.leg(0)
    if leg is None:
        return
    for number in range(len(path)):
        if (last := made.leg(number)) is not None:
            progress.advance(last.at(last.length_m), 1e6)
    place = leg.at(share * leg.length_m)
    progress.find_again(place, made.length_m + 1.0)
    found = progress.leg
    assert found is not None
    assert math.dist(progress.point_ahead(0.0), place) < 1e-3
