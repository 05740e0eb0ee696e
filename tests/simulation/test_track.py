import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.simulation.phases import Pose, Stand, Travel
from m2pem.simulation.speed import fit
from m2pem.simulation.track import Plan, Track, Warp

S = 1_000_000
STRAIGHT = Travel(
    (0.0, 0.0, 0.0),
    (1.0, 0.0, 0.0),
    0.0,
    fit(100.0, 5.0, v_in=0.0, v_out=0.0, accel=1.0, decel=1.0),
)


def test_a_plan_stands_at_its_end() -> None:
    plan = Plan([STRAIGHT])
    assert plan.at(1e6) == Pose((100.0, 0.0, 0.0), 0.0)
    assert plan.at(10.0).speed == 5.0


def test_a_plan_that_repeats_comes_back_to_the_same_place() -> None:
    pause = Stand((0.0, 0.0, 0.0), 0.0, 7.0, 0.0)
    plan: Plan[Pose] = Plan([pause, STRAIGHT, pause], cycle_from=1)
    lap_s = STRAIGHT.duration_s + 7.0
    assert plan.duration_s == math.inf
    assert plan.at(17.0 + 3 * lap_s).place == pytest.approx(plan.at(17.0).place)
    assert plan.work(17.0 + 3 * lap_s) == pytest.approx(plan.work(17.0) + 3 * STRAIGHT.duration_s)


def test_held_plan_time_stops_after_the_braking_and_never_ends() -> None:
    track = Track(Plan([STRAIGHT]), 0)
    track.hold(10 * S, 5.0)
    stopped = track.at(15 * S)
    assert stopped.speed == 0.0
    assert stopped.place[0] == pytest.approx(track.plan.at(10.0).place[0] + 12.5)
    assert track.at(1000 * S) == stopped
    assert track.end_us is None


def test_braking_is_no_harder_than_was_asked() -> None:
    track = Track(Plan([STRAIGHT]), 0)
    track.hold(10 * S, 5.0)
    assert track.at(12 * S).speed == pytest.approx(3.0)


@given(st.integers(6 * S, 15 * S), st.integers(6 * S, 5000 * S))
def test_a_pause_moves_the_end_by_exactly_the_pause(hold_us: int, pause_us: int) -> None:
    track = Track(Plan([STRAIGHT]), 0)
    end_us = track.end_us
    assert end_us is not None
    track.hold(hold_us, 5.0)
    track.go_on(hold_us + pause_us)
    assert track.end_us == pytest.approx(end_us + pause_us, abs=2)


@given(
    st.floats(0, 100),
    st.floats(0, 1),
    st.sampled_from([0.0, 1.0]),
    st.floats(0, 10),
    st.integers(0, 60 * S),
)
def test_when_is_the_inverse_of_at(
    tau: float, rate: float, target: float, ramp_s: float, now_us: int
) -> None:
    warp = Warp(0, tau, rate, target, ramp_s)
    reached, rate_now = warp.at(now_us)
    found = warp.when(reached)
    assert found is not None
    assert warp.at(found)[0] == pytest.approx(reached, abs=2e-6)
    assert 0 <= rate_now <= 1
    if rate_now > 0.01:
        assert found == pytest.approx(now_us, abs=200)


def test_load_is_that_of_the_phases_and_of_standing() -> None:
    track = Track(Plan([STRAIGHT]), 0)
    after_us = round(STRAIGHT.duration_s * S) + 100 * S
    assert track.load_s(after_us, 0.1) == pytest.approx(STRAIGHT.duration_s + 10.0)
    track.count_from(10 * S)
    assert track.load_s(12 * S, 0.1) == pytest.approx(2.0)
