"""Directions and places, against libraries that were written by others."""

import math

import numpy as np
import pymap3d
import pyproj
import pytest
from geographiclib.geodesic import Geodesic
from hypothesis import given, settings
from hypothesis import strategies as st
from m2pem_plugin_ptz.camera_model.field_of_view import (
    RANGE_M,
    FieldOfView,
    footprint,
    ranges_m,
    visible,
)
from m2pem_plugin_ptz.camera_model.frames import (
    angle_between,
    ecef,
    enu_of_deck,
    geodetic,
    up_and_heights_m,
)
from m2pem_plugin_ptz.camera_model.pose import VehiclePose, camera_pose, mount_frame
from m2pem_plugin_ptz.settings import Mounting
from ptz_fake_camera import rad

from m2pem.api import GeoPosition

EXACT = 1e-7
NONE = Mounting(0.0, 0.0, 0.0)
ENU = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978")

latitudes = st.floats(-85, 85)
longitudes = st.floats(-179, 179)
angles = st.floats(-math.pi, math.pi)
leans = st.floats(-0.6, 0.6)
distances = st.floats(5, 20_000)


def pose(lat, lon, alt=100.0, yaw=math.pi / 2, roll=0.0, pitch=0.0):
    return VehiclePose(GeoPosition(lat, lon, alt), yaw, roll, pitch)


def camera(*args, mounting=NONE, stabilized=False, **more):
    return camera_pose(pose(*args, **more), mounting, stabilized=stabilized)


def apart_rad(found, right):
    return angle_between(found, right)


@given(latitudes, longitudes, angles, distances, st.floats(-200, 200), angles)
def test_a_level_vehicle_sees_a_target_where_a_geodesic_leads(lat, lon, azimuth, far, up, yaw):
    """The geodesic's azimuth is that of the target; over so short a way it bends by nothing."""
    line = Geodesic.WGS84.Direct(lat, lon, math.degrees(azimuth), far)
    target = GeoPosition(line["lat2"], line["lon2"], 100.0 + up)
    pan, _ = camera(lat, lon, yaw=yaw).at(ecef(target))
    heading = math.pi / 2 - yaw + pan
    # A target that is higher or lower leaves the normal section by far less than a microradian.
    assert abs(math.remainder(heading - azimuth, math.tau)) < 1e-5


@given(latitudes, longitudes, angles, distances, st.floats(-200, 200))
@pytest.mark.tried_with(
    "PROJ",
    "where a camera looks",
    kind="Maps and geodesy",
    result="the same elevation",
    package="pyproj",
)
def test_the_elevation_is_that_of_a_topocentric_frame_of_proj(lat, lon, azimuth, far, up):
    line = Geodesic.WGS84.Direct(lat, lon, math.degrees(azimuth), far)
    topocentric = pyproj.Transformer.from_pipeline(
        "+proj=pipeline +step +proj=axisswap +order=2,1,3 "
        "+step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=cart +ellps=WGS84 "
        f"+step +proj=topocentric +ellps=WGS84 +lat_0={lat} +lon_0={lon} +h_0=100"
    )
    east, north, above = topocentric.transform(line["lat2"], line["lon2"], 100.0 + up)
    right = (math.atan2(east, north), math.atan2(above, math.hypot(east, north)))
    target = ecef(GeoPosition(line["lat2"], line["lon2"], 100.0 + up))
    assert apart_rad(camera(lat, lon).at(target), right) < EXACT


@given(latitudes, longitudes, st.floats(-400, 9000))
def test_ecef_is_that_of_proj(lat, lon, alt):
    assert np.allclose(ecef(GeoPosition(lat, lon, alt)), ENU.transform(lat, lon, alt), atol=1e-6)


@pytest.mark.parametrize(
    ("roll", "pitch", "vector", "goes_to"),
    [
        (rad(10), 0.0, (0, 1, 0), (0, math.cos(rad(10)), math.sin(rad(10)))),
        (0.0, rad(10), (1, 0, 0), (math.cos(rad(10)), 0, -math.sin(rad(10)))),
    ],
    ids=["right side down", "bow down"],
)
def test_positive_roll_and_pitch_lower_the_right_side_and_the_bow(roll, pitch, vector, goes_to):
    assert enu_of_deck(roll, pitch, 0.0) @ np.array(vector) == pytest.approx(goes_to)


