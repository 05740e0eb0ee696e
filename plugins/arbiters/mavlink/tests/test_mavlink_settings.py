import subprocess
import sys

import pytest
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.catalogue import offered
from m2pem_plugin_mavlink.settings import Settings, read_settings

from m2pem.api import Connection, ResourceId
from m2pem.api.clock import SystemClock
from m2pem.errors import PluginError
from m2pem.testing.contracts.arbiter_harness import context

V, W = ResourceId("uav1"), ResourceId("uav2")
URL = "udpin://127.0.0.1:14550"


def read(settings: dict, other: dict | None = None) -> Settings:
    connections = {V: Connection(V, "air", settings)}
    if other is not None:
        connections[W] = Connection(W, "air", other)
    return read_settings(connections)[V]


def test_what_is_left_out_has_its_usual_value() -> None:
    assert read({"url": URL, "system_id": 3}) == Settings((URL,), 3, 1, "pymavlink", 255, {})


def test_a_vehicle_may_be_heard_over_several_endpoints() -> None:
    urls = [URL, "serial:///dev/ttyUSB0:57600"]
    assert read({"url": urls, "system_id": 3}).urls == tuple(urls)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"system_id": 1}, "uav1: connection.url: a MAVLink vehicle needs one"),
        ({"url": [], "system_id": 1}, "connection.url"),
        ({"url": "127.0.0.1:14550", "system_id": 1}, "url: '127.0.0.1:14550' is not a URL"),
        ({"url": "http://x", "system_id": 1}, "connection.url"),
        ({"url": 7, "system_id": 1}, "connection.url"),
        ({"url": URL}, "uav1: connection.system_id: it is missing"),
        ({"url": URL, "system_id": 0}, "connection.system_id: 0 is not a whole number"),
        ({"url": URL, "system_id": 256}, "connection.system_id"),
        ({"url": URL, "system_id": "1"}, "connection.system_id"),
        ({"url": URL, "system_id": True}, "connection.system_id"),
        ({"url": URL, "system_id": 1, "component_id": -1}, "connection.component_id"),
        ({"url": URL, "system_id": 1, "gcs_system_id": 999}, "connection.gcs_system_id"),
        ({"url": URL, "system_id": 1, "driver": "dronekit"}, "connection.driver: 'dronekit'"),
        ({"url": URL, "system_id": 1, "actuators": ["x"]}, "connection.actuators"),
        ({"url": URL, "sysid": 1}, "connection.sysid: there is no such setting; did you mean"),
    ],
)
def test_a_setting_that_cannot_be_used_is_refused_by_resource_and_key(settings, said) -> None:
    with pytest.raises(PluginError) as error:
        read(settings)
    assert said in str(error.value)


def test_two_vehicles_are_not_the_same_system_of_an_endpoint() -> None:
    with pytest.raises(PluginError, match=r"uav2: connection.system_id: uav1 is system 1 of"):
        read({"url": URL, "system_id": 1}, {"url": URL, "system_id": 1})


def test_all_vehicles_hear_the_same_ground_station() -> None:
    with pytest.raises(PluginError, match=r"uav2: connection.gcs_system_id"):
        read({"url": URL, "system_id": 1}, {"url": URL, "system_id": 2, "gcs_system_id": 7})


def test_payloads_need_no_settings_of_their_own() -> None:
    camera = ResourceId("uav1/camera")
    assert read_settings({camera: Connection(camera, "air", {})}) == {}


@pytest.mark.parametrize(
    ("domain", "has", "has_not"),
    [
        ("air", {"takeoff", "land", "change_altitude", "run_onboard_mission"}, {"reverse"}),
        ("ground", {"reverse", "drive_stop", "deploy"}, {"takeoff", "land", "change_altitude"}),
        ("surface", {"goto", "area_survey"}, {"takeoff"}),
        ("subsurface", {"change_altitude"}, {"takeoff", "land"}),
    ],
)
def test_a_domain_is_offered_what_it_can_do(domain, has, has_not) -> None:
    names = {spec.name for spec in offered(domain)}
    assert has <= names
    assert not has_not & names


def test_every_behavior_that_is_offered_is_there() -> None:
    from m2pem_plugin_mavlink.behaviors import BEHAVIORS

    names = {spec.name for domain in ("air", "ground", "subsurface") for spec in offered(domain)}
    assert names == set(BEHAVIORS)


def test_every_altitude_and_position_takes_a_frame() -> None:
    for spec in offered("air"):
        if {"altitude", "target"} & set(spec.by_name) and spec.name != "follow":
            assert "altitude_frame" in spec.by_name, spec.name


def test_the_catalogue_needs_no_mavlink_library() -> None:
    code = (
        "import sys\n"
        "from m2pem.api import Connection, ArbiterContext\n"
        "from m2pem_plugin_mavlink.arbiter import MavlinkArbiter\n"
        "import logging\n"
        "context = ArbiterContext(None, None, logging.getLogger(), (0, 0, 0))\n"
        "settings = {'url': 'udpin://127.0.0.1:14550', 'system_id': 1}\n"
        "arbiter = MavlinkArbiter({'v': Connection('v', 'air', settings)}, context)\n"
        "assert arbiter.catalogue('v') and arbiter.limits('v')\n"
        "assert not {'pymavlink', 'mavsdk'} & set(sys.modules), sorted(sys.modules)\n"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_an_address_is_shared_unless_the_kernel_chooses_its_port() -> None:
    urls = [URL, "udpin://127.0.0.1:0", "tcpin://127.0.0.1:0"]
    connections = {V: Connection(V, "air", {"url": urls, "system_id": 7})}
    arbiter = MavlinkArbiter(connections, context(SystemClock()))
    assert arbiter.addresses(V) == [f"system 7 on {URL}"]
