"""Service, send and call tasks, and user tasks' prompts."""

import pytest
from bpmn_text import around, definitions, findings, line_of, load, process, summary

from m2pem.mission.behavior import Decision, RoleKind
from m2pem.mission.elements import (
    CallActivity,
    ReceiveTask,
    SendTask,
    ServiceTask,
    UserTask,
)
from m2pem.mission.mission import Mission


def task(mission: Mission) -> UserTask:
    node = mission.elements["T"]
    assert isinstance(node, UserTask)
    return node


def extended(tag: str, content: str, attributes: str = "") -> str:
    return (
        f'<{tag} id="T" name="Ask"{attributes}><extensionElements>\n{content}'
        f"</extensionElements></{tag}>"
    )


# --- user tasks ---------------------------------------------------------------------------------


def test_a_prompt_from_extension_elements() -> None:
    prompt = task(
        load(
            around(
                extended(
                    "userTask",
                    '<m2pem:userTask store="user.choice" role="commander" timeout="PT5M"/>'
                    "<m2pem:prompt>\n  Send the route,\n  then continue\n</m2pem:prompt>"
                    '<m2pem:decision value="continue" label="Continue"/>'
                    '<m2pem:decision value="abort"/>',
                )
            )
        )
    ).prompt
    assert prompt is not None
    assert prompt.text == "Send the route,\nthen continue"
    assert prompt.decisions == (Decision("continue", "Continue"), Decision("abort", "abort"))
    assert (prompt.store, prompt.role) == ("user.choice", "commander")
    assert prompt.timeout is not None
    assert prompt.timeout.text == "PT5M"


@pytest.mark.parametrize(
    "content",
    [
        '<m2pem:userTask store="s"><m2pem:prompt>Q</m2pem:prompt>'
        '<m2pem:decision value="v"/></m2pem:userTask>',
        '<m2pem:prompt store="s">Q</m2pem:prompt><m2pem:decision value="v"/>',
    ],
)
def test_other_ways_to_write_it(content: str) -> None:
    prompt = task(load(around(extended("userTask", content)))).prompt
    assert prompt is not None
    assert (prompt.text, prompt.decisions, prompt.store) == ("Q", (Decision("v", "v"),), "s")


def test_settings_as_attributes_of_the_task() -> None:
    mission = load(around('<userTask id="T" m2pem:store="s" m2pem:role="r"/>'))
    prompt = task(mission).prompt
    assert prompt is not None
    assert (prompt.store, prompt.role) == ("s", "r")
    assert mission.warnings == ()


@pytest.mark.parametrize(
    ("inside", "expected"),
    [("", "Ask"), ("<documentation>What now?</documentation>", "What now?")],
)
def test_a_task_without_a_prompt_asks_for_done(inside: str, expected: str) -> None:
    mission = load(around(f'<userTask id="T" name="Ask">{inside}</userTask>'))
    prompt = task(mission).prompt
    assert prompt is not None
    assert prompt.text == expected
    assert prompt.decisions == (Decision("done", "Done"),)
    assert (prompt.store, prompt.role, prompt.timeout) == ("user.decision", "", None)
    assert mission.warnings == ()


CARRIED = (
    "<extensionElements><m2pem:prompt>Q</m2pem:prompt>"
    '<m2pem:decision value="v" label="V"/></extensionElements>'
)
READS = (
    '<userTask id="T" name="Ask"><dataInputAssociation id="a"><sourceRef>R</sourceRef>'
    "<targetRef>x</targetRef></dataInputAssociation></userTask>"
)


@pytest.mark.parametrize(
    "data",
    [
        f'<dataObjectReference id="R" dataObjectRef="O"/><dataObject id="O">{CARRIED}</dataObject>',
        f'<dataObjectReference id="R" dataObjectRef="O">{CARRIED}</dataObjectReference>'
        '<dataObject id="O"/>',
    ],
)
def test_a_prompt_from_a_data_object_that_comes_later(data: str) -> None:
    prompt = task(load(around(READS + data))).prompt
    assert prompt is not None
    assert (prompt.text, prompt.decisions) == ("Q", (Decision("v", "V"),))


def test_what_the_task_itself_says_goes_before_the_data_object() -> None:
    own = READS.replace(
        "<dataInput",
        '<extensionElements><m2pem:prompt>Mine</m2pem:prompt><m2pem:decision value="w"/>'
        "</extensionElements><dataInput",
        1,
    )
    data = (
        f'<dataObjectReference id="R" dataObjectRef="O"/><dataObject id="O">{CARRIED}</dataObject>'
    )
    prompt = task(load(around(own + data))).prompt
    assert prompt is not None
    assert (prompt.text, prompt.decisions) == ("Mine", (Decision("w", "w"),))


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        ("<m2pem:decision/>", "decision-value"),
        ('<m2pem:decision value="a"/><m2pem:decision value="a"/>', "decision-value"),
        ('<m2pem:userTask store="not a name"/>', "bad-key"),
        ('<m2pem:userTask timeout="soon"/>', "timer-time"),
        ('<m2pem:userTask timeout="${a +}"/>', "bad-expression"),
        ("<m2pem:userTask><m2pem:promt/></m2pem:userTask>", "unknown-extension"),
    ],
)
def test_what_is_wrong_with_a_prompt(content: str, rule: str) -> None:
    assert summary(around(extended("userTask", content))) == [(rule, 4, "T")]


