"""What a fleet says of a head over ROS, and what its joints mean."""

import math

import pytest
from m2pem_plugin_ptz.drivers.ros.settings import Axis, Command, Joints, nearest_turn, read_settings
from m2pem_plugin_ptz.gimbal import PanTiltZoom

from m2pem.api import Connection, ResourceId
from m2pem.errors import PluginError

JOINTS = Joints({Axis.PAN: "p", Axis.TILT: "t", Axis.ZOOM: "z"})


def read(**own):
    connection = {"driver": "ros", "namespace": "/evsg2", **own}
    return read_settings(Connection(ResourceId("evsg2/ptz"), "ground", connection))


def test_the_namespace_of_the_vehicle_is_enough():
    settings = read(via="action", odom_frame="odom", topics={"fix": "gps"})
    assert settings.joints.names == {Axis.PAN: "pan_joint", Axis.TILT: "tilt_joint"}
    assert settings.command is Command.TRAJECTORY
    assert settings.command_topic == "/evsg2/pan_tilt_controller/joint_trajectory"
    assert settings.joint_states == "/evsg2/joint_states"
    assert settings.image == "/evsg2/camera/image_raw/compressed"
    assert settings.domain_id is None


def test_all_of_it_can_be_said():
    settings = read(
        command="positions", joint_states="/mast/joints", image="mast/jpeg", domain_id=42
    )
    assert settings.command_topic == "/evsg2/pan_tilt_controller/commands"
    assert (settings.joint_states, settings.image) == ("/mast/joints", "/evsg2/mast/jpeg")
    assert settings.domain_id == 42
    assert read(namespace="/").joint_states == "/joint_states"


@pytest.mark.parametrize(
    ("own", "said"),
    [
        ({"command": "speed"}, "connection.command: 'speed' is none of trajectory, positions"),
        ({"joints": ["a"]}, "connection.joints: ['a'] is not a map such as {pan: pan_joint"),
        ({"joints": {"pann": "a"}}, "connection.joints.pann: there is no such setting; did you"),
        ({"joints": {"pan": "tilt_joint"}}, "connection.joints: two joints have the same name"),
        ({"joints": {"reversed": ["zoom"]}}, "joints.reversed: ['zoom'] is not a list of"),
        ({"image": "my image"}, "connection.image: 'my image' is not the name of a ROS topic"),
        ({"namespace": "/a b"}, "connection.namespace: 'a b' is not a ROS namespace"),
        ({"domain_id": 300}, "connection.domain_id: 300 is not a whole number from 0 to 232"),
        ({"via": "pigeons"}, "connection.via: 'pigeons' is none of joints"),
        ({"joint_state": "j"}, "no such setting; did you mean 'joint_states'?"),
    ],
)
def test_what_is_wrong_is_named(own, said):
    with pytest.raises(PluginError) as caught:
        read(**own)
    assert str(caught.value).startswith("evsg2/ptz: ")
    assert said in str(caught.value)


def test_joints_count_counter_clockwise_and_looks_clockwise():
    assert JOINTS.positions(PanTiltZoom(0.5, 0.2, 3.0)) == {
        Axis.PAN: -0.5,
        Axis.TILT: 0.2,
        Axis.ZOOM: 3.0,
    }
    assert JOINTS.ptz({Axis.PAN: -0.5, Axis.TILT: 0.2, Axis.ZOOM: 3.0}) == PanTiltZoom(
        0.5, 0.2, 3.0
    )


def test_joints_that_are_mounted_backwards_count_the_other_way():
    backwards = Joints(JOINTS.names, frozenset({Axis.PAN, Axis.TILT}))
    ptz = PanTiltZoom(0.5, 0.2, 3.0)
    assert backwards.positions(ptz)[Axis.PAN] == 0.5
    assert backwards.positions(ptz)[Axis.TILT] == -0.2
    assert backwards.ptz(backwards.positions(ptz)) == ptz


def test_only_ours_are_heard_and_only_if_they_are_numbers():
    heard = JOINTS.read(["wheel", "t", "p", "z"], [1.0, 0.1, math.nan])
    assert heard == {Axis.TILT: 0.1}
    assert JOINTS.ptz(heard) is None


def test_a_joint_that_turns_endlessly_goes_to_the_nearest_turn():
    assert nearest_turn(7.0, 0.5) == pytest.approx(0.5 + math.tau)
    assert nearest_turn(-3.0, 3.0) == pytest.approx(3.0 - math.tau)
    assert JOINTS.ptz({Axis.PAN: -7.0, Axis.TILT: 0.0}, endless=True).pan_rad == pytest.approx(
        7.0 - math.tau
    )
