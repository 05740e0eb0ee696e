"""What a fleet says of VDA 5050 vehicles, and which resource and key an error names."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_vda5050.arbiter import Vda5050Arbiter
from m2pem_plugin_vda5050.broker import tls_context
from m2pem_plugin_vda5050.catalogue import Scope
from m2pem_plugin_vda5050.host_checks import check_brokers
from m2pem_plugin_vda5050.map_frame import MapFrame, MapPoint
from m2pem_plugin_vda5050.messages import (
    Headers,
    MessageError,
    State,
    Visualization,
    decode,
    encode,
)
from m2pem_plugin_vda5050.orders import OrderPlan, OrderProgress
from m2pem_plugin_vda5050.settings import Settings, read_password, read_settings
from m2pem_plugin_vda5050.simulator.agv import Agv, AgvSpec
from m2pem_plugin_vda5050.simulator.factsheet import factsheet
from m2pem_plugin_vda5050.simulator.simulation import read_specs
from vda_world import child_environment, schemas, write_fleet

from m2pem import load_fleet
from m2pem.api import Connection, ResourceId, SystemClock
from m2pem.errors import PluginError
from m2pem.testing import scenarios
from m2pem.testing.contracts.arbiter_harness import context
from tests.command_line import CommandLine

LEAST = {
    "url": "mqtt://127.0.0.1",
    "manufacturer": "KIT",
    "serial_number": "0001",
    "map": {"id": "hall"},
}


LOAD = {"stationType": "text", "loadType": {"kind": "text", "default": "EPAL"}}
FETCH = {"action": "pick", "parameters": LOAD}


def read(domain: str = "ground", **settings: Any) -> Settings:
    agv = ResourceId("agv1")
    return read_settings({agv: Connection(agv, domain, {**LEAST, **settings})})[agv]


def test_the_least_that_a_connection_says() -> None:
    settings = read()
    assert settings.prefix == "uagv/v2/KIT/0001"
    assert settings.address == "mqtt 127.0.0.1:1883 uagv/v2/KIT/0001"
    assert (settings.version, settings.released_nodes) == ("2.1.0", 0)


def test_all_that_a_connection_may_say() -> None:
    settings = read(
        url="mqtts://broker:8884",
        user="m2pem",
        password_file="/secret",
        tls={"ca": "ca.pem", "certificate": "c.pem", "key": "k.pem"},
        interface="fleet",
        version="2.0",
        map={"id": "hall", "origin": {"lat": 38.1, "lon": -77.3}, "rotation": "90 deg"},
        released_nodes=3,
        deviation="20 cm",
        cancel_timeout="1 min",
    )
    assert (settings.broker.host, settings.broker.port, settings.broker.tls) == (
        "broker",
        8884,
        True,
    )
    assert (settings.version, settings.interface) == ("2.0.0", "fleet")
    assert settings.map.rotation_rad == pytest.approx(math.pi / 2)
    assert (settings.deviation_m, settings.cancel_timeout_s) == (0.2, 60.0)


@pytest.mark.parametrize(
    ("settings", "error"),
    [
        ({"url": "http://x"}, "agv1: connection.url: 'http://x' is not the URL of a broker"),
        ({"url": "mqtt://a:b@x"}, "agv1: connection.url: write `user` and `password_file`"),
        ({"serial_number": 1}, "agv1: connection.serial_number: 1 is a number; write it as a text"),
        ({"serial_number": "a/b"}, "agv1: connection.serial_number: 'a/b' cannot be a part"),
        ({"manufacturer": "a+"}, "agv1: connection.manufacturer: 'a+' cannot be a part"),
        ({"map": {}}, "agv1: connection.map: it has no `id`"),
        (
            {"map": {"id": "h", "origin": {"lat": 1.0}}},
            "agv1: connection.map.origin.lon: it is miss",
        ),
        ({"version": "3.0.0"}, "agv1: connection.version: '3.0.0' is none of 1.1.0, 2.0.0 and"),
        ({"tls": {"ca": "x"}}, "agv1: connection.tls: it is for brokers whose `url` begins"),
        ({"password_file": "x"}, "agv1: connection.password_file: a password needs a `user`"),
        ({"serial": "1"}, "agv1: connection.serial: there is no such setting; did you mean"),
        ({"released_nodes": -1}, "agv1: connection.released_nodes: -1 is not a whole number"),
        ({"factsheet": "/none"}, "agv1: connection.factsheet: /none: No such file"),
        (
            {"own_behaviors": {"pik": None}},
            "agv1: connection.own_behaviors.pik: all vehicles share",
        ),
        (
            {"own_behaviors": {"goto": None}},
            "agv1: connection.own_behaviors.goto: every vehicle of",
        ),
        (
            {"own_behaviors": {"fetch": {"action": "pick", "parameters": {"loadType": "text"}}}},
            "agv1: connection.own_behaviors.fetch.parameters: VDA 5050 2.1.0 requires stationType",
        ),
        (
            {"own_behaviors": {"wait": {"action": "waitForTrigger"}}, "version": "2.0"},
            "agv1: connection.own_behaviors.wait.parameters: VDA 5050 2.0.0 requires triggerType",
        ),
        (
            {"own_behaviors": {"enableMap": None}, "version": "2.0"},
            "agv1: connection.own_behaviors.enableMap: VDA 5050 2.0.0 has no action enableMap",
        ),
        (
            {"own_behaviors": {"x": {"action": {"type": "deleteMap", "scope": "instant"}}}},
            "agv1: connection.own_behaviors.x.parameters: VDA 5050 2.1.0 requires mapId and",
        ),
        (
            {"own_behaviors": {"x": {**FETCH, "action": {"type": "pick", "scope": "instant"}}}},
            "agv1: connection.own_behaviors.x: VDA 5050 has no instant action pick: write `scope:",
        ),
        (
            {"own_behaviors": {"x": {"action": {"scope": "edge"}}}},
            "agv1: connection.own_behaviors.x.action.scope: 'edge' is none of node, instant",
        ),
        (
            {"own_behaviors": {"x": {"action": "cancelOrder"}}},
            "agv1: connection.own_behaviors.x.action.type: m2pem itself sends this action",
        ),
        (
            {"own_behaviors": {"x": {"parameters": {"area": "area"}}}},
            "agv1: connection.own_behaviors.x.parameters.area: no action of VDA 5050 takes area",
        ),
    ],
)
def test_what_is_wrong_is_named(settings: dict[str, Any], error: str) -> None:
    with pytest.raises(PluginError) as raised:
        read(**settings)
    assert str(raised.value).startswith(error), raised.value


@pytest.mark.parametrize("key", list(LEAST))
def test_what_is_missing_is_named(key: str) -> None:
    settings = {name: value for name, value in LEAST.items() if name != key}
    with pytest.raises(PluginError, match=rf"agv1: connection\.{key}: it "):
        read_settings({ResourceId("agv1"): Connection(ResourceId("agv1"), "ground", settings)})


def test_other_domains_and_two_of_one_address_are_refused() -> None:
    with pytest.raises(PluginError, match=r"agv1: domain: .* not air"):
        read(domain="air")
    connections = {
        ResourceId(name): Connection(ResourceId(name), "ground", LEAST) for name in ("agv1", "agv2")
    }
    with pytest.raises(PluginError, match=r"agv2: connection\.serial_number: agv1 has the same"):
        read_settings(connections)


def test_a_password_is_in_a_file_that_its_owner_alone_may_read(tmp_path: Path) -> None:
    file = tmp_path / "password"
    file.write_text("secret\n", encoding="utf-8")
    broker = read(user="m2pem", password_file=str(file)).broker
    file.chmod(0o640)
    with pytest.raises(PluginError, match=r"others may read it \(mode 0640\): chmod 600"):
        read_password(broker)
    file.chmod(0o600)
    assert read_password(broker) == "secret"
    file.write_text("\n", encoding="utf-8")
    with pytest.raises(PluginError, match="its first line has no password"):
        read_password(broker)


def test_files_are_named_relative_to_the_fleet_file(tmp_path: Path) -> None:
    spec = AgvSpec("agv1", "KIT", "0001", "2.1.0", "hall", actions={"weld": 1.0})
    (tmp_path / "agv.json").write_bytes(factsheet(spec, Headers("KIT", "0001").of("factsheet", 0)))
    files = {
        "user": "m2pem",
        "password_file": "secret",
        "tls": {"ca": "ca.pem", "certificate": "/etc/m2pem.pem", "key": "keys/m2pem.key"},
        "factsheet": "agv.json",
    }
    url = {"url": "mqtts://127.0.0.1:1"}
    file = write_fleet(tmp_path / "fleet.yaml", {"agv1": {**LEAST, **url, **files}})
    ((_, settings, _),) = read_specs(load_fleet(file))
    broker = settings.broker
    assert broker.password_file == str(tmp_path / "secret")
    assert broker.ca == str(tmp_path / "ca.pem")
    assert broker.certificate == "/etc/m2pem.pem"
    assert broker.key == str(tmp_path / "keys/m2pem.key")
    (check,) = check_brokers(load_fleet(file))
    assert str(tmp_path / "secret") in check.message
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    status, listed, said = CommandLine(elsewhere, child_environment(tmp_path)).run("fleet", file)
    assert (status, "weld " in listed) == (0, True), said


def test_a_certificate_that_cannot_be_used_is_named(tmp_path: Path) -> None:
    broker = read(url="mqtts://x", tls={"ca": str(tmp_path / "ca.pem")}).broker
    with pytest.raises(PluginError, match=r"ca\.pem: TLS cannot be used"):
        tls_context(broker)


def test_a_factsheet_offers_its_actions(tmp_path: Path) -> None:
    spec = AgvSpec("agv1", "KIT", "0001", "2.1.0", "hall", actions={"pick": 1.0, "weld": 1.0})
    file = tmp_path / "factsheet.json"
    body = json.loads(factsheet(spec, Headers("KIT", "0001").of("factsheet", 0)))
    features = body["protocolFeatures"]
    features["agvActions"].append(
        {
            "actionType": "paint",
            "actionScopes": ["INSTANT"],
            "actionParameters": [
                {"key": "colour", "valueDataType": "STRING", "isOptional": False},
                {"key": "shade", "valueDataType": "OBJECT", "isOptional": True},
            ],
            "blockingTypes": ["NONE"],
        }
    )
    features["agvActions"].append(
        {
            "actionType": "mix",
            "actionScopes": ["NODE"],
            "actionParameters": [{"key": "recipe", "valueDataType": "OBJECT"}],
        }
    )
    file.write_text(json.dumps(body), encoding="utf-8")
    settings = read(factsheet=str(file), own_behaviors={"fetch": FETCH})
    own = {each.spec.name: each for each in settings.own_behaviors}
    assert set(own) == {"fetch", "weld", "initPosition", "logReport", "paint"}
    assert [each.name for each in own["weld"].spec.parameters] == ["target", "speed"]
    assert (own["paint"].scope, own["paint"].blocking) == (Scope.INSTANT, "NONE")
    assert [(each.name, each.required) for each in own["paint"].spec.parameters] == [
        ("colour", True)
    ]


def test_an_action_of_a_factsheet_takes_the_place_of_no_other_behavior(tmp_path: Path) -> None:
    actions = dict.fromkeys(("pick", "goto", "fetch"), 1.0)
    spec = AgvSpec("agv1", "KIT", "0001", "2.1.0", "hall", actions=actions)
    file = tmp_path / "factsheet.json"
    file.write_bytes(factsheet(spec, Headers("KIT", "0001").of("factsheet", 0)))
    settings = read(factsheet=str(file), own_behaviors={"fetch": FETCH})
    own = [(each.spec.name, each.action) for each in settings.own_behaviors]
    assert own[0] == ("fetch", "pick")
    assert {name for name, _ in own[1:]} == {"initPosition", "logReport"}


@pytest.mark.parametrize(
    ("action", "required"),
    [
        ("pick", {"stationType", "loadType"}),
        ("drop", {"stationType", "loadType"}),
        ("startCharging", set()),
        ("stopCharging", set()),
        ("detectObject", set()),
        ("finePositioning", set()),
        ("waitForTrigger", {"triggerType"}),
        ("initPosition", {"x", "y", "theta", "mapId", "lastNodeId"}),
        ("enableMap", {"mapId", "mapVersion"}),
        ("downloadMap", {"mapId", "mapVersion", "mapDownloadLink"}),
        ("deleteMap", {"mapId", "mapVersion"}),
        ("logReport", {"reason"}),
    ],
)
def test_an_action_of_the_standard_requires_what_version_2_1_does(
    action: str, required: set[str]
) -> None:
    """VDA 5050 2.1.0, section 6.8.1."""
    (own,) = read(own_behaviors={action: None}).own_behaviors
    assert {each.name for each in own.spec.parameters if each.required} == required


def test_a_declared_action_of_the_standard_requires_what_has_no_default() -> None:
    (own,) = read(own_behaviors={"fetch": FETCH}).own_behaviors
    assert [(each.name, each.required) for each in own.spec.parameters] == [
        ("stationType", True),
        ("loadType", False),
    ]


def test_a_factsheet_says_which_parameters_its_vehicle_requires(tmp_path: Path) -> None:
    spec = AgvSpec("agv1", "KIT", "0001", "2.1.0", "hall", actions={"pick": 1.0, "drop": 1.0})
    body = json.loads(factsheet(spec, Headers("KIT", "0001").of("factsheet", 0)))
    pick, drop, *_ = body["protocolFeatures"]["agvActions"]
    pick["actionParameters"] = [
        {"key": "stationType", "valueDataType": "STRING", "isOptional": True},
        {"key": "loadType", "valueDataType": "STRING"},
        {"key": "lhd", "valueDataType": "STRING", "isOptional": False},
    ]
    del drop["actionParameters"]
    file = tmp_path / "factsheet.json"
    file.write_text(json.dumps(body), encoding="utf-8")
    settings = read(factsheet=str(file), own_behaviors={"pick": None, "drop": None})
    required = {
        own.spec.name: {each.name for each in own.spec.parameters if each.required}
        for own in settings.own_behaviors
    }
    assert (required["pick"], required["drop"]) == ({"loadType", "lhd"}, set())
    with pytest.raises(
        PluginError, match="the vehicle's factsheet has no node action startCharging"
    ):
        read(factsheet=str(file), own_behaviors={"startCharging": None})


def test_a_factsheet_of_version_3_is_refused_by_its_version(tmp_path: Path) -> None:
    file = tmp_path / "factsheet.json"
    features: dict[str, Any] = {"protocolFeatures": {"mobileRobotActions": []}}
    file.write_text(json.dumps({"version": "3.0.0", **features}), encoding="utf-8")
    with pytest.raises(
        PluginError, match=r"factsheet: .* is one of VDA 5050 3\.0\.0: m2pem speaks"
    ):
        read(factsheet=str(file))


def test_a_check_names_the_task_that_lacks_what_the_version_requires(tmp_path: Path) -> None:
    own = {"own_behaviors": {"pick": None, "drop": None}}
    fleet = write_fleet(tmp_path / "fleet.yaml", {"agv1": {**LEAST, **own}})
    mission = tmp_path / "mission.bpmn"
    load = {"stationType": "floor", "loadType": "EPAL"}
    tasks: Any = (("pick", load), ("pick", {"loadType": "EPAL"}), ("drop", {}))
    mission.write_bytes(scenarios.one_after_another("agv1", *tasks))
    line = CommandLine(tmp_path, child_environment(tmp_path))
    status, out, err = line.run("check", mission, "--fleet", fleet)
    assert status == 1
    lines = [each for each in (out + err).splitlines() if "stationType" in each]
    assert [("Task2" in each, "Task3" in each) for each in lines] == [(True, False), (False, True)]


def test_a_vehicle_cannot_make_an_update_long_by_a_wrong_number() -> None:
    square = tuple(MapPoint(*place) for place in ((0.0, 0.0), (9.0, 0.0), (9.0, 9.0), (0.0, 9.0)))
    order = OrderProgress(OrderPlan("o", "hall", square[0], square, loop=True), 2, None)
    order.extend()
    order.reach(2**40)
    assert order.is_update_due
    order.extend()
    nodes, _ = order.message()
    assert [node.sequence_id for node in nodes] == [4, 6, 8]


@pytest.mark.parametrize("x", ["1e300", "-2e6"])
def test_a_place_that_is_not_on_earth_is_no_message(x: str) -> None:
    place = f'{{"x": {x}, "y": 0, "theta": 0, "mapId": "hall", "positionInitialized": true}}'
    with pytest.raises(MessageError, match="a position or velocity is beyond"):
        decode(f'{{"agvPosition": {place}}}'.encode(), Visualization)


def test_a_counter_may_be_written_with_a_decimal_point() -> None:
    """JSON Schema 2020-12, 6.1.1: `integer` matches any number with a zero fractional part."""
    agv = Agv(AgvSpec("agv1", "KIT", "0001", "2.1.0", "hall"), str)
    text = encode(agv.state(Headers("KIT", "0001"), 0))
    written = text.replace(b'"orderUpdateId":0', b'"orderUpdateId":2.0')
    assert not list(schemas()["state"].iter_errors(json.loads(written)))
    number = decode(written, State).order_update_id
    assert (number, type(number)) == (2, int)
    with pytest.raises(MessageError, match="orderUpdateId"):
        decode(text.replace(b'"orderUpdateId":0', b'"orderUpdateId":2.5'), State)


def test_the_catalogue_needs_no_connection() -> None:
    connections = {
        ResourceId("agv1"): Connection(
            ResourceId("agv1"), "ground", {**LEAST, "own_behaviors": {"pick": None}}
        )
    }
    arbiter = Vda5050Arbiter(connections, context(SystemClock()))
    names = [spec.name for spec in arbiter.catalogue(ResourceId("agv1"))]
    assert names == ["single_vehicle_routing", "goto", "hold", "drive_stop", "reverse", "pick"]
    assert arbiter.addresses(ResourceId("agv1")) == ["mqtt 127.0.0.1:1883 uagv/v2/KIT/0001"]


@pytest.mark.parametrize("rotation_deg", [0.0, 30.0, -120.0, 180.0])
def test_places_go_to_the_map_and_back(rotation_deg: float) -> None:
    frame = MapFrame((38.1075, -77.3192, 60.0), math.radians(rotation_deg))
    point = frame.to_map((38.1085, -77.3180))
    position = frame.to_position(*point)
    assert position.latlon == pytest.approx((38.1085, -77.3180), abs=1e-8)
    north = frame.to_map((38.1085, -77.3192))
    theta = frame.to_theta(0.0)
    assert (math.cos(theta), math.sin(theta)) == pytest.approx(
        (north.x / math.hypot(*north), north.y / math.hypot(*north)), abs=1e-4
    )
    assert frame.to_yaw(theta) == pytest.approx(math.pi / 2)
