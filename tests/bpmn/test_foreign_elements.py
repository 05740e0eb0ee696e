"""Elements and attributes of other engines: harmless, carried out, or warned of each time."""

import pytest
from bpmn_text import HEAD, around, findings, load, process

from m2pem.bpmn.foreign_elements import CHANGING, CHANGING_ATTRIBUTES, HARMLESS

RULE = "foreign-effect"
HEAD_WITHOUT_CAMUNDA = HEAD.replace(' xmlns:camunda="http://camunda.org/schema/1.0/bpmn"', "")


def warned(data: bytes) -> list[tuple[str, str, str]]:
    return [(f.element, f.message, f.remedy) for f in findings(data) if f.rule == RULE]


def with_element(name: str, place: str = "userTask") -> bytes:
    prefix = (
        "zeebe" if name in ("calledDecision", "conditionalFilter", "taskHeaders") else "camunda"
    )
    return around(
        f'<{place} id="T"><extensionElements><{prefix}:{name} source="a" target="b"/>'
        f"</extensionElements></{place}>"
    )


@pytest.mark.parametrize("name", sorted(CHANGING))
def test_what_changes_the_execution_is_a_warning(name):
    [(element, message, remedy)] = warned(with_element(name))
    effect, right = CHANGING[name]
    assert element == "T"
    assert message.endswith(f"{name}: {effect}")
    assert remedy.startswith(right)


@pytest.mark.parametrize("name", sorted(HARMLESS - {"calledElement", "taskDefinition"}))
def test_what_does_not_is_none(name):
    assert warned(with_element(name)) == []


def test_no_element_is_in_two_places_of_the_table():
    assert not set(CHANGING) & HARMLESS


def test_each_one_is_a_warning_also_where_m2pem_has_no_elements_of_its_own():
    listener = "<extensionElements><camunda:executionListener event='end'/></extensionElements>"
    body = (
        f'<startEvent id="S">{listener}</startEvent><exclusiveGateway id="g">{listener}'
        f'</exclusiveGateway><sequenceFlow id="f" sourceRef="S" targetRef="g">{listener}'
        '</sequenceFlow><endEvent id="E"/><sequenceFlow id="h" sourceRef="g" targetRef="E"/>'
    )
    assert [each[0] for each in warned(process(body))] == ["S", "g", "f"]


@pytest.mark.parametrize("name", sorted(CHANGING_ATTRIBUTES))
@pytest.mark.parametrize("engine", ["camunda", "flowable", "activiti"])
def test_an_attribute_that_changes_the_execution_is_a_warning(engine, name):
    spaces = 'xmlns:flowable="http://flowable.org/bpmn" xmlns:activiti="http://activiti.org/bpmn"'
    [(element, message, _)] = warned(around(f'<userTask id="T" {spaces} {engine}:{name}="x"/>'))
    assert element == "T"
    assert message.endswith(f"{name}='x': {CHANGING_ATTRIBUTES[name][0]}")


@pytest.mark.parametrize(
    "attributes",
    [
        'camunda:asyncBefore="true"',
        'camunda:assignee="anna"',
        'camunda:inheritVariables="false"',
        'camunda:priority="5"',
    ],
)
def test_an_attribute_that_does_not_is_none(attributes):
    assert warned(around(f'<userTask id="T" {attributes}/>')) == []


def test_mappings_out_of_a_call_activity_are_warned_of_with_the_statement_to_write():
    [(_, _, remedy)] = warned(with_element("in"))
    assert remedy == "write it in a script task before it: b = a"


@pytest.mark.parametrize(
    ("attributes", "count"),
    [
        ("", 1),
        ('propagateAllParentVariables="false"', 1),
        ('propagateAllParentVariables="false" propagateAllChildVariables="false"', 0),
    ],
)
def test_a_call_that_passes_everything_by_default_is_a_warning(attributes, count):
    call = (
        '<callActivity id="T"><extensionElements>'
        f'<zeebe:calledElement processId="Q" {attributes}/></extensionElements></callActivity>'
    )
    other = '<process id="Q"><startEvent id="q"/></process>'
    assert len(warned(around(call, other))) == count


def test_an_output_collection_of_an_ad_hoc_subprocess_is_warned_of():
    ad_hoc = (
        '<adHocSubProcess id="T"><extensionElements><zeebe:adHoc outputCollection="results" '
        'outputElement="= x"/></extensionElements><task id="t"/></adHocSubProcess>'
    )
    [(element, message, _)] = warned(around(ad_hoc))
    assert (element, "are not collected" in message) == ("T", True)


def test_mappings_of_camunda_7_on_a_call_activity_are_warned_of():
    call = (
        '<callActivity id="T" calledElement="Q"><extensionElements><camunda:inputOutput>'
        '<camunda:inputParameter name="a">1</camunda:inputParameter></camunda:inputOutput>'
        "</extensionElements></callActivity>"
    )
    [(element, message, _)] = warned(around(call, '<process id="Q"><startEvent id="q"/></process>'))
    assert (element, "nothing is passed by it" in message) == ("T", True)


