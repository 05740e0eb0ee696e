"""The settings of a MAVLink camera in the fleet file."""

import pytest
from m2pem_plugin_ptz.drivers.mavlink.settings import Yaw, read_settings

from m2pem.api import Connection, ResourceId
from m2pem.errors import PluginError

VEHICLES = {"driver": "mavlink", "url": "udpin://127.0.0.1:14550", "system_id": 3}
"""What is inherited."""


def read(**own):
    return read_settings(Connection(ResourceId("uav1/ptz"), "air", {**VEHICLES, **own}))


def test_the_vehicles_connection_is_enough():
    settings = read(actuators={"dropper": "servo 9"}, namespace="/uav1")
    assert (settings.urls, settings.system_id) == (("udpin://127.0.0.1:14550",), 3)
    assert (settings.component_id, settings.gimbal_component) == (1, 1)
    assert settings.camera_components == (100, 1)
    assert settings.yaw is Yaw.VEHICLE


def test_all_of_it_can_be_said():
    settings = read(
        component_id=2, gimbal_device=4, camera_component=101, camera_device=1, yaw="north"
    )
    assert (settings.component_id, settings.gimbal_component) == (2, 2)
    assert (settings.gimbal_device, settings.camera_device) == (4, 1)
    assert settings.camera_components == (101,)
    assert settings.yaw is Yaw.NORTH


@pytest.mark.parametrize(
    ("own", "said"),
    [
        ({"url": None}, "connection.url: None is not a URL; write that of the vehicle"),
        ({"url": []}, "connection.url: [] is not a URL"),
        ({"system_id": None}, "connection.system_id: it is missing"),
        ({"system_id": 256}, "connection.system_id: 256 is not a whole number from 1 to 255"),
        ({"system_id": True}, "connection.system_id: True is not a whole number"),
        ({"gimbal": "yes"}, "connection.gimbal: 'yes' is neither true nor false"),
        ({"camera_component": 0}, "connection.camera_component: 0 is not a whole number"),
        ({"yaw": "south"}, "connection.yaw: 'south' is none of vehicle, north"),
        ({"camera_componnet": 100}, "no such setting; did you mean 'camera_component'?"),
    ],
)
def test_what_is_wrong_is_named(own, said):
    with pytest.raises(PluginError) as caught:
        read(**own)
    assert str(caught.value).startswith("uav1/ptz: ")
    assert said in str(caught.value)
