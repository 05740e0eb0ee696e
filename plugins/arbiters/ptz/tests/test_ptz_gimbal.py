"""The way of a camera that is not to turn quickly."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from m2pem_plugin_ptz.gimbal import Ramp

ANGLE = st.floats(-3.0, 3.0)


@given(ANGLE, ANGLE, ANGLE, ANGLE, st.floats(0.05, 2.0), st.booleans())
def test_no_axis_is_quicker_than_the_rate_and_it_arrives(pan, tilt, to_pan, to_tilt, rate, endless):
    ramp = Ramp((pan, tilt), (to_pan, to_tilt), 5.0, rate, endless)
    assert ramp.at(4.0) == pytest.approx((pan, tilt))
    assert ramp.at(5.0 + ramp.seconds + 0.1) == (to_pan, to_tilt)
    steps = [ramp.at(5.0 + ramp.seconds * share / 20) for share in range(21)]
    for before, after in itertools.pairwise(steps):
        turned = abs(math.remainder(after[0] - before[0], math.tau))
        assert turned <= rate * ramp.seconds / 20 + 1e-6
        assert abs(after[1] - before[1]) <= rate * ramp.seconds / 20 + 1e-6


def test_the_shorter_way_round_is_for_what_turns_endlessly_alone():
    for endless, seconds in ((True, 2 * math.pi - 6.0), (False, 6.0)):
        assert Ramp((3.0, 0.0), (-3.0, 0.0), 0.0, 1.0, endless).seconds == pytest.approx(seconds)


def test_what_is_there_already_takes_no_time():
    assert Ramp((1.0, 1.0), (1.0, 1.0), 0.0, 1.0).at(0.0) == (1.0, 1.0)