MESSAGE = '<message id="M" name="m"/>'
WORKER = '<extensionElements><zeebe:taskDefinition type="mail"/></extensionElements>'
DEFINED = '<messageEventDefinition messageRef="M"/>'


@pytest.mark.parametrize(
    "sender",
    [
        f'<sendTask id="T" messageRef="M">{WORKER}</sendTask>',
        f'<intermediateThrowEvent id="T">{WORKER}{DEFINED}</intermediateThrowEvent>',
        '<sendTask id="T" messageRef="M" camunda:delegateExpression="${mailer}"/>',
        '<intermediateThrowEvent id="T"><messageEventDefinition messageRef="M"'
        ' camunda:type="external" camunda:topic="mail"/></intermediateThrowEvent>',
    ],
)
def test_a_worker_that_sends_a_message_is_not_called(sender):
    [(element, message, _)] = warned(around(sender, MESSAGE))
    assert element == "T"
    assert message.endswith("the worker is not called")


@pytest.mark.parametrize("place", ["serviceTask", "businessRuleTask"])
def test_one_of_a_service_is(place):
    assert warned(around(f'<{place} id="T">{WORKER}</{place}>')) == []
    assert warned(around(f'<{place} id="T" camunda:type="external" camunda:topic="t"/>')) == []


def test_the_work_that_an_element_template_of_a_fleet_names_is_done():
    own = WORKER.replace("mail", "m2pem:routing")
    assert warned(around(f'<scriptTask id="T">{own}</scriptTask>')) == []


def looping(expression):
    """Camunda 8 counts instances from 1 (8.7, "Multi-instance")."""
    return around(
        f'<scriptTask id="T"><extensionElements><zeebe:script expression="{expression}"'
        ' resultVariable="r"/></extensionElements><multiInstanceLoopCharacteristics>'
        '<extensionElements><zeebe:loopCharacteristics inputCollection="=found"/>'
        "</extensionElements></multiInstanceLoopCharacteristics></scriptTask>"
    )


def test_a_counter_of_instances_that_begins_with_1_elsewhere_is_a_warning():
    [(_, message, remedy)] = warned(looping("= loopCounter * 2"))
    assert message.endswith("loopCounter is 0 in the first instance here, and 1 there")
    assert remedy == "write loopCounter + 1"
    assert warned(looping("= found")) == []


@pytest.mark.parametrize("place", ["task", "exclusiveGateway", "intermediateThrowEvent"])
def test_an_element_that_is_not_known_is_named_wherever_it_is(place):
    element = "<extensionElements><zeebe:somethingNew/></extensionElements>"
    found = findings(around(f'<{place} id="T">{element}</{place}>'))
    assert [each.element for each in found if each.rule == "foreign-extension"] == ["T"]


def test_scripts_of_jbpm_before_and_after_a_task_are_not_run():
    """As jBPM's editors write them."""
    script = (
        '<tns:{0} scriptFormat="http://www.java.com/java"><tns:script>kcontext.setVariable("x", 1);'
        "</tns:script></tns:{0}>"
    )
    scripts = "".join(map(script.format, ("onEntry-script", "onExit-script")))
    data = around(
        '<task id="T"><extensionElements xmlns:tns="http://www.jboss.org/drools"><tns:metaData'
        f' name="elementname"/>{scripts}</extensionElements></task>'
    )
    assert [message.rpartition(": ")[2] for _, message, _ in warned(data)] == [
        "the script is not run",
        "the script is not run",
    ]


@pytest.mark.parametrize(
    ("element", "attribute"),
    [
        ('<signal id="X" name="= &quot;dock&quot; + bay"/>', "name"),
        ('<message id="X" name="ready_${bay}"/>', "name"),
        ('<error id="X" errorCode="#{code}"/>', "errorCode"),
        ('<escalation id="X" escalationCode="=code"/>', "escalationCode"),
    ],
)
def test_a_name_or_code_that_is_an_expression_elsewhere_is_a_warning(element, attribute):
    [(_, message, _)] = warned(around('<task id="T"/>', element))
    assert f"here: {attribute}='" in message
    assert message.endswith("it is read as it stands, and not evaluated")
    assert warned(around('<task id="T"/>', '<error id="X" errorCode="a=b"/>')) == []


def test_those_of_operaton_are_those_of_camunda():
    """Operaton has a namespace of its own for the same."""
    space = 'xmlns:operaton="http://operaton.org/schema/1.0/bpmn"'
    mapping = (
        "<extensionElements><operaton:inputOutput><operaton:outputParameter name='z'>${x}"
        "</operaton:outputParameter></operaton:inputOutput></extensionElements>"
    )
    data = around(f'<userTask id="T" {space} operaton:formKey="f">{mapping}</userTask>').replace(
        HEAD.encode(), HEAD_WITHOUT_CAMUNDA.encode()
    )
    [(_, message, _)] = warned(data)
    assert "formKey='f': the form is not shown" in message
    [output] = load(data).elements["T"].data_flow.outputs
    assert (output.target, output.source.text) == ("z", "${x}")