# --- service tasks ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        '<serviceTask id="T" class="Detector"/>',
        '<serviceTask id="T" m2pem:class="Detector"/>',
        '<serviceTask id="T" m2pem:service="Detector"/>',
        '<serviceTask id="T" camunda:class="Detector"/>',
        extended("serviceTask", '<m2pem:service class="Detector"/>'),
    ],
)
def test_ways_to_name_a_service(text: str) -> None:
    mission = load(around(text))
    node = mission.elements["T"]
    assert isinstance(node, ServiceTask)
    assert node.call is not None
    assert node.call.service == "Detector"
    assert mission.warnings == ()


def test_roles_and_properties_of_a_service() -> None:
    mission = load(
        around(
            extended(
                "serviceTask",
                '<m2pem:service class="Detector"><m2pem:role name="sensor" payload="evsg1/gpr"/>'
                '<m2pem:property name="type" value="gpr"/>'
                '<m2pem:property name="limit" value="${limit}"/></m2pem:service>'
                '<m2pem:property name="loose" value="1"/>'
                '<camunda:properties><camunda:property name="more" value="2"/>'
                "</camunda:properties>",
            )
        )
    )
    node = mission.elements["T"]
    assert isinstance(node, ServiceTask)
    assert node.call is not None
    (role,) = node.call.roles
    assert (role.name, role.kind, role.resource, role.line) == (
        "sensor",
        RoleKind.PAYLOAD,
        "evsg1/gpr",
        4,
    )
    assert [each.name for each in node.call.properties] == ["type", "limit", "loose", "more"]
    assert node.call.properties[0].value == "gpr"
    assert mission.warnings == ()


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (extended("serviceTask", "<m2pem:service/>"), ("service-class", 4)),
        (
            extended(
                "serviceTask",
                '<m2pem:service class="A"/><m2pem:property name="b" value="1"/>'
                '<m2pem:property name="b" value="2"/>',
            ),
            ("duplicate-property", 4),
        ),
        (
            extended(
                "serviceTask",
                '<m2pem:service class="A"><m2pem:property name="b" value="1"/>'
                '<m2pem:property name="b" value="2"/></m2pem:service>',
            ),
            ("duplicate-property", 4),
        ),
        (
            extended(
                "serviceTask",
                '<m2pem:service class="A"><m2pem:property name="b" value="1"/></m2pem:service>'
                '<m2pem:property name="b" value="2"/>',
            ),
            ("duplicate-property", 4),
        ),
        (
            extended("serviceTask", '<m2pem:service class="A"/>', ' camunda:class="B"'),
            ("two-services", 3),
        ),
        (
            extended(
                "serviceTask",
                '<m2pem:service class="A"/><m2pem:behavior type="vehicle" name="hold"/>',
            ),
            ("two-behaviors", 3),
        ),
        (
            extended("sendTask", '<m2pem:behavior type="vehicle" name="hold"/>', ' messageRef="m"'),
            ("two-behaviors", 3),
        ),
    ],
)
def test_what_is_wrong_with_a_service(text: str, found: tuple[str, int]) -> None:
    assert summary(around(text, '<message id="m"/>')) == [(*found, "T")]


def test_behaviors_of_service_and_send_tasks() -> None:
    for tag, kind in (("serviceTask", ServiceTask), ("sendTask", SendTask)):
        content = '<m2pem:behavior type="vehicle" name="hold"/>'
        mission = load(around(extended(tag, content)))
        node = mission.elements["T"]
        assert isinstance(node, kind)
        assert node.behavior is not None
        assert node.behavior.name == "hold"
        assert mission.warnings == ()


def test_messages_of_send_and_receive_tasks() -> None:
    mission = load(
        process(
            f'<sendTask id="A" messageRef="m"/><receiveTask id="B" messageRef="tns:m"/>'
            f"{line_of('A', 'B')}",
            '<message id="m"/>',
        )
    )
    send, receive = mission.nodes[:2]
    assert isinstance(send, SendTask)
    assert isinstance(receive, ReceiveTask)
    assert send.message is receive.message is mission.messages["m"]


# --- call activities ----------------------------------------------------------------------------


def call(content: str, inside: str = "", called: str = "") -> bytes:
    return definitions(
        '<process id="P">\n'
        f'<dataObject id="O" name="mission.speed"/>'
        f'<callActivity id="T" calledElement="Q"><extensionElements>\n{content}'
        f"</extensionElements>{inside}</callActivity>{line_of('T')}</process>"
        f'<process id="Q">{called}<task id="t"/></process>'
    )


