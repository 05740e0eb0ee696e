"""What a fleet says of a camera, and what it is told when that cannot be."""

import math
import subprocess
import sys
from pathlib import Path

import pytest
from m2pem_plugin_ptz.settings import DriverName, read_settings
from ptz_fake_camera import rad
from ptz_world import CAMERA

from m2pem.api import BehaviorType, Connection, ResourceId
from m2pem.errors import PluginError


def read(resource=CAMERA, **settings):
    given = {resource: Connection(ResourceId(resource), "ground", settings)}
    return read_settings(given)[resource]


def test_what_is_not_said_is_as_usual_and_what_is_not_ours_is_the_drivers():
    found = read(driver="onvif", host="127.0.0.1", port=8081, url="udpin://127.0.0.1:14550")
    assert found.driver is DriverName.ONVIF
    assert found.pictures == Path("pictures")
    assert found.own == {"host": "127.0.0.1", "port": 8081, "url": "udpin://127.0.0.1:14550"}
    assert found.reach.pan_rad == (-math.pi, math.pi)
    assert not found.reach.endless
    assert found.mounting.up_m == 2.0


def test_reach_and_mounting_carry_units():
    found = read(
        driver="ros",
        reach={
            "pan": ["-170 deg", "170 deg"],
            "tilt": ["-90 deg", "0.5 rad"],
            "zoom_max": 30,
            "rate": "90 deg/s",
            "view": ["62 deg", "36 deg"],
        },
        mounting={"forward": "40 cm", "left": 0, "up": "1.2 m", "pan": "180 deg"},
        pictures="/data/pictures",
        stabilized=True,
        delay="150 ms",
    )
    assert found.reach.pan_rad == pytest.approx((rad(-170), rad(170)))
    assert found.reach.tilt_rad == pytest.approx((rad(-90), 0.5))
    assert (found.reach.zoom_max, found.reach.rate_rad_s) == (30.0, pytest.approx(rad(90)))
    assert found.reach.view_rad == pytest.approx((rad(62), rad(36)))
    assert (found.mounting.forward_m, found.mounting.up_m) == (0.4, 1.2)
    assert found.mounting.pan_rad == pytest.approx(math.pi)
    assert (found.stabilized, found.delay_s) == (True, 0.15)
    assert found.own == {}


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ({}, "driver: it is missing; write one of ros, mavlink, onvif"),
        ({"driver": "mavsdk"}, "driver: 'mavsdk' is not a driver of cameras; write one of ros, "),
        ({"mountin": {}}, "mountin: there is no such setting; did you mean 'mounting'?"),
        ({"reach": 5}, "reach: 5 is not a map such as {pan: "),
        ({"reach": {"pann": 1}}, "reach.pann: there is no such setting; did you mean 'pan'?"),
        ({"reach": {"pan": "90 deg"}}, "reach.pan: '90 deg' is not two angles"),
        ({"reach": {"pan": [-90, 90]}}, "reach.pan: -90 has no unit"),
        ({"reach": {"tilt": ["30 deg", "-30 deg"]}}, "reach.tilt: the lowest comes first"),
        ({"reach": {"tilt": ["-100 deg", "0 deg"]}}, "reach.tilt: '-100 deg' is not within"),
        ({"reach": {"endless": True, "pan": ["-1 rad", "1 rad"]}}, "an endless camera has no pan"),
        ({"reach": {"zoom_max": 0.5}}, "reach.zoom_max: 0.5 is not a number from 1 to 1000"),
        ({"reach": {"rate": "0 deg/s"}}, "reach.rate: '0 deg/s' is not within"),
        ({"reach": {"view": ["60 deg", "200 deg"]}}, "reach.view: '200 deg' is not within"),
        ({"mounting": {"up": "2 deg"}}, "mounting.up: '2 deg' is an angle, not a distance"),
        ({"stabilized": "yes"}, "stabilized: 'yes' is neither true nor false"),
        ({"pictures": ""}, "pictures: '' is not the name of a folder"),
        ({"delay": "5 s"}, "delay: '5 s' is not within 0 and 2"),
    ],
)
def test_what_cannot_be_is_refused_with_the_resource_and_the_key(settings, problem):
    with pytest.raises(PluginError) as refused:
        read(**{"driver": "onvif", **settings} if settings else {})
    assert str(refused.value).startswith("ugv/ptz: connection.")
    assert problem in str(refused.value)


def test_a_vehicle_is_no_camera():
    with pytest.raises(PluginError, match="ugv: the arbiter 'ptz' serves payloads"):
        read(ResourceId("ugv"), driver="onvif")


def test_the_catalogue_has_all_that_payloads_share_and_needs_no_library():
    code = (
        "import sys; from m2pem_plugin_ptz.arbiter import PtzArbiter; "
        "from m2pem_plugin_ptz.catalogue import offered; "
        "print(sorted(spec.name for spec in offered()), 'numpy' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    names = [
        *("ptz_point_at", "ptz_scan_polygon", "ptz_scan_sector", "ptz_track"),
        *("record_video", "take_picture", "zoom"),
    ]
    assert done.stdout == f"{names} False\n"


def test_the_catalogue_is_of_payload_behaviors_that_write_what_missions_read():
    from m2pem_plugin_ptz.catalogue import offered

    writes = {spec.name: spec.writes for spec in offered()}
    assert {spec.type for spec in offered()} == {BehaviorType.PAYLOAD}
    assert "picture.files" in writes["take_picture"]
    assert "video.file" in writes["record_video"]
