"""Which payloads have a node of their own, by what a fleet says of them, and what is refused."""

from typing import Any

import pytest
from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.settings import (
    DetectorSettings,
    Settings,
    Via,
    read_detectors,
    read_payloads,
    read_settings,
)

from m2pem.api import Connection, ResourceId
from m2pem.api.clock import SystemClock
from m2pem.errors import PluginError
from m2pem.testing.contracts.arbiter_harness import context

V, PTZ = ResourceId("evsg2"), ResourceId("evsg2/ptz")
NODE = {"driver": "m2pem", "namespace": "/evsg2/ptz"}


def connections(
    said: dict[str, Any], vehicle: dict[str, Any] | None = None, **payload: Any
) -> dict[ResourceId, Connection]:
    """`said`: of the payload; `vehicle` None: another arbiter has it."""
    found = {PTZ: Connection(PTZ, "ground", {**(vehicle or {}), **said}, **payload)}
    if vehicle is not None:
        found[V] = Connection(V, "ground", vehicle)
    return found


def read(said: dict[str, Any], vehicle: dict[str, Any] | None = None, **payload: Any) -> Any:
    all_ = connections(said, vehicle, **payload)
    return read_payloads(all_, read_settings(all_)).get(PTZ)


def test_a_node_is_commanded_in_a_namespace_of_its_own() -> None:
    assert read(NODE) == Settings("/evsg2/ptz", hardware_id="")


def test_a_payload_may_be_on_a_vehicle_of_another_arbiter_whose_settings_are_not_ours() -> None:
    said = {**NODE, "url": "udpin://127.0.0.1:14550", "system_id": 1}
    assert read(said).namespace == "/evsg2/ptz"


def test_a_payload_inherits_how_its_vehicle_is_commanded_but_not_what_that_can_do() -> None:
    vehicle = {
        "namespace": "/evsg2",
        "domain_id": 7,
        "via": "action",
        "own_behaviors": {"sweep": {}},
        "topics": {"odom": "odometry"},
        "sim": {"heading": "60 deg"},
    }
    settings = read(NODE, vehicle)
    assert (settings.domain_id, settings.via, settings.own_behaviors) == (7, Via.ACTION, ())


@pytest.mark.parametrize(
    ("said", "payload", "is_node"),
    [
        ({"namespace": "/evsg2/ptz"}, {}, True),
        ({"namespace": "/evsg2/gpr"}, {"detector": True}, False),
        ({"namespace": "/evsg2/gpr", "topic": "found"}, {}, False),
        ({"namespace": "/evsg2/gpr"}, {"detector": True, "behaviors": ("zoom",)}, True),
        ({"namespace": "/evsg2/gpr", "own_behaviors": {"wipe": {}}}, {"detector": True}, True),
        ({}, {}, False),
        ({}, {"detector": True}, False),
    ],
)
def test_on_a_vehicle_with_a_node_its_namespace_tells(
    said: dict[str, Any], payload: dict[str, Any], is_node: bool
) -> None:
    vehicle = {"namespace": "/evsg2", "driver": "m2pem"}
    assert (read(said, vehicle, **payload) is not None) is is_node


def test_a_node_may_also_detect() -> None:
    all_ = connections({**NODE, "type": "car"}, detector=True)
    nodes = read_payloads(all_, {})
    found = read_detectors(all_, nodes)
    assert found == {PTZ: DetectorSettings("/evsg2/ptz", "/evsg2/ptz/detections", None, "car")}


@pytest.mark.parametrize(
    ("said", "problem"),
    [
        ({"driver": "m2pem"}, r"connection\.namespace: evsg2 has the same namespace, /evsg2"),
        ({**NODE, "viaa": "action"}, r"connection\.viaa: .* did you mean 'via'\?"),
        ({**NODE, "via": "pigeon"}, r"connection\.via: 'pigeon' is none of topics, action"),
        ({**NODE, "driver": "nav2"}, r"connection\.driver: 'nav2' is not a driver of payloads"),
        ({**NODE, "bounds": {"speed": 2}}, r"connection\.bounds: there is no such setting"),
        ({**NODE, "own_behaviors": {"goto": None}}, "all payloads share no such behavior"),
    ],
)
def test_what_is_wrong_is_refused_by_name(said: dict[str, Any], problem: str) -> None:
    with pytest.raises(PluginError, match=rf"evsg2/ptz: .*{problem}|evsg2/ptz: {problem}"):
        read(said, {"namespace": "/evsg2"})


def test_two_payloads_cannot_have_one_namespace() -> None:
    other = ResourceId("evsg3/ptz")
    both = {each: Connection(each, "ground", NODE) for each in (PTZ, other)}
    with pytest.raises(PluginError, match=r"evsg3/ptz: .*evsg2/ptz has the same namespace"):
        read_payloads(both, {})


def test_the_catalogue_has_what_payloads_share_and_what_the_fleet_declares() -> None:
    said = {**NODE, "own_behaviors": {"wipe": {"doc": "Wipe the lens."}}}
    arbiter = RosArbiter(connections(said), context(SystemClock()))
    names = {spec.name for spec in arbiter.catalogue(PTZ)}
    assert {"ptz_point_at", "ptz_track", "take_picture", "record_video", "wipe"} <= names
    assert "goto" not in names


OTHER = {"topic": "/smoke", "message": "std_msgs/Float32", "type": "smoke"}


def test_a_detector_may_publish_any_type() -> None:
    (found,) = read_detectors(
        connections({**OTHER, "when": "data > 0.7", "position": "pose"}, detector=True)
    ).values()
    assert found.other is not None
    assert (found.other.type_name, found.other.position) == ("std_msgs/msg/Float32", "pose")
    found_types = [found.other.condition.occurs({"data": each}, 0.0) for each in (0.5, 0.8)]
    assert found_types == [None, {"type": "smoke"}]


@pytest.mark.parametrize(
    ("said", "problem"),
    [
        ({"when": "data >"}, r"connection\.when"),
        ({"type": "${"}, r"connection\.type"),
        ({"rate": "0 Hz"}, r"connection\.rate"),
        ({"message": "std_msgs/srv/X"}, r"connection\.message: .* is not the name of a ROS type"),
        ({"message": "string"}, r"connection\.when: it goes with a type of ROS as `message`"),
    ],
)
def test_what_is_wrong_of_another_type_is_named(said: dict[str, Any], problem: str) -> None:
    with pytest.raises(PluginError, match=problem):
        read_detectors(connections({**OTHER, "when": "data > 0.7", **said}, detector=True))


def test_a_detector_of_another_type_says_what_it_detects() -> None:
    said = {key: value for key, value in OTHER.items() if key != "type"}
    with pytest.raises(PluginError, match=r"connection\.type: it is missing"):
        read_detectors(connections(said, detector=True))
