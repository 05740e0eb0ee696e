"""Pan stops, endless pan, tilt limits."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from m2pem_plugin_ptz.camera_model.frames import angle_between
from m2pem_plugin_ptz.camera_model.limits import nearest_reachable
from m2pem_plugin_ptz.gimbal import Reach
from ptz_fake_camera import rad

STOPS = Reach(pan_rad=(rad(-170), rad(170)), tilt_rad=(rad(-90), rad(30)))
TWO_TURNS = Reach(pan_rad=(rad(-340), rad(340)))
ENDLESS = Reach(endless=True)
angles = st.floats(-10, 10)
tilts = st.floats(-math.pi / 2, math.pi / 2)


@given(st.sampled_from([STOPS, TWO_TURNS, ENDLESS]), angles, tilts, st.floats(-2.9, 2.9))
def test_a_turn_is_within_reach_and_looks_there_unless_it_says_what_is_missing(
    reach, pan, tilt, start
):
    found = nearest_reachable(reach, pan, tilt, start)
    assert reach.pan_rad[0] - 1e-9 <= found.pan_rad <= reach.pan_rad[1] + 1e-9
    assert reach.tilt_rad[0] <= found.tilt_rad <= reach.tilt_rad[1]
    off = angle_between((found.pan_rad, found.tilt_rad), (pan, tilt))
    assert off == pytest.approx(found.missing_rad, abs=1e-6)
    assert bool(found.why) == (found.missing_rad > 0)


def test_a_camera_with_room_for_it_turns_the_short_way():
    assert nearest_reachable(TWO_TURNS, rad(-170), 0.0, rad(175)).pan_rad == pytest.approx(rad(190))
    assert nearest_reachable(TWO_TURNS, rad(10), 0.0, rad(-335)).pan_rad == pytest.approx(
        rad(-350 + 360)
    )


def test_beyond_a_stop_it_stays_at_the_nearer_one():
    found = nearest_reachable(STOPS, rad(178), 0.0, 0.0)
    assert found.pan_rad == pytest.approx(rad(170))
    assert found.missing_rad == pytest.approx(rad(8))
    assert found.why == "pan 178 deg is beyond its stops, -170 to 170 deg"
    assert nearest_reachable(STOPS, rad(-178), 0.0, rad(100)).pan_rad == pytest.approx(rad(-170))


def test_beyond_a_tilt_limit_it_says_so():
    assert (
        nearest_reachable(STOPS, 0.0, rad(50), 0.0).why
        == "tilt 50 deg is beyond its limits, -90 to 30 deg"
    )


def test_with_slack_it_waits_at_its_stop_before_it_turns_all_round():
    half = Reach()
    assert nearest_reachable(half, rad(-178), 0.0, rad(179)).pan_rad == pytest.approx(rad(-178))
    waits = nearest_reachable(half, rad(-178), 0.0, rad(179), rad(5))
    assert (waits.pan_rad, waits.missing_rad) == pytest.approx((math.pi, rad(2)))
    assert nearest_reachable(half, rad(-170), 0.0, rad(179), rad(5)).pan_rad == pytest.approx(
        rad(-170)
    )


def test_an_endless_camera_reaches_every_pan():
    assert nearest_reachable(ENDLESS, rad(190), 0.0, rad(170)).pan_rad == pytest.approx(rad(-170))
