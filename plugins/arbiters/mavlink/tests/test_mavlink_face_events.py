"""MAVLink messages that are signals of missions, and what missions throw as messages."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_mavlink.face.event_settings import read_event_rules
from m2pem_plugin_mavlink.face.face import MavlinkFace
from m2pem_plugin_mavlink.face.message_fields import FieldError, find_message, made, values_of
from m2pem_plugin_mavlink.face.settings import read_settings
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_gcs import GroundStation, gateway, ground_station
from mavlink_simulated import specs
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem import load_fleet
from m2pem.api import UNKNOWN, Alert, FaceSettings, MissionControl
from m2pem.api import records as r
from m2pem.errors import PluginError
from m2pem.testing import scenarios
from m2pem.testing.harness import run_executive

BPMN = "http://www.omg.org/spec/BPMN/20100524/MODEL"
NAMES = ("alarm", "drop", "dropped", "stuck")
SYSTEM = 1
HOLD = 4

FLEET = """
version: 1
origin: {{lat: 47.397742, lon: 8.545594, alt: 488.0}}
vehicles:
  rover1:
    domain: ground
    arbiter: mavlink
    sitl: true
    lost_after: 40 s
    connection: {{url: "udpout://{host}:{port}", system_id: 1}}
  rover2: {{domain: ground, arbiter: sim, connection: {{}}}}
