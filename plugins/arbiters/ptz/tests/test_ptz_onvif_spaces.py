"""What a camera's coordinate spaces mean on its vehicle."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from m2pem_plugin_ptz.drivers.onvif.spaces import PtzSpaces, SpaceDescription, read_spaces
from m2pem_plugin_ptz.gimbal import Reach

BASE = "http://www.onvif.org/ver10/tptz"
GENERIC = f"{BASE}/PanTiltSpaces/PositionGenericSpace"
DEGREES = f"{BASE}/PanTiltSpaces/SphericalPositionSpaceDegrees"
VELOCITY = f"{BASE}/PanTiltSpaces/VelocityGenericSpace"
VELOCITY_DEGREES = f"{BASE}/PanTiltSpaces/VelocitySpaceDegrees"
ZOOM = f"{BASE}/ZoomSpaces/PositionGenericSpace"
ZOOM_MM = f"{BASE}/ZoomSpaces/PositionSpaceMillimeter"

BOTH = (-1.0, 1.0)


def rad(low, high):
    return pytest.approx((math.radians(low), math.radians(high)))


def generic(**more):
    return PtzSpaces(positions=[SpaceDescription(GENERIC, BOTH, BOTH)], **more)


def degrees(pan, tilt, **more):
    return PtzSpaces(
        positions=[SpaceDescription(GENERIC, BOTH, BOTH), SpaceDescription(DEGREES, pan, tilt)],
        **more,
    )


REACH = Reach(pan_rad=(-2.0, 2.0), tilt_rad=(-1.0, 0.5))


@given(st.floats(-2.0, 2.0), st.floats(-1.0, 0.5), st.sets(st.sampled_from(["pan", "tilt"])))
def test_a_generic_camera_is_told_shares_of_the_fleets_reach_and_answers_in_them(
    pan, tilt, inverted
):
    spaces = read_spaces(generic(), REACH, frozenset(inverted))
    told = spaces.position(pan, tilt)
    sign = -1 if "pan" in inverted else 1
    assert told["x"] == pytest.approx(sign * pan / 2.0, abs=1e-9)
    assert spaces.ptz(told["x"], told["y"], GENERIC) == pytest.approx((pan, tilt), abs=1e-9)


@given(st.floats(-math.pi, math.pi), st.floats(-1.5, 0.5))
def test_degrees_are_preferred_and_need_nobodys_word(pan, tilt):
    spaces = read_spaces(degrees((-180.0, 180.0), (-90.0, 30.0)), Reach())
    told = spaces.position(pan, tilt)
    assert told["space"] == DEGREES
    assert told["x"] == pytest.approx(math.degrees(pan))
    assert told["y"] == pytest.approx(math.degrees(tilt))


def test_a_camera_that_answers_in_the_generic_space_is_understood_by_its_degrees():
    spaces = read_spaces(degrees((-170.0, 170.0), (-90.0, 30.0)), Reach())
    assert spaces.ptz(1.0, -1.0, GENERIC) == pytest.approx((math.radians(170), math.radians(-90)))
    assert spaces.ptz(0.0, 0.0, "") == pytest.approx((0.0, math.radians(-30)))


def test_the_case_and_the_host_of_a_space_do_not_matter():
    odd = "http://www.onvif.org/ver10/tptz/PantiltSpaces/positiongenericspace "
    assert read_spaces(generic(), REACH).ptz(1.0, 1.0, odd) == pytest.approx((2.0, 0.5))
    assert read_spaces(generic(), REACH).ptz(1.0, 1.0, f"{BASE}/Vendor/Space") is None


def test_the_reach_is_what_both_the_camera_and_the_fleet_say():
    spaces = read_spaces(
        degrees((-170.0, 170.0), (-20.0, 90.0)),
        Reach(pan_rad=(-math.pi, math.radians(100)), tilt_rad=(-1.0, math.radians(45))),
    )
    assert spaces.reach.pan_rad == rad(-170, 100)
    assert spaces.reach.tilt_rad == rad(-20, 45)


@given(st.floats(-math.pi, math.pi))
def test_a_camera_that_counts_from_0_to_360_is_told_so(pan):
    spaces = read_spaces(degrees((0.0, 360.0), (-90.0, 90.0)), Reach())
    assert spaces.reach.pan_rad == rad(0, 360)
    x = spaces.position(pan, 0.0)["x"]
    assert 0.0 <= x <= 360.0
    assert math.remainder(x - math.degrees(pan), 360.0) == pytest.approx(0.0, abs=1e-4)


def test_a_fleet_may_say_a_part_of_a_circle_that_the_camera_counts_otherwise():
    fleet = Reach(pan_rad=(math.radians(-100), math.radians(-20)))
    spaces = read_spaces(degrees((0.0, 360.0), (-90.0, 90.0)), fleet)
    assert spaces.reach.pan_rad == rad(-100, -20)
    assert spaces.position(math.radians(-90), 0.0)["x"] == pytest.approx(270.0)
    assert spaces.ptz(270.0, 0.0, DEGREES) == pytest.approx((math.radians(-90), 0.0))


def test_limits_that_are_set_in_the_camera_hold():
    limits = SpaceDescription(GENERIC, (-0.5, 0.5), (-1.0, 0.0))
    spaces = read_spaces(generic(limits=limits), REACH)
    assert spaces.reach.pan_rad == pytest.approx((-1.0, 1.0))
    assert spaces.reach.tilt_rad == pytest.approx((-1.0, -0.25))


def test_a_reach_that_does_not_meet_the_cameras_is_refused_with_both():
    with pytest.raises(
        ValueError, match=r"tilt from -20 to 90 deg, but the fleet says -90 to -30 deg"
    ):
        read_spaces(
            degrees((-180.0, 180.0), (-20.0, 90.0)),
            Reach(tilt_rad=(math.radians(-90), math.radians(-30))),
        )


def test_only_a_camera_that_says_a_whole_circle_can_be_endless():
    for pan, is_endless in (((-180.0, 179.9), True), ((-170.0, 170.0), False)):
        spaces = read_spaces(degrees(pan, (-90.0, 90.0)), Reach(endless=True))
        assert spaces.reach.endless is is_endless


def test_velocities_are_shares_of_the_fleets_rate_or_degrees_per_second():
    offer = generic(velocities=[SpaceDescription(VELOCITY, BOTH, BOTH)])
    slow = read_spaces(offer, Reach(rate_rad_s=2.0), frozenset({"tilt"})).velocity
    assert (slow.pan.to_units(1.0), slow.tilt.to_units(1.0)) == pytest.approx((0.5, -0.5))
    assert slow.pan.to_units(99.0) == 1.0
    ends = (-50.0, 50.0)
    both = [SpaceDescription(VELOCITY, BOTH, BOTH), SpaceDescription(VELOCITY_DEGREES, ends, ends)]
    exact = read_spaces(generic(velocities=both), Reach(rate_rad_s=2.0))
    assert exact.velocity.uri == VELOCITY_DEGREES
    assert exact.velocity.pan.to_units(math.radians(10)) == pytest.approx(10.0)
    assert exact.reach.rate_rad_s == pytest.approx(math.radians(50))


def test_zoom_is_focal_lengths_or_shares_of_what_the_fleet_says():
    both = [SpaceDescription(ZOOM, (0.0, 1.0)), SpaceDescription(ZOOM_MM, (4.0, 80.0))]
    spaces = read_spaces(generic(zooms=both), Reach())
    assert spaces.reach.zoom_max == pytest.approx(20.0)
    assert spaces.zooms[0].scale.to_units(5.0) == pytest.approx(20.0)
    assert spaces.zoom(0.5, ZOOM) == pytest.approx(10.5)
    shares = read_spaces(generic(zooms=both[:1]), Reach(zoom_max=11.0))
    assert shares.zooms[0].scale.to_units(6.0) == pytest.approx(0.5)
    unknown = read_spaces(generic(zooms=both[:1]), Reach())
    assert (unknown.zooms, unknown.reach.zoom_max) == ((), 1.0)


def test_a_fleet_may_allow_less_zoom_than_there_is():
    offer = generic(zooms=[SpaceDescription(ZOOM_MM, (4.0, 80.0))])
    assert read_spaces(offer, Reach(zoom_max=5.0)).reach.zoom_max == 5.0
