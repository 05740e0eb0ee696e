"""Topics and services that are signals of missions, with plain rclpy on the other side."""

import asyncio
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from m2pem_plugin_ros.face.event_settings import read_event_rules
from m2pem_plugin_ros.interfaces.fill_fields import FieldError, fill
from m2pem_plugin_ros.interfaces.plain_values import MessageFields
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from ros_face_client import World, faced, until
from sensor_msgs.msg import Image, NavSatFix
from std_msgs.msg import Bool, Float32, Header, String, UInt64
from std_srvs.srv import SetBool, Trigger

from m2pem.api import Alert, FaceSettings, RunId
from m2pem.api import records as r
from m2pem.errors import PluginError

BPMN = "http://www.omg.org/spec/BPMN/20100524/MODEL"


def mission(*elements: tuple[str, str]) -> bytes:
    """Signal events one after the other: ("catch", NAME), or ("throw", NAME) with the value
    `level` of the variable `alarm.level`."""
    signals, events, flows = "", "", ""
    for number, name in enumerate(dict.fromkeys(each for _, each in elements)):
        signals += f'<signal id="Sig_{number}" name="{name}"/>'
    names = list(dict.fromkeys(each for _, each in elements))
    before = "S"
    for number, (kind, name) in enumerate(elements):
        tag = "intermediateCatchEvent" if kind == "catch" else "intermediateThrowEvent"
        reference = f'<signalEventDefinition signalRef="Sig_{names.index(name)}"/>'
        data = (
            (
                '<dataInput id="In" name="level"/><dataInputAssociation><targetRef>In</targetRef>'
                "<assignment><from>alarm.level</from><to>In</to></assignment></dataInputAssociation>"
                "<inputSet><dataInputRefs>In</dataInputRefs></inputSet>"
            )
            .replace("In<", f"In{number}<")
            .replace('"In"', f'"In{number}"')
        )
        events += f'<{tag} id="E{number}">{data if kind == "throw" else ""}{reference}</{tag}>'
        flows += f'<sequenceFlow id="f{number}" sourceRef="{before}" targetRef="E{number}"/>'
        before = f"E{number}"
    flows += f'<sequenceFlow id="last" sourceRef="{before}" targetRef="End"/>'
    return (
        f'<?xml version="1.0"?><definitions xmlns="{BPMN}" targetNamespace="t">{signals}'
        f'<process id="P" isExecutable="true"><startEvent id="S"/>{events}<endEvent id="End"/>'
        f"{flows}</process></definitions>"
    ).encode()


ALARM = {"topic": "/alarm", "type": "std_msgs/msg/Bool", "when": "data == true", "signal": "alarm"}
LEVEL = {
    "topic": "/level",
    "type": "std_msgs/Float32",
    "when": "data > 0.5",
    "signal": "alarm",
    "data": {"alarm.level": "${data}"},
}
WAITS = mission(("catch", "alarm"))
ECHOES = mission(("catch", "alarm"), ("throw", "cleared"))


async def publish(world: World, topic: str, message: Any, done: Any, qos: Any = 10) -> None:
    """Publish again and again until a task is done."""
    publisher = world.client.node.create_publisher(type(message), topic, qos)
    async with asyncio.timeout(40):
        while not done.done():
            publisher.publish(message)
            await asyncio.sleep(0.02)


async def waits(world: World, file: bytes) -> tuple[RunId, "asyncio.Task[Any]"]:
    run = await world.control.start(file)
    return run, asyncio.create_task(world.control.wait(run))


async def thrown_by(world: World, run: RunId) -> list[str]:
    """Who threw signals from outside, and what data came with them."""
    said = []
    for each in await world.control.records(run):
        if isinstance(each.record, r.SignalThrown) and each.record.by:
            said.append(each.record.by)
        elif isinstance(each.record, r.DataWritten):
            said.append(f"{each.record.key} = {each.record.value}")
    return said


async def alerts(world: World, heard: list[str]) -> None:
    async for event in world.control.subscribe():
        if isinstance(event, Alert):
            heard.append(event.text)