"""


def mission(*elements: tuple[str, str]) -> bytes:
    """Signal events one after the other: ("catch", NAME) or ("throw", NAME)."""
    signals = "".join(f'<signal id="{each}" name="{each}"/>' for each in NAMES)
    events, before = "", "S"
    for number, (kind, name) in enumerate(elements):
        tag = f"intermediate{kind.capitalize()}Event"
        events += (
            f'<{tag} id="E{number}"><signalEventDefinition signalRef="{name}"/></{tag}>'
            f'<sequenceFlow id="f{number}" sourceRef="{before}" targetRef="E{number}"/>'
        )
        before = f"E{number}"
    return (
        f'<?xml version="1.0"?><definitions xmlns="{BPMN}" targetNamespace="t">{signals}'
        f'<process id="P" isExecutable="true"><startEvent id="S"/>{events}<endEvent id="End"/>'
        f'<sequenceFlow id="last" sourceRef="{before}" targetRef="End"/></process></definitions>'
    ).encode()


@asynccontextmanager
async def served(
    folder: Path, **settings: Any
) -> AsyncIterator[tuple[MissionControl, Simulator, GroundStation]]:
    """A simulated autopilot, an executive with a face, and a ground station."""
    async with Simulator(specs(Kind.ROVER), speed=1.0, to=None) as simulator:
        host, port = simulator[SYSTEM].address
        fleet = FLEET.format(host=host, port=port)
        async with (
            gateway(folder, fleet=fleet, **settings) as (control, own),
            ground_station(own) as station,
        ):
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == SYSTEM)
            yield control, simulator, station


async def outside(control: MissionControl, run: Any) -> list[str]:
    """Who threw signals from outside, and the data that came with them."""
    said = []
    for each in await control.records(run):
        if isinstance(each.record, r.SignalThrown) and each.record.by:
            said.append(each.record.by)
        elif isinstance(each.record, r.DataWritten):
            said.append(f"{each.record.key} = {each.record.value}")
    return said


async def alert(control: MissionControl, part: str) -> str:
    async for event in control.subscribe():
        if isinstance(event, Alert) and part in event.text:
            return event.text
    raise AssertionError


async def again(action: Any, done: "asyncio.Task[Any]") -> None:
    async with asyncio.timeout(60):
        while not done.done():
            action()
            await asyncio.sleep(0.05)


TEXT = {
    "type": "STATUSTEXT",
    "from": "rover1",
    "when": "severity <= 3",
    "every": True,
    "signal": "alarm",
    "data": {"error.text": "${text}", "error.component": "${sender.component}"},
}
DROP = {
    "signal": "drop",
    "type": "COMMAND_LONG",
    "to": "rover1",
    "done": "dropped",
    "failed": "stuck",
}
SET_HOLD = {"command": "DO_SET_MODE", "param1": 1, "param2": HOLD}


def test_a_text_of_a_vehicle_is_a_signal(tmp_path: Path) -> None:
    async def main() -> None:
        async with served(tmp_path, receive=[TEXT]) as (control, simulator, _):
            run = await control.start(mission(("catch", "alarm")))
            ended = asyncio.create_task(control.wait(run))
            autopilot = simulator[SYSTEM].autopilot
            await again(lambda: autopilot.say("engine \x1b hot", dialect.MAV_SEVERITY_ERROR), ended)
            assert (await outside(control, run))[:3] == [
                "mavlink rover1 STATUSTEXT",
                "error.text = engine   hot",
                "error.component = 1",
            ]

    asyncio.run(main())


def test_a_message_of_a_ground_station_is_one_where_a_rule_says_so(tmp_path: Path) -> None:
    async def main() -> None:
        named = {"type": "NAMED_VALUE_FLOAT", "when": "name == 'smoke' and value > 0.5"}
        stations = {**named, "from": "stations", "signal": "alarm"}
        vehicles = {**named, "signal": "dropped"}
        async with served(tmp_path, receive=[vehicles, stations]) as (control, _, station):
            run = await control.start(mission(("catch", "alarm")))
            other = await control.start(mission(("catch", "dropped")))
            ended = asyncio.create_task(control.wait(run))
            await again(lambda: station.mav.named_value_float_send(0, b"smoke", 0.7), ended)
            assert await outside(control, run) == ["mavlink 254/190 NAMED_VALUE_FLOAT"]
            thrown = [
                each.record.signal
                for each in await control.records(other)
                if isinstance(each.record, r.SignalThrown)
            ]
            assert set(thrown) == {"alarm"}

    asyncio.run(main())


def test_a_command_reaches_the_vehicle_and_its_answer_the_mission(tmp_path: Path) -> None:
    async def main() -> None:
        drop = {**DROP, "fields": SET_HOLD}
        async with served(tmp_path, send=[drop], send_to=["rover1"]) as (control, simulator, _):
            modes = simulator[SYSTEM].autopilot.modes
            assert modes.mode.number != HOLD
            run = await control.start(mission(("throw", "drop"), ("catch", "dropped")))
            assert str((await control.wait(run)).status) == "completed"
            assert modes.mode.number == HOLD
            assert await outside(control, run) == ["mavlink rover1 DO_SET_MODE"]

    asyncio.run(main())


def test_a_refused_command_is_the_signal_failed_and_an_alert(tmp_path: Path) -> None:
    async def main() -> None:
        drop = {**DROP, "fields": {"command": 64000}, "data": {"drop.result": "${result}"}}
        async with served(tmp_path, send=[drop], send_to="all") as (control, _, _):
            alerted = asyncio.create_task(alert(control, "command 64000"))
            await asyncio.sleep(0)
            run = await control.start(mission(("throw", "drop"), ("catch", "stuck")))
            assert str((await control.wait(run)).status) == "completed"
            unsupported = dialect.MAV_RESULT_UNSUPPORTED
            said = await outside(control, run)
            assert said == ["mavlink rover1 command 64000", f"drop.result = {unsupported}"]
            assert "not supported" in await alerted

    asyncio.run(main())


def test_what_another_run_commands_is_left_alone(tmp_path: Path) -> None:
    async def main() -> None:
        drop = {**DROP, "fields": SET_HOLD}
        async with served(tmp_path, send=[drop], send_to="all") as (control, simulator, _):
            far = "[47.40, 8.5456]"
            other = await control.start(scenarios.one_behavior("goto", "rover1", target=far))
            alerted = asyncio.create_task(alert(control, f"rover1 is commanded by {other}"))
            await asyncio.sleep(0)
            run = await control.start(mission(("throw", "drop"), ("catch", "stuck")))
            assert str((await control.wait(run)).status) == "completed"
            assert "is not sent" in await alerted
            assert simulator[SYSTEM].autopilot.modes.mode.number != HOLD

    asyncio.run(main())


def test_ground_stations_are_told_what_missions_throw(tmp_path: Path) -> None:
    async def main() -> None:
        long = "the drop zone of the northern field is to be left by all " * 2
        send = [
            {"signal": "drop", "type": "STATUSTEXT", "to": "stations", "from": "rover2",
             "fields": {"severity": "NOTICE", "text": long}},
            {"signal": "drop", "type": "NAMED_VALUE_INT", "to": "stations", "from": "rover1",
             "fields": {"name": "drops", "value": 3}},
        ]  # fmt: skip
        async with served(tmp_path, send=send) as (control, _, station):
            await control.start(mission(("throw", "drop")))
            await station.told(long.strip())
            text = await station.hears("STATUSTEXT", lambda each: each.text.startswith("the drop"))
            assert (text.severity, text.get_srcSystem()) == (dialect.MAV_SEVERITY_NOTICE, 2)
            number = await station.hears("NAMED_VALUE_INT")
            assert (number.name, number.value, number.get_srcSystem()) == ("drops", 3, 1)

    asyncio.run(main())


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"receive": [{**TEXT, "type": "STATUSTXT"}]}, "did you mean 'STATUSTEXT'"),
        ({"receive": [{**TEXT, "from": "rover3"}]}, "the fleet has no vehicle 'rover3'"),
        ({"receive": [{**TEXT, "from": "rover2"}]}, "rover2: its arbiter is sim"),
        ({"receive": [{**TEXT, "component": 300}]}, "receive[0].component"),
        ({"send": [{**DROP, "fields": {"command": 183}}]},
         "send[0].to: messages of missions go to no vehicle unless the fleet says so: write "
         "faces: {mavlink: {send_to: [rover1]}}"),
        ({"send_to": "all", "send": [{**DROP, "fields": {"comand": 183}}]},
         "send[0].fields.comand: COMMAND_LONG has no such field; did you mean 'command'"),
        ({"send_to": "all", "send": [{**DROP, "fields": {"command": "DO_SET_SERVOS"}}]},
         "'DO_SET_SERVOS' is not one of MAV_CMD; did you mean"),
        ({"send_to": "all", "send": [{**DROP, "fields": {"target_system": 3}}]},
         "send[0].fields.target_system: `to` and `component` say it"),
        ({"send": [{"signal": "s", "type": "COMMAND_LONG", "to": "stations", "from": "rover1"}]},
         "COMMAND_LONG is not sent to ground stations"),
        ({"send": [{"signal": "s", "type": "HEARTBEAT", "to": "stations", "from": "rover1"}]},
         "HEARTBEAT is not sent to ground stations"),
        ({"send": [{"signal": "s", "type": "STATUSTEXT", "to": "stations"}]},
         "send[0].from: it is missing"),
    ],
)  # fmt: skip
def test_a_wrong_rule_is_found_before_anything_begins(
    settings: dict[str, Any], says: str, tmp_path: Path
) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(FLEET.format(host="127.0.0.1", port=1), encoding="utf-8")
    fleet, reader = load_fleet(str(file)), FaceSettings("mavlink", settings)
    with pytest.raises(PluginError) as raised:
        read_event_rules(reader, read_settings(reader, fleet), fleet)
    assert says in str(raised.value)


async def test_rules_about_vehicles_that_are_simulated_are_no_error(tmp_path: Path) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(FLEET.format(host="127.0.0.1", port=1), encoding="utf-8")
    rules = {"send_to": "all", "receive": [TEXT], "send": [{**DROP, "fields": SET_HOLD}]}
    async with run_executive(load_fleet(str(file)), simulated=True) as control:
        MavlinkFace(control, FaceSettings("mavlink", rules))


def test_fields_of_a_message_are_plain_values() -> None:
    text = find_message("STATUSTEXT").make(severity=3, text=b"a\xff\x07b")
    values = values_of(text, Address(1, 154))
    assert (values["text"], values["sender"]) == ("a\ufffd b", {"system": 1, "component": 154})
    attitude = find_message("ATTITUDE").make(roll=float("nan"), pitch=1.5)
    assert (values_of(attitude, Address(1, 1))["roll"], attitude.pitch) == (None, 1.5)


@pytest.mark.parametrize(
    ("name", "fields", "says"),
    [
        ("COMMAND_LONG", {"param1": "x"}, "param1: 'x' is not a number"),
        ("COMMAND_LONG", {"command": -1}, "command: -1 is not a whole number from 0 to 65535"),
        ("COMMAND_LONG", {"command": 1.5}, "command: 1.5 is not a whole number"),
        ("NAMED_VALUE_INT", {"name": "more than ten"}, "name: it has 13 bytes; 10 are the most"),
        ("NAMED_VALUE_INT", {"name": 3}, "name: 3 is not a text"),
        ("ACTUATOR_CONTROL_TARGET", {"controls": [1, "x"]}, "controls: 'x' is not a number"),
        ("ACTUATOR_CONTROL_TARGET", {"controls": [0] * 9}, "controls: it is not a list of 8"),
    ],
)
def test_a_field_that_does_not_fit_is_named(name: str, fields: dict[str, Any], says: str) -> None:
    with pytest.raises(FieldError) as raised:
        made(find_message(name), fields)
    assert says in str(raised.value)


def test_values_that_are_not_known_yet_are_left_out() -> None:
    target = made(find_message("ACTUATOR_CONTROL_TARGET"), {"controls": [1, UNKNOWN]})
    assert target.controls == (0,) * 8
