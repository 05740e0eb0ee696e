"""What the measurement of a survey counts: each pass, and what two passes have in common."""

import pytest

from bench.coverage import Coverage, Sample, optimum_s


def straight(north_m: float, from_m: float, to_m: float, begin_s: float = 0.0) -> list[Sample]:
    step = 1.0 if to_m > from_m else -1.0
    count = round(abs(to_m - from_m))
    return [(begin_s + index, from_m + step * index, north_m) for index in range(count + 1)]


def test_two_passes_over_an_area_cover_it_once() -> None:
    coverage = Coverage(100.0, 40.0, 20.0)
    coverage.add([*straight(10.0, 0.0, 100.0), *straight(30.0, 100.0, 0.0, 200.0)])
    assert (coverage.covered, coverage.twice) == (1.0, 0.0)


def test_what_was_surveyed_again_counts_twice() -> None:
    coverage = Coverage(100.0, 40.0, 20.0)
    coverage.add(straight(10.0, 0.0, 100.0))
    coverage.add(straight(10.0, 60.0, 100.0))
    assert coverage.covered == pytest.approx(0.5)
    assert coverage.twice == pytest.approx(0.2, abs=0.01)


def test_a_gap_is_not_covered() -> None:
    coverage = Coverage(100.0, 20.0, 20.0)
    coverage.add(straight(10.0, 0.0, 50.0))
    assert coverage.covered == pytest.approx(0.51, abs=0.01)


def test_the_way_to_another_pass_surveys_nothing() -> None:
    coverage = Coverage(100.0, 40.0, 20.0)
    coverage.add([(0.0, 0.0, 0.0), (10.0, 100.0, 40.0), (20.0, 100.0, 0.0)])
    coverage.add(straight(20.0, 0.0, 100.0))
    assert coverage.covered == 0.0


def test_the_least_time_is_that_of_all_at_work() -> None:
    assert optimum_s(900.0, [4.0, 5.0], 20.0) == pytest.approx(120.0)