async def test_a_mission_waits_for_a_topic_throws_and_a_service_answers(ros_domain: int) -> None:
    """A whole mission: /level is the alarm, its level goes to /cleared, and the gate opens."""
    asked: list[bool] = []

    def answer(request: Any, response: Any) -> Any:
        asked.append(request.data)
        response.success, response.message = True, "open"
        return response

    settings = {
        "receive": [LEVEL],
        "send": [
            {
                "signal": "cleared",
                "topic": "/cleared",
                "type": "std_msgs/msg/String",
                "fields": {"data": "level ${level}"},
            },
            {
                "signal": "open_gate",
                "service": "/gate/open",
                "type": "std_srvs/srv/SetBool",
                "fields": {"data": True},
                "done": "gate_open",
                "failed": "gate_stuck",
                "data": {"gate.text": "${message}"},
            },
        ],
    }
    file = mission(
        ("catch", "alarm"), ("throw", "cleared"), ("throw", "open_gate"), ("catch", "gate_open")
    )
    async with faced(ros_domain, settings) as world:
        world.client.node.create_service(SetBool, "/gate/open", answer)
        cleared = world.client.hear("/cleared", String)
        run, ended = await waits(world, file)
        await publish(world, "/level", Float32(data=0.75), ended)
        summary = ended.result()
        await until(lambda: cleared)
        events = await thrown_by(world, run)
    assert str(summary.status) == "completed"
    assert events == [
        "ros /level",
        "alarm.level = 0.75",
        "ros /gate/open",
        "gate.text = open",
    ]
    assert [each.data for each in cleared] == ["level 0.75"]
    assert asked == [True]


@pytest.mark.parametrize(
    "qos",
    [
        QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT),
        QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE),
        QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL),
    ],
    ids=["best effort", "reliable", "latched"],
)
async def test_publishers_of_any_quality_are_heard(ros_domain: int, qos: QoSProfile) -> None:
    async with faced(ros_domain, {"receive": [ALARM]}) as world:
        _, ended = await waits(world, WAITS)
        await publish(world, "/alarm", Bool(data=True), ended, qos)
        assert str(ended.result().status) == "completed"


async def test_what_a_topic_kept_from_before_is_an_event(ros_domain: int) -> None:
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    async with faced(ros_domain, {"receive": [ALARM]}) as world:
        run = await world.control.start(WAITS)
        world.client.node.create_publisher(Bool, "/alarm", latched).publish(Bool(data=True))
        assert str((await world.control.wait(run)).status) == "completed"


async def test_a_topic_of_another_type_is_named(ros_domain: int) -> None:
    heard: list[str] = []
    async with faced(ros_domain, {"receive": [ALARM]}) as world:
        listening = asyncio.create_task(alerts(world, heard))
        await until(lambda: world.client.node.count_subscribers("/alarm"))
        world.client.node.create_publisher(String, "/alarm", 10)
        said = await until(lambda: [each for each in heard if "std_msgs/msg/String" in each])
        listening.cancel()
    assert said == [
        "ros /alarm is published as std_msgs/msg/String by /client, but faces.ros.receive[0] says "
        "std_msgs/msg/Bool: its messages are not received"
    ]


async def test_of_a_flood_the_last_message_counts(ros_domain: int) -> None:
    async with faced(ros_domain, {"receive": [ALARM]}) as world:
        _, ended = await waits(world, WAITS)
        publisher = world.client.node.create_publisher(Bool, "/alarm", 10)
        await until(publisher.get_subscription_count)
        for _ in range(5_000):
            publisher.publish(Bool(data=False))
        await publish(world, "/alarm", Bool(data=True), ended)
        assert str(ended.result().status) == "completed"


async def test_large_messages_and_those_of_liars_are_cut(ros_domain: int) -> None:
    """A text of a megabyte, with what would steer a terminal, becomes data of a mission."""
    text = {
        "topic": "/text",
        "type": "std_msgs/msg/String",
        "signal": "alarm",
        "data": {"alarm.text": "${data}"},
    }
    async with faced(ros_domain, {"receive": [text]}) as world:
        run, ended = await waits(world, WAITS)
        await publish(world, "/text", String(data="\x1b[2J" + "x" * 1_000_000), ended)
        _, written = await thrown_by(world, run)
    assert written == "alarm.text = ?[2J" + "x" * 996


