import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.simulation.segments import chain, fit, rest_to_rest_length


def test_a_long_way_takes_cruising_time_and_half_of_each_ramp() -> None:
    profile = fit(100.0, 5.0, v_in=0.0, v_out=0.0, accel=1.0, decel=2.5)
    assert profile.duration_s == pytest.approx(100 / 5 + 5 / 2 + 2 / 2)
    assert profile.at(profile.duration_s) == (100.0, 0.0)


def test_a_short_way_never_reaches_the_limit() -> None:
    profile = fit(2.0, 50.0, v_in=0.0, v_out=0.0, accel=1.0, decel=1.0)
    assert profile.v_peak == pytest.approx(math.sqrt(2))
    assert profile.duration_s == pytest.approx(2 * math.sqrt(2))


def test_a_slow_piece_makes_its_neighbours_brake_before_it() -> None:
    before, slow, after = chain([(100.0, 10.0), (5.0, 2.0), (100.0, 10.0)], 1.0, 1.0)
    assert before.v_out == slow.v_in == 2.0
    assert slow.v_out == after.v_in == 2.0
    assert before.v_peak == 10.0


pieces = st.lists(st.tuples(st.floats(0.01, 500), st.floats(0.1, 30)), min_size=1, max_size=8)


@given(pieces, st.floats(0.1, 5), st.floats(0.1, 5))
def test_speed_is_continuous_and_within_every_limit(
    row: list[tuple[float, float]], accel: float, decel: float
) -> None:
    profiles = chain(row, accel, decel)
    assert profiles[0].v_in == profiles[-1].v_out == 0.0
    for (length, limit), profile, following in zip(
        row, profiles, [*profiles[1:], None], strict=True
    ):
        assert max(profile.v_in, profile.v_peak, profile.v_out) <= limit * (1 + 1e-9)
        # What speeding up and slowing down take must fit into the piece.
        ramps = (profile.v_peak**2 - profile.v_in**2) / (2 * accel)
        ramps += (profile.v_peak**2 - profile.v_out**2) / (2 * decel)
        assert ramps <= length * (1 + 1e-6)
        assert profile.at(profile.duration_s - 1e-9)[0] == pytest.approx(length, rel=1e-6, abs=1e-6)
        if following is not None:
            assert profile.v_out == following.v_in


@given(st.floats(0.1, 1000), st.floats(0.1, 30), st.floats(0.1, 5), st.floats(0.1, 5))
def test_length_for_a_time_is_driven_in_that_time(
    seconds: float, speed: float, accel: float, decel: float
) -> None:
    length = rest_to_rest_length(seconds, speed, accel, decel)
    profile = fit(length, speed, v_in=0.0, v_out=0.0, accel=accel, decel=decel)
    assert profile.duration_s == pytest.approx(seconds, rel=1e-6)


@given(pieces, st.floats(0.1, 5), st.floats(0.1, 5), st.floats(0, 1))
def test_the_time_of_a_distance_is_when_it_is_gone(
    ways: list[tuple[float, float]], accel: float, decel: float, share: float
) -> None:
    for profile in chain(ways, accel, decel):
        gone = share * profile.length
        assert profile.at(profile.when(gone))[0] == pytest.approx(gone, rel=1e-6, abs=1e-6)