def test_a_vehicle_that_has_its_bow_up_tilts_its_camera_down_to_the_horizon():
    seen = mount_frame(NONE, 0.0, rad(-15), 0.0, stabilized=False).towards(math.pi / 2, 0.0)
    assert seen == pytest.approx((0.0, rad(-15)))
    aside = mount_frame(NONE, rad(8), 0.0, 0.0, stabilized=False).towards(math.pi, 0.0)
    assert aside == pytest.approx((rad(90), rad(8))), "starboard is down: the horizon is above it"


def test_a_stabilized_camera_takes_no_notice_of_roll_and_pitch():
    level = mount_frame(NONE, 0.0, 0.0, 1.0, stabilized=False).towards(0.3, -0.2)
    assert mount_frame(NONE, 0.4, 0.3, 1.0, stabilized=True).towards(0.3, -0.2) == pytest.approx(
        level
    )


def test_pan_counts_from_where_the_mounting_has_its_zero():
    seen = mount_frame(Mounting(pan_rad=rad(90)), 0, 0, math.pi / 2, stabilized=False).towards(
        rad(90), 0
    )
    assert seen == pytest.approx((0.0, 0.0))


def test_a_camera_is_where_its_mounting_is_on_a_leaning_vehicle():
    mounted = Mounting(1.0, 0.5, 3.0)
    upright = camera(38.0, -77.0, mounting=mounted, yaw=0.0)
    offset = camera(38.0, -77.0).vector_to(upright.place)
    assert offset == pytest.approx((1.0, 0.5, 3.0), abs=1e-6)
    rolled = camera(38.0, -77.0, mounting=mounted, yaw=0.0, roll=math.pi / 2)
    assert camera(38.0, -77.0).vector_to(rolled.place) == pytest.approx((1.0, -3.0, 0.5), abs=1e-6)


@given(latitudes, longitudes, angles, leans, leans, angles, st.floats(-1.5, -0.05))
@settings(max_examples=60)
def test_the_ground_that_a_look_hits_is_looked_at_by_that_look(
    lat, lon, yaw, roll, pitch, bearing, tilt
):
    """The inverse of pointing, on a vehicle that leans; exact on the ellipsoid."""
    mounted = Mounting(0.4, -0.2, 2.0, 0.7)
    high = camera(lat, lon, 300.0, mounting=mounted, yaw=yaw, roll=roll, pitch=pitch)
    ray = high.mount_frame.vector(bearing, tilt)
    (far,) = ranges_m(high, ray[None, :], 50.0)
    if math.isnan(far):
        assert ray[2] > -0.01, "what looks down meets the ground"
        return
    hit = high.place + far * (ray @ high.enu)
    assert geodetic(hit).altitude_m == pytest.approx(50.0, abs=1e-3)
    assert apart_rad(high.at(hit), (bearing, tilt)) < EXACT


@given(latitudes, longitudes, st.floats(0, math.tau))
@settings(max_examples=40)
def test_the_ground_is_hit_where_proj_has_its_height(lat, lon, heading):
    high = camera(lat, lon, 2_000.0)
    ray = mount_frame(NONE, 0, 0, math.pi / 2, stabilized=False).vector(heading, rad(-3))
    (far,) = ranges_m(high, ray[None, :], 100.0)
    place = high.place + far * (ray @ high.enu)
    height = pyproj.Transformer.from_crs("EPSG:4978", "EPSG:4979").transform(*place)[2]
    assert height == pytest.approx(100.0, abs=1e-3)


def test_above_the_horizon_and_below_the_ground_nothing_is_hit():
    low = camera(38.0, -77.0, 10.0)
    rays = np.array([low.mount_frame.vector(0.0, tilt) for tilt in (rad(5), 0.0, rad(-0.01))])
    assert np.isnan(ranges_m(low, rays, 0.0)).all(), "10 m up, the horizon is 0.1 deg down"
    assert np.isnan(ranges_m(low, np.array([low.mount_frame.vector(0.0, rad(-5))]), 20.0)).all()


def test_the_ground_ends_at_the_horizon():
    low = camera(38.0, -77.0, 10.0)
    horizon_m = math.sqrt(2 * 6_371_000 * 10.0)
    near, far = (
        Geodesic.WGS84.Direct(38.0, -77.0, 45.0, horizon_m * share) for share in (0.97, 1.03)
    )
    places = np.array([ecef(GeoPosition(each["lat2"], each["lon2"], 0.0)) for each in (near, far)])
    assert visible(low, places).tolist() == [True, False]


# --- views and footprints -----------------------------------------------------------------------


