import math
import subprocess
import sys

import pytest
from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.settings import (
    DOMAINS,
    Bounds,
    DetectorMessage,
    DetectorSettings,
    DriverName,
    FixAltitude,
    OdomFrame,
    RouteAction,
    Settings,
    Topics,
    Via,
    read_detectors,
    read_settings,
)

from m2pem.api import Connection, ResourceId
from m2pem.errors import PluginError
from m2pem.testing.contracts.arbiter_harness import context

V, W, GPR = ResourceId("evsg1"), ResourceId("evsg2"), ResourceId("evsg1/gpr")
LEAST = {"namespace": "/evsg1"}


def read(settings: dict, domain: str = "ground") -> Settings:
    return read_settings({V: Connection(V, domain, settings)})[V]


def read_payload(settings: dict, vehicle: dict | None = None, *, detector: bool = False):
    connections = {GPR: Connection(GPR, "ground", settings, detector=detector)}
    if vehicle is not None:
        connections[V] = Connection(V, "ground", vehicle)
    return read_detectors(connections).get(GPR)


def test_what_is_left_out_has_its_usual_value() -> None:
    assert read(LEAST) == Settings("/evsg1", hardware_id="evsg1")


def test_all_that_may_be_said_is_read() -> None:
    said = {
        "namespace": "fleet/evsg1",
        "domain_id": 42,
        "driver": "base",
        "topics": {"odom": "odometry/global", "cmd_vel": "/evsg1/drive"},
        "odom_frame": "odom",
        "fix_altitude": "mean_sea_level",
        "stamped": True,
        "hardware_id": "SN-7",
        "bounds": {
            "speed": "7.2 km/h",
            "reverse_speed": 0.5,
            "acceleration": "1.5 m/s2",
            "yaw_rate": "90 deg/s",
            "turn_radius": "400 cm",
            "lateral_acceleration": 2,
        },
        "sim": {"heading": "60 deg"},
    }
    assert read(said, "surface") == Settings(
        "/fleet/evsg1",
        42,
        DriverName.BASE,
        topics=Topics(odom="odometry/global", cmd_vel="/evsg1/drive"),
        odom_frame=OdomFrame.ODOM,
        fix_altitude=FixAltitude.MEAN_SEA_LEVEL,
        stamped=True,
        bounds=Bounds(2.0, 0.5, 1.5, pytest.approx(math.pi / 2), 4.0, 2.0),
        hardware_id="SN-7",
    )
    assert read({**LEAST, "via": "action"}).via is Via.ACTION
    nav2 = read({**LEAST, "driver": "nav2", "route_action": "waypoints"})
    assert nav2.route_action is RouteAction.WAYPOINTS


def test_names_are_in_the_namespace_unless_they_are_full() -> None:
    assert read(LEAST).topic("odom") == "/evsg1/odom"
    assert read(LEAST).topic("/diagnostics") == "/diagnostics"
    assert read({"namespace": "/"}).topic("odom") == "/odom"


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({}, "evsg1: connection.namespace: it is missing"),
        ({"namespace": "/evsg 1"}, "connection.namespace: '/evsg 1' is not a ROS namespace"),
        ({"namespace": 7}, "connection.namespace: 7"),
        ({"namespace": ""}, "connection.namespace: ''"),
        ({"namespace": "/1"}, "connection.namespace"),
        ({**LEAST, "domain": 3}, "connection.domain: there is no such setting; did you mean 'dom"),
        ({**LEAST, "colour": 3}, "connection.colour: there is no such setting; known: namespace"),
        ({**LEAST, "domain_id": "42"}, "connection.domain_id: '42' is not a whole number from 0"),
        ({**LEAST, "domain_id": 233}, "connection.domain_id: 233"),
        ({**LEAST, "domain_id": True}, "connection.domain_id: True"),
        ({**LEAST, "fix_altitude": "amsl"}, "'amsl' is none of ellipsoid, mean_sea_level"),
        ({**LEAST, "driver": "mavros"}, "'mavros' is none of m2pem, nav2, base"),
        ({**LEAST, "driver": "base", "via": "action"}, "connection.via: the key is for the driver"),
        ({**LEAST, "route_action": "through"}, "route_action: the key is for the driver nav2"),
        ({**LEAST, "topics": {"odmo": "x"}}, "connection.topics.odmo: there is no such"),
        ({**LEAST, "topics": {"odom": "a b"}}, "topics.odom: 'a b' is not the name of a ROS"),
        ({**LEAST, "topics": "odom"}, "connection.topics: 'odom' is not a map"),
        ({**LEAST, "base_frame": "b"}, "base_frame: the key is for 'odom_frame: tf' only"),
        ({**LEAST, "odom_frame": "earth"}, "odom_frame: 'earth' is none of map, odom, tf"),
        ({**LEAST, "stamped": "yes"}, "connection.stamped: 'yes' is neither true nor false"),
        ({**LEAST, "hardware_id": ""}, "connection.hardware_id: '' is not a text"),
        ({**LEAST, "sim": 3}, "connection.sim: 3 is not a map"),
        ({**LEAST, "bounds": {"speed": "2 m"}}, "connection.bounds.speed: '2 m' is a distance"),
        ({**LEAST, "bounds": {"speed": 0}}, "connection.bounds.speed: 0 is not above 0"),
        ({**LEAST, "bounds": {"speed": math.inf}}, "connection.bounds.speed"),
        ({**LEAST, "bounds": {"yaw_rate": 1}}, "connection.bounds.yaw_rate: 1 has no unit"),
        ({**LEAST, "bounds": {"turn_radius": -1}}, "connection.bounds.turn_radius: -1 is below 0"),
        ({**LEAST, "bounds": {"acceleration": "1 m"}}, "'1 m' is a distance, not an acceleration"),
        ({**LEAST, "bounds": {"acceleration": "fast"}}, "connection.bounds.acceleration: 'fast'"),
        ({**LEAST, "bounds": {"acceleration": True}}, "connection.bounds.acceleration: True"),
    ],
)  # fmt: skip
def test_a_setting_that_cannot_be_used_is_refused_by_resource_and_key(settings, said) -> None:
    with pytest.raises(PluginError) as error:
        read(settings)
    assert said in str(error.value)
    assert str(error.value).startswith("evsg1: connection.")


