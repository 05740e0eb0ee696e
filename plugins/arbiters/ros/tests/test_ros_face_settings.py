"""The settings of the face, names, and what is left to ROS vehicles; without ROS."""

import math
from typing import Any

import pytest
from m2pem_plugin_ros.face.names import Names
from m2pem_plugin_ros.face.settings import RATES, Options, read_options
from m2pem_plugin_ros.frames import earth_from_enu, quaternion_of, rotated_back, yaw_of_quaternion

from m2pem.api import FaceSettings, Fleet
from m2pem.errors import PluginError
from m2pem.testing import scenarios


def fleet(*names: str, arbiter: str = "sim", **connection: Any) -> Fleet:
    return scenarios.fleet(arbiter, dict.fromkeys(names, connection))


def options(**values: Any) -> Options:
    return read_options(FaceSettings("ros", values), fleet("ugv1", "ugv2"))


def test_the_defaults_show_the_fleet_and_take_no_commands() -> None:
    read = options()
    assert (read.namespace, read.domain_id, dict(read.rates)) == ("", None, dict(RATES))
    assert not read.takes_commands("ugv1")


@pytest.mark.parametrize(
    ("commands", "taken"),
    [
        ("none", []),
        (["ugv2"], ["ugv2", "ugv2/camera"]),
        ("all", ["ugv1", "ugv2", "ugv2/camera"]),
    ],
)
def test_commands_are_taken_for_what_the_fleet_allows(commands: Any, taken: list[str]) -> None:
    read = options(commands=commands)
    resources = ("ugv1", "ugv2", "ugv2/camera")
    assert [each for each in resources if read.takes_commands(each)] == taken


def test_a_rate_is_for_all_topics_or_for_each() -> None:
    assert set(options(rate="2 Hz").rates.values()) == {2.0}
    assert dict(options(rate={"fix": "1 Hz"}).rates) == {**RATES, "fix": 1.0}


@pytest.mark.parametrize(
    ("values", "error"),
    [
        ({"rat": "1 Hz"}, r"faces\.ros\.rat: there is no such setting; did you mean 'rate'\?"),
        ({"rate": "fast"}, r"faces\.ros\.rate: 'fast'"),
        ({"rate": "0 Hz"}, r"faces\.ros\.rate: '0 Hz' is not within 0.01 and 100"),
        ({"rate": {"odm": "1 Hz"}}, r"faces\.ros\.rate\.odm: there is no such setting"),
        ({"namespace": "9 a"}, r"faces\.ros\.namespace: '9 a' is not a ROS namespace"),
        ({"domain_id": 300}, r"faces\.ros\.domain_id: 300"),
        ({"commands": "some"}, r"faces\.ros\.commands: 'some' is none of none, all, and a list"),
        ({"commands": ["ugv3"]}, r"faces\.ros\.commands: the fleet has no vehicle 'ugv3'"),
    ],
)
def test_a_wrong_setting_is_named(values: dict[str, Any], error: str) -> None:
    with pytest.raises(PluginError, match=error):
        options(**values)


def test_names_of_ros_are_made_of_names_of_the_fleet() -> None:
    named = Names(fleet("a-1", "a_1", "9x", "a-1/eo ir"), Options("/site"))
    assert named.topic("a-1", "odom") == "/site/a_1/odom"
    assert named.topic("a_1", "odom") == "/site/a_1_2/odom"
    assert named.topic("9x", "odom") == "/site/n9x/odom"
    assert named.action("a-1/eo ir") == "/site/a_1/eo_ir/execute_behavior"
    assert named.frame("a-1", "base_link") == "site/a_1/base_link"
    assert named.joint("a-1/eo ir", "pan") == "a_1_eo_ir_pan"


def test_what_a_ros_vehicle_has_itself_is_left_to_it() -> None:
    own = fleet("ugv1", arbiter="ros", namespace="/ugv1", domain_id=3, topics={"fix": "gps/fix"})
    named = Names(own, Options(domain_id=3))
    assert named.left_to_vehicle("/ugv1/odom")
    assert named.left_to_vehicle("/ugv1/battery_state")
    assert not named.left_to_vehicle("/ugv1/fix")
    assert named.action("ugv1") == "/ugv1/m2pem/execute_behavior"


@pytest.mark.parametrize(
    ("connection", "options"),
    [
        ({"namespace": "/ugv1", "domain_id": 3}, Options(domain_id=4)),
        ({"namespace": "/other", "domain_id": 3}, Options(domain_id=3)),
        ({"namespace": "/ugv1", "domain_id": 3}, Options("/site", domain_id=3)),
    ],
)
def test_in_another_domain_or_under_another_name_nothing_is_left(
    connection: dict[str, Any], options: Options
) -> None:
    named = Names(fleet("ugv1", arbiter="ros", **connection), options)
    assert not named.left_to_vehicle(named.topic("ugv1", "odom"))
    assert named.action("ugv1") == f"{options.namespace}/ugv1/execute_behavior"


def test_only_m2pem_nodes_have_the_action() -> None:
    base = fleet("ugv1", arbiter="ros", namespace="/ugv1", driver="base", domain_id=3)
    named = Names(base, Options(domain_id=3))
    assert named.left_to_vehicle("/ugv1/odom")
    assert named.action("ugv1") == "/ugv1/execute_behavior"


def test_a_rotation_turns_velocities_into_the_vehicles_frame() -> None:
    assert yaw_of_quaternion(quaternion_of(0.0, 0.0, 1.25)) == pytest.approx(1.25)
    north = quaternion_of(0.0, 0.0, math.pi / 2)
    assert rotated_back((0.0, 3.0, 0.0), north) == pytest.approx((3.0, 0.0, 0.0))
    # Nose down, it moves level: ahead and, seen from the vehicle, upwards.
    nose_down = quaternion_of(0.0, 0.5, 0.0)
    level = (math.cos(0.5), 0.0, math.sin(0.5))
    assert rotated_back((1.0, 0.0, 0.0), nose_down) == pytest.approx(level)
    # Right side down, what is on the left points up in ENU.
    right_down = quaternion_of(0.3, 0.0, 0.0)
    assert rotated_back((0.0, 0.0, 1.0), right_down)[1] == pytest.approx(math.sin(0.3))


def test_enu_on_the_equator_has_the_axes_of_the_earth() -> None:
    # At latitude and longitude 0: east is y, north is z, up is x of the Earth.
    turned = earth_from_enu(0.0, 0.0)
    assert rotated_back((0.0, 1.0, 0.0), turned) == pytest.approx((1.0, 0.0, 0.0))
    assert rotated_back((0.0, 0.0, 1.0), turned) == pytest.approx((0.0, 1.0, 0.0))
    assert rotated_back((1.0, 0.0, 0.0), turned) == pytest.approx((0.0, 0.0, 1.0))