def footprint_of(high, tilt, pan=0.0, view=None, ground=0.0):
    axes = high.mount_frame.axes(pan, tilt)
    return footprint(high, axes, view or FieldOfView(rad(60), rad(34)), ground)


def test_straight_down_the_footprint_is_the_pictures_rectangle():
    corners = footprint_of(camera(38.0, -77.0, 100.0), -math.pi / 2)
    sides = [
        Geodesic.WGS84.Inverse(*_lat_lon(a), *_lat_lon(b))["s12"]
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)
    ]
    wide, high = 200 * math.tan(rad(30)), 200 * math.tan(rad(17))
    assert sides == pytest.approx([wide, high, wide, high], rel=1e-3)


def test_zoom_narrows_the_view_as_a_longer_lens_does():
    view = FieldOfView(rad(60), rad(34)).zoomed(10.0)
    assert math.tan(view.width_rad / 2) * 10 == pytest.approx(math.tan(rad(30)))


def test_a_view_that_reaches_beyond_the_horizon_is_cut_off():
    high = camera(38.0, -77.0, 10.0)
    corners = footprint_of(high, rad(-5))
    far = [Geodesic.WGS84.Inverse(38.0, -77.0, *_lat_lon(corner))["s12"] for corner in corners]
    assert max(far) == pytest.approx(RANGE_M, rel=0.01)
    assert min(far) < 100
    assert all(corner.altitude_m == pytest.approx(0.0, abs=1.0) for corner in corners)
    headings = [_azimuth(corner) for corner in corners]
    assert max(headings) - min(headings) < 75, "it is no wider than the view"


def test_a_view_above_the_horizon_has_no_footprint():
    assert footprint_of(camera(38.0, -77.0, 10.0), rad(30)) == ()


@given(leans, leans, angles, st.floats(-1.5, 0.4), st.floats(0, 1), st.floats(0, 1))
@settings(max_examples=80)
def test_what_is_inside_of_the_footprint_is_in_the_picture(roll, pitch, pan, tilt, u, v):
    """Any mixture of the corners of a convex footprint is seen by the camera."""
    high = camera(38.0, -77.0, 120.0, roll=roll, pitch=pitch)
    axes, view = high.mount_frame.axes(pan, tilt), FieldOfView(rad(60), rad(34))
    corners = footprint_of(high, tilt, pan, view)
    if not corners:
        return
    a, b, c = corners[0], corners[len(corners) // 3], corners[2 * len(corners) // 3]
    u, v = (u, v) if u + v <= 1 else (1 - u, 1 - v)
    lat = a.latitude_deg + u * (b.latitude_deg - a.latitude_deg)
    lon = a.longitude_deg + u * (b.longitude_deg - a.longitude_deg)
    lat += v * (c.latitude_deg - a.latitude_deg)
    lon += v * (c.longitude_deg - a.longitude_deg)
    seen = high.vector_to(ecef(GeoPosition(lat, lon, 0.0)))
    assert view.holds(axes, seen[None, :], 1.001)[0]


def _lat_lon(position):
    return position.latitude_deg, position.longitude_deg


def _azimuth(position):
    return Geodesic.WGS84.Inverse(38.0, -77.0, *_lat_lon(position))["azi1"]


def test_places_are_those_of_pymap3d_everywhere() -> None:
    dice = np.random.default_rng(1)
    latitude = np.array([90.0, -90.0, 0.0, *dice.uniform(-90, 90, 200)])
    longitude = dice.uniform(-180, 180, 203)
    height = dice.uniform(-400, 10_000, 203)
    places = np.column_stack(pymap3d.geodetic2ecef(latitude, longitude, height))
    up, heights_m = up_and_heights_m(places)
    assert heights_m == pytest.approx(height, abs=1e-6)
    lat, lon = np.radians(latitude), np.radians(longitude)
    assert up[:, 0] == pytest.approx(np.cos(lat) * np.cos(lon), abs=1e-9)
    assert up[:, 1] == pytest.approx(np.cos(lat) * np.sin(lon), abs=1e-9)
    assert up[:, 2] == pytest.approx(np.sin(lat), abs=1e-9)
    for place, *expected in zip(places[3:], latitude[3:], longitude[3:], height[3:], strict=True):
        found = geodetic(place)
        assert ecef(found) == pytest.approx(place, abs=1e-6)
        assert (found.latitude_deg, found.longitude_deg) == pytest.approx(expected[:2], abs=1e-9)
        assert found.altitude_m == pytest.approx(expected[2], abs=1e-6)