@pytest.mark.parametrize("domain", ["air", "subsurface"])
def test_other_domains_are_refused_with_what_commands_them(domain: str) -> None:
    with pytest.raises(PluginError, match=rf"evsg1: domain: .* not {domain}; the arbiter 'mavlink"):
        read(LEAST, domain)


def test_two_vehicles_are_not_the_same_robot() -> None:
    def two(first: dict, second: dict):
        return read_settings(
            {V: Connection(V, "ground", first), W: Connection(W, "ground", second)}
        )

    with pytest.raises(
        PluginError, match=r"evsg2: connection.namespace: evsg1 has the same namespace"
    ):
        two(LEAST, {"namespace": "evsg1"})
    assert len(two({**LEAST, "domain_id": 1}, {**LEAST, "domain_id": 2})) == 2


def test_a_detector_has_its_vehicles_namespace_and_domain() -> None:
    vehicle = {**LEAST, "domain_id": 4, "driver": "base", "topics": {"odom": "o"}}
    inherited = {**vehicle, "topic": "gpr", "message": "string", "type": "gpr"}
    assert read_payload(inherited, vehicle) == DetectorSettings(
        "/evsg1", "/evsg1/gpr", 4, "gpr", DetectorMessage.STRING
    )
    assert read_payload(vehicle, vehicle, detector=True) == DetectorSettings(
        "/evsg1", "/evsg1/detections", 4
    )


def test_a_detector_may_be_on_a_vehicle_of_another_arbiter() -> None:
    url = {"url": "udpin://127.0.0.1:14550", "system_id": 3}
    assert read_payload({**url, "topic": "/gpr"}) == DetectorSettings("", "/gpr")
    with pytest.raises(PluginError, match=r"evsg1/gpr: connection.namespace: it is missing"):
        read_payload({**url, "topic": "gpr"})


def test_a_payload_that_does_not_detect_is_only_carried() -> None:
    assert read_payload(LEAST, LEAST) is None


@pytest.mark.parametrize(
    ("own", "said"),
    [
        ({"topic": 3}, "connection.topic: 3 is not the name of a ROS topic"),
        ({"topic": "gpr", "mesage": "string"}, "connection.mesage: there is no such setting; did"),
        ({"topic": "gpr", "message": "json"}, "'json' is none of detection, string"),
        ({"topic": "gpr", "driver": "base"}, "connection.driver: there is no such setting"),
    ],
)
def test_a_detectors_settings_are_read_strictly(own, said) -> None:
    with pytest.raises(PluginError) as error:
        read_payload({**LEAST, **own}, LEAST)
    assert said in str(error.value)


@pytest.mark.parametrize("driver", DriverName)
@pytest.mark.parametrize("domain", DOMAINS)
def test_every_vehicle_is_offered_what_moves_in_the_plane(driver, domain) -> None:
    connections = {V: Connection(V, domain, {**LEAST, "driver": driver.value})}
    arbiter = RosArbiter(connections, context(None))
    assert {spec.name for spec in arbiter.catalogue(V)} == {
        *("single_vehicle_routing", "goto", "hold", "drive_stop", "reverse", "follow", "teleop"),
    }


def test_a_slow_base_is_given_the_time_to_brake() -> None:
    settings = {**LEAST, "driver": "base", "bounds": {"speed": 10, "acceleration": 0.5}}
    connections = {V: Connection(V, "ground", settings, lost_after_s=9.0)}
    limits = RosArbiter(connections, context(None)).limits(V)
    assert (limits.lost_after_s, limits.hold_within_s, limits.cancel_timeout_s) == (9.0, 22.0, 33.0)


def test_the_catalogue_and_the_limits_load_neither_ros_nor_numpy() -> None:
    program = """
import logging, sys
from m2pem.api import ArbiterContext, Connection
from m2pem_plugin_ros import m2pem_register_arbiters

made = {}
m2pem_register_arbiters(made.__setitem__)
context = ArbiterContext(None, None, logging.getLogger(), (0.0, 0.0, 0.0))
connections = {"a": Connection("a", "ground", {"namespace": "/a"})}
arbiter = made["ros"](connections, context)
assert len(arbiter.catalogue("a")) == 7
arbiter.limits("a")
print(sorted({"rclpy", "numpy", "pymap3d", "m2pem_interfaces"} & set(sys.modules)))
"""
    ran = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert ran.stdout.strip() == "[]"


def test_without_ros_connecting_says_what_to_install() -> None:
    program = """
import asyncio, logging, sys
sys.modules["rclpy"] = None
from m2pem.api import ArbiterContext, Connection
from m2pem.errors import PluginError
from m2pem_plugin_ros.arbiter import RosArbiter

async def main():
    context = ArbiterContext(None, None, logging.getLogger(), (0.0, 0.0, 0.0))
    arbiter = RosArbiter({"a": Connection("a", "ground", {"namespace": "/a"})}, context)
    try:
        await arbiter.connect()
    except PluginError as error:
        print(error)
    await arbiter.close()

asyncio.run(main())
"""
    ran = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert "ROS 2 is not installed" in ran.stdout
    assert "pip install 'm2pem-plugin-ros[wheels]'" in ran.stdout