async def test_a_condition_that_does_not_fit_is_said_once(ros_domain: int) -> None:
    heard: list[str] = []
    text = {"topic": "/text", "type": "std_msgs/msg/String", "signal": "x", "when": "data - 1 > 2"}
    async with faced(ros_domain, {"receive": [text, ALARM]}) as world:
        listening = asyncio.create_task(alerts(world, heard))
        _, ended = await waits(world, WAITS)
        texts = world.client.node.create_publisher(String, "/text", 10)
        await until(texts.get_subscription_count)
        said = asyncio.create_task(until(lambda: [each for each in heard if "/text" in each]))
        await publish(world, "/text", String(data="x"), said)
        for _ in range(20):
            texts.publish(String(data="x"))
        await publish(world, "/alarm", Bool(data=True), ended)
        listening.cancel()
    (text_alert,) = [each for each in heard if "/text" in each]
    assert text_alert.startswith("ros /text: faces.ros.receive[0]: ")


@pytest.mark.parametrize("behaves", ["refuses", "is missing", "has another type"])
async def test_a_service_that_fails_is_a_signal_and_an_alert(ros_domain: int, behaves: str) -> None:
    heard: list[str] = []

    def refuse(_: Any, response: Any) -> Any:
        response.success, response.message = False, "jammed\n\x1b[2J"
        return response

    call = {
        "signal": "open_gate",
        "service": "/gate",
        "type": "std_srvs/srv/SetBool",
        "timeout": "3 s",
        "failed": "gate_stuck",
    }
    file = mission(("throw", "open_gate"), ("catch", "gate_stuck"))
    async with faced(ros_domain, {"send": [call]}) as world:
        listening = asyncio.create_task(alerts(world, heard))
        if behaves != "is missing":
            kind = SetBool if behaves == "refuses" else Trigger
            world.client.node.create_service(kind, "/gate", refuse)
            node = world.client.node
            await until(lambda: dict(node.get_service_names_and_types()).get("/gate"))
        run, ended = await waits(world, file)
        summary = await ended
        events = await thrown_by(world, run)
        said = await until(lambda: [each for each in heard if "/gate" in each])
        listening.cancel()
    assert str(summary.status) == "completed"
    assert events == ["ros /gate"]
    expected = {
        "refuses": "it says: jammed ?[2J",
        "is missing": "no server was found within 3 s",
        "has another type": "other nodes know it as std_srvs/srv/Trigger",
    }[behaves]
    assert expected in said[0]


async def test_what_cannot_be_sent_is_reported(ros_domain: int) -> None:
    heard: list[str] = []
    send = {
        "signal": "cleared",
        "topic": "/cleared",
        "type": "std_msgs/msg/Bool",
        "fields": {"data": "${level}"},
    }
    async with faced(ros_domain, {"receive": [LEVEL], "send": [send]}) as world:
        listening = asyncio.create_task(alerts(world, heard))
        _, ended = await waits(world, ECHOES)
        await publish(world, "/level", Float32(data=0.75), ended)
        said = await until(lambda: [each for each in heard if "send[0]" in each])
        listening.cancel()
    assert "data: 0.75 is not of type boolean" in said[0]
    assert said[0].startswith("faces.ros.send[0]: signal 'cleared' of run ")


SENDS = {"signal": "s", "topic": "/x", "type": "std_msgs/msg/Bool"}
CALLS = {"signal": "s", "service": "/x", "type": "std_srvs/srv/SetBool"}