def mapped(data: bytes) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
    node = load(data).elements["T"]
    assert isinstance(node, CallActivity)
    return (
        [(each.source.text, each.target) for each in node.mappings.inputs],
        [(each.source.text, each.target) for each in node.mappings.outputs],
    )


@pytest.mark.parametrize(
    "content",
    [
        '<m2pem:in source="a.b" target="x"/><m2pem:out source="y" target="c"/>',
        '<camunda:in source="a.b" target="x"/><camunda:out source="y" target="c"/>'
        '<camunda:in businessKey="#{execution.processBusinessKey}"/>',
        '<f:in xmlns:f="http://flowable.org/bpmn" source="a.b" target="x"/>'
        '<a:out xmlns:a="http://activiti.org/bpmn" source="y" target="c"/>',
    ],
)
def test_mappings_by_name(content: str) -> None:
    assert mapped(call(content)) == ([("a.b", "x")], [("y", "c")])


def test_mappings_by_expression() -> None:
    assert mapped(
        call(
            '<m2pem:in source="${a + 1}" target="x"/>'
            '<camunda:in sourceExpression="${b * 2}" target="y"/>'
            '<zeebe:ioMapping><zeebe:input source="= c" target="z"/>'
            '<zeebe:output source="= d" target="w"/></zeebe:ioMapping>'
        )
    ) == ([("${a + 1}", "x"), ("${b * 2}", "y"), ("= c", "z")], [("= d", "w")])


def test_mappings_by_data_associations() -> None:
    inside = (
        '<ioSpecification id="io"><dataInput id="di" name="speed"/>'
        '<dataOutput id="do" name="result"/></ioSpecification>'
        '<dataInputAssociation id="a"><sourceRef>O</sourceRef><targetRef>di</targetRef>'
        "</dataInputAssociation>"
        '<dataOutputAssociation id="b"><sourceRef>do</sourceRef><targetRef>O</targetRef>'
        "</dataOutputAssociation>"
    )
    assert mapped(call("", inside)) == ([("mission.speed", "speed")], [("result", "mission.speed")])


def test_a_data_association_to_a_data_object_of_the_called_process() -> None:
    inside = (
        '<dataInputAssociation id="a"><sourceRef>O</sourceRef><targetRef>I</targetRef>'
        "</dataInputAssociation>"
    )
    called = '<dataObject id="I" name="inner.speed"/>'
    assert mapped(call("", inside, called)) == ([("mission.speed", "inner.speed")], [])


def test_an_editors_placeholder_keeps_the_name() -> None:
    inside = (
        '<property id="Property_1" name="__targetRef_placeholder"/>'
        '<dataInputAssociation id="a"><sourceRef>O</sourceRef><targetRef>Property_1</targetRef>'
        "</dataInputAssociation>"
        '<dataOutputAssociation id="b"><targetRef>O</targetRef></dataOutputAssociation>'
    )
    assert mapped(call("", inside)) == (
        [("mission.speed", "mission.speed")],
        [("mission.speed", "mission.speed")],
    )


@pytest.mark.parametrize(
    "inside",
    [
        "<sourceRef>O</sourceRef><targetRef>x</targetRef><assignment><from>1</from><to>2</to>"
        "</assignment>",
        "<sourceRef>nope</sourceRef><targetRef>x</targetRef>",
    ],
)
def test_data_associations_that_pass_nothing_are_warned_of(inside: str) -> None:
    data = call("", f'<dataInputAssociation id="a">{inside}</dataInputAssociation>')
    assert [each.rule for each in findings(data)] == ["association-ignored"]
    assert mapped(data) == ([], [])


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        ('<camunda:in variables="all"/>', "passes-everything"),
        ('<m2pem:in source="a" target=""/>', "bad-key"),
        ('<m2pem:in source="a" target="two words"/>', "bad-key"),
        ('<m2pem:in target="x"/>', "mapping-source"),
        ('<m2pem:in source="a +" target="x"/>', "bad-expression"),
        (
            '<zeebe:calledElement propagateAllChildVariables="true"/>',
            "passes-everything",
        ),
    ],
)
def test_mappings_that_are_refused(content: str, rule: str) -> None:
    assert summary(call(content)) == [(rule, 4, "T")]


def test_the_called_element_of_zeebe() -> None:
    data = definitions(
        '<process id="P"><callActivity id="T"><extensionElements>'
        '<zeebe:calledElement processId="Q" propagateAllChildVariables="false"/>'
        f"</extensionElements></callActivity>{line_of('T')}</process>"
        '<process id="Q"><task id="t"/></process>'
    )
    node = load(data).elements["T"]
    assert isinstance(node, CallActivity)
    assert node.called.id == "Q"