@pytest.mark.parametrize(
    ("values", "error"),
    [
        ({"receive": [{**ALARM, "type": "Bool"}]},
         r"receive\[0\]\.type: 'Bool' is not the name of a ROS type such as std_msgs/msg/Bool"),
        ({"receive": [{**ALARM, "type": "std_msgs/msg/Bol"}]},
         r"receive\[0\]\.type: the ROS package std_msgs has no msg/Bol; did you mean 'Bool'"),
        ({"receive": [{**ALARM, "type": "smoke_msgs/msg/Smoke"}]},
         r"the ROS package smoke_msgs is not installed"),
        ({"receive": [{**ALARM, "type": "std_srvs/srv/SetBool"}]}, r"\[0\]\.type: 'std_srvs"),
        ({"receive": [{"topic": "/a", "signal": "s"}]}, r"receive\[0\]\.type: it is missing"),
        ({"receive": [{**ALARM, "topic": "/a b"}]}, r"'/a b' is not the name of a ROS topic"),
        ({"receive": [{**ALARM, "service": "/a"}]}, r"receive\[0\]\.service: there is no such"),
        ({"send": [{**SENDS, "fields": {"dat": True}}]},
         r"send\[0\]\.fields\.dat: std_msgs/Bool has no such field; did you mean 'data'"),
        ({"send": [{**SENDS, "fields": {"data": 1}}]},
         r"send\[0\]\.fields\.data: 1 is not of type boolean"),
        ({"send": [{**CALLS, "fields": {"data": "true"}}]},
         r"send\[0\]\.fields\.data: 'true' is not of type boolean"),
        ({"send": [{**CALLS, "topic": "/y"}]}, r"send\[0\]\.topic: name either"),
        ({"send": [{**CALLS, "timeout": "1 h"}]}, r"send\[0\]\.timeout"),
        ({"send": [{**SENDS, "done": "x"}]}, r"send\[0\]\.done: there is no such setting"),
    ],
)  # fmt: skip
def test_a_wrong_rule_is_found_before_anything_begins(values: Any, error: str) -> None:
    with pytest.raises(PluginError, match=error):
        read_event_rules(FaceSettings("ros", values))


def test_fields_of_a_message_are_plain_values() -> None:
    levels = [DiagnosticStatus(level=bytes([n]), name="x" * 5000) for n in range(200)]
    fields = MessageFields(DiagnosticArray(header=Header(frame_id="map"), status=levels))
    assert fields["header"]["frame_id"] == "map"
    assert fields["header"]["stamp"]["sec"] == 0
    assert [each["level"] for each in fields["status"]] == list(range(100))
    assert {len(each["name"]) for each in fields["status"]} == {1000}
    assert "other" not in fields
    assert MessageFields(UInt64(data=2**64 - 1))["data"] == float(2**64 - 1)
    assert MessageFields(Float32(data=float("nan")))["data"] is None
    assert MessageFields(Image(data=b"ab" * 1000))["data"] == [97, 98] * 50
    assert MessageFields(NavSatFix())["position_covariance"] == [0.0] * 9


def test_fields_become_a_message() -> None:
    given: dict[str, Any] = {
        "header": {"frame_id": "map", "stamp": {"sec": 3}},
        "status": [{"level": 2, "values": [{"key": "a", "value": "b"}]}],
    }
    message = fill(DiagnosticArray, given)
    assert message.header.stamp.sec == 3
    assert message.status[0].level == b"\x02"
    assert message.status[0].values == [KeyValue(key="a", value="b")]
    assert list(fill(Image, {"data": [1, 2]}).data) == [1, 2]
    assert list(fill(NavSatFix, {"position_covariance": list(range(9))}).position_covariance) == [
        float(n) for n in range(9)
    ]


@pytest.mark.parametrize(
    ("kind", "fields", "error"),
    [
        (Image, {"height": -1}, "height: -1 is not from 0 to 4294967295, as uint32"),
        (Image, {"height": 1.5}, "height: 1.5 is not of type uint32"),
        (Image, {"height": True}, "height: True is not of type uint32"),
        (Image, {"data": [1, 256]}, r"data\[1\]: 256 is not from 0 to 255"),
        (Image, {"data": "abc"}, "data: 'abc' is not a list of uint8"),
        (Image, {"header": {"frme_id": "x"}}, "header.frme_id: std_msgs/Header has no such field"),
        (Image, {"header": "x"}, "header: 'x' is not of type std_msgs/Header"),
        (Float32, {"data": 1e300}, "data: 1e\\+300 is too large for float32"),
        (Float32, {"data": None}, "data: null is not of type float"),
        (String, {"data": 3}, 'data: 3 is not of type string; write it in a text, such as'),
        (NavSatFix, {"position_covariance": [1]}, "has 1 items; 9 are needed"),
    ],
)  # fmt: skip
def test_a_field_that_does_not_fit_is_named(kind: Any, fields: Any, error: str) -> None:
    with pytest.raises(FieldError, match=error):
        fill(kind, fields)
