"""Data mappings, scripts and error variables of other engines, as they carry them out.

The values are those of Camunda 8's documentation (8.7, "Variables", "Multi-instance", "Script
tasks") and of Camunda 7's ("Process variables", "Error events"; 7.21).
"""

from typing import Any

import pytest

from m2pem.bpmn import parse_mission
from m2pem.engine import records as r
from tests.engine.kit import Play

HEAD = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="urn:t"'
    ' xmlns:z="http://camunda.org/schema/zeebe/1.0"'
    ' xmlns:m2pem="https://m2pem.org/schema/1"'
    ' xmlns:c="http://camunda.org/schema/1.0/bpmn">'
)


def play(task: str, roots: str = "") -> Play:
    """A process in which an element with the id T comes between start and a user task `after`."""
    text = f"""{HEAD}<process id="P" isExecutable="true">
        <startEvent id="S"/> {task} <userTask id="after"/> <endEvent id="E"/>
        <sequenceFlow id="f1" sourceRef="S" targetRef="T"/>
        <sequenceFlow id="f2" sourceRef="T" targetRef="after"/>
        <sequenceFlow id="f3" sourceRef="after" targetRef="E"/>
    </process>{roots}</definitions>"""
    return Play(parse_mission(text.encode(), "m.bpmn"))


def mapped(place: str, mappings: str, more: str = "", inside: str = "", wrap: str = "") -> str:
    return (
        f'<{place} id="T" {more}><extensionElements>{wrap}<z:ioMapping>{mappings}</z:ioMapping>'
        f"</extensionElements>{inside}</{place}>"
    )


INPUTS = '<z:input source="= x + 1" target="a"/><z:input source="= a * 10" target="b"/>'
STATEMENTS = "<script>seen = b\na = 99\nout = 5</script>"


def test_inputs_are_values_of_the_task_alone_and_each_reads_those_before_it() -> None:
    ran = play(mapped("scriptTask", INPUTS, inside=STATEMENTS)).start({"x": 1, "a": 7})
    assert ran.data == {"x": 1, "a": 7, "seen": 20, "out": 5}


def test_outputs_pass_on_what_the_task_has_and_each_reads_those_before_it() -> None:
    outputs = '<z:output source="= a + 1" target="m"/><z:output source="= m * 2" target="n"/>'
    ran = play(mapped("manualTask", INPUTS + outputs)).start({"x": 1})
    assert ran.data == {"x": 1, "m": 3, "n": 6}


@pytest.mark.parametrize("place", ["task", "manualTask", "userTask", "sendTask", "subProcess"])
def test_every_activity_passes_its_outputs_on(place: str) -> None:
    inside = '<startEvent id="i"/>' if place == "subProcess" else ""
    ran = play(mapped(place, '<z:output source="= 7" target="n"/>', inside=inside)).start()
    if place == "userTask":
        ran.answer(prompt="T")
    assert ran.at == "after"
    assert ran.data["n"] == 7


def test_inputs_of_a_subprocess_are_read_in_it_and_gone_after_it() -> None:
    inside = """<startEvent id="i"/><scriptTask id="t"><script>seen = speed
        speed = 9</script></scriptTask><sequenceFlow id="g" sourceRef="i" targetRef="t"/>"""
    ran = play(mapped("subProcess", '<z:input source="= 5" target="speed"/>', inside=inside))
    assert ran.start({"speed": 1}).data == {"speed": 1, "seen": 5}


@pytest.mark.parametrize(
    ("mappings", "data"),
    [
        ("", {"found": 3, "kind": "mine"}),
        ('<z:output source="= found * 2" target="n"/>', {"n": 6}),
        ('<z:input source="= 0" target="found"/>', {"kind": "mine"}),
    ],
)
def test_a_result_of_a_service_passes_on_as_the_mappings_say(
    mappings: str, data: dict[str, Any]
) -> None:
    """All of it without output mappings, with them those alone; an input keeps its own name."""
    wrap = '<z:taskDefinition type="Detector"/>'
    ran = play(mapped("serviceTask", mappings, wrap=wrap)).start()
    assert ran.complete("T", found=3, kind="mine").data == data


MESSAGE = '<message id="M" name="m"/>'


@pytest.mark.parametrize(
    "place",
    [
        mapped("receiveTask", '<z:output source="= n * 2" target="twice"/>', 'messageRef="M"'),
        mapped(
            "intermediateCatchEvent",
            '<z:output source="= n * 2" target="twice"/>',
            inside='<messageEventDefinition messageRef="M"/>',
        ),
    ],
)
def test_of_a_message_only_the_outputs_pass_on(place: str) -> None:
    ran = play(place, MESSAGE).start().message("M", {"n": 4, "other": 1})
    assert ran.data == {"twice": 8}


@pytest.mark.parametrize(
    "definition",
    [
        "",
        '<escalationEventDefinition escalationRef="X"/>',
        '<signalEventDefinition signalRef="G"/>',
    ],
)
def test_a_throw_event_passes_its_outputs_on_and_they_read_its_inputs(definition: str) -> None:
    mappings = '<z:input source="= 6" target="a"/><z:output source="= a + 1" target="n"/>'
    event = mapped("intermediateThrowEvent", mappings, inside=definition)
    ran = play(event, '<escalation id="X" escalationCode="x"/><signal id="G"/>').start()
    assert ran.data == {"n": 7}


def test_a_timer_event_passes_its_outputs_on() -> None:
    timer = "<timerEventDefinition><timeDuration>PT5S</timeDuration></timerEventDefinition>"
    mappings = '<z:output source="= 7" target="n"/>'
    ran = play(mapped("intermediateCatchEvent", mappings, inside=timer)).start()
    assert ran.advance(5).data == {"n": 7}


def test_a_start_and_an_end_event_pass_their_outputs_on() -> None:
    output = (
        "<extensionElements><z:ioMapping>"
        '<z:output source="= {}" target="{}"/></z:ioMapping></extensionElements>'
    )
    text = f"""{HEAD}<process id="P" isExecutable="true">
        <startEvent id="S">{output.format(1, "first")}</startEvent>
        <endEvent id="E">{output.format("first + 1", "last")}</endEvent>
        <sequenceFlow id="f" sourceRef="S" targetRef="E"/></process></definitions>"""
    ran = Play(parse_mission(text.encode(), "m.bpmn")).start()
    written = [each for each in ran.records() if isinstance(each, r.DataWritten)]
    assert {each.key: each.value for each in written} == {"first": 1, "last": 2}


def test_mappings_of_a_multi_instance_activity_are_those_of_each_instance() -> None:
    loop = """<multiInstanceLoopCharacteristics isSequential="true"><extensionElements>
        <z:loopCharacteristics inputCollection="= items" inputElement="item"
          outputCollection="results" outputElement="= double"/></extensionElements>
        </multiInstanceLoopCharacteristics>"""
    mappings = (
        '<z:input source="= item * 2" target="double"/><z:output source="= item" target="n"/>'
    )
    ran = play(mapped("manualTask", mappings, inside=loop)).start({"items": [1, 2, 3]})
    assert ran.data == {"items": [1, 2, 3], "results": [2, 4, 6], "n": 3}


def test_a_mapping_that_cannot_be_evaluated_is_an_error_of_its_element() -> None:
    ran = play(mapped("task", '<z:input source="= 1 / x" target="a"/>')).start({"x": 0})
    assert ran.detail.startswith("error EXPRESSION from T")


def test_mappings_of_camunda_7_are_carried_out() -> None:
    task = """<manualTask id="T"><extensionElements><c:inputOutput>
        <c:inputParameter name="a">${x + 1}</c:inputParameter>
        <c:inputParameter name="text">lap ${a}</c:inputParameter>
        <c:outputParameter name="n">${text}</c:outputParameter>
        </c:inputOutput></extensionElements></manualTask>"""
    assert play(task).start({"x": 1}).data == {"x": 1, "n": "lap 2"}


@pytest.mark.parametrize(
    ("task", "data"),
    [
        ('<z:script expression="= x * 3" resultVariable="n"/>', {"x": 2, "n": 6}),
        (
            '<z:script expression="= x * 3" resultVariable="n"/><z:ioMapping>'
            '<z:output source="= n + 1" target="m"/></z:ioMapping>',
            {"x": 2, "m": 7},
        ),
    ],
)
def test_a_script_of_camunda_8_stores_its_value(task: str, data: dict[str, Any]) -> None:
    script = f'<scriptTask id="T"><extensionElements>{task}</extensionElements></scriptTask>'
    assert play(script).start({"x": 2}).data == data


@pytest.mark.parametrize(("language", "text"), [("feel", "x * 3"), ("juel", "${x * 3}")])
def test_a_script_of_one_expression_stores_its_value(language: str, text: str) -> None:
    script = (
        f'<scriptTask id="T" scriptFormat="{language}" c:resultVariable="n">'
        f"<script>{text}</script></scriptTask>"
    )
    assert play(script).start({"x": 2}).data == {"x": 2, "n": 6}


OUTPUT_OF_CODE = '<z:output source="= code + &quot;!&quot;" target="n"/>'
ERROR = '<error id="X" errorCode="LOW"/><escalation id="Y" escalationCode="HIGH"/>'
VARIABLES = 'c:errorCodeVariable="code" c:errorMessageVariable="why"'


def failing(end: str, handler: str, outside: str) -> str:
    return f"""<subProcess id="T"><startEvent id="i"/><endEvent id="boom">{end}</endEvent>
        <sequenceFlow id="g" sourceRef="i" targetRef="boom"/>{handler}</subProcess>{outside}"""


@pytest.mark.parametrize("where", ["boundary", "event subprocess"])
def test_the_code_and_reason_of_a_caught_error_are_stored(where: str) -> None:
    caught = f"<errorEventDefinition {VARIABLES}/>"
    boundary = f'<boundaryEvent id="b" attachedToRef="T">{caught}</boundaryEvent>'
    handler = f"""<subProcess id="h" triggeredByEvent="true"><startEvent id="hs">{caught}
        </startEvent></subProcess>"""
    inside = handler if where == "event subprocess" else ""
    outside = boundary if where == "boundary" else ""
    thrown = '<errorEventDefinition errorRef="X"/>'
    ran = play(failing(thrown, inside, outside), ERROR).start()
    written = [each for each in ran.records() if isinstance(each, r.DataWritten)]
    assert {each.key: each.value for each in written} == {"code": "LOW", "why": "thrown by boom"}


def test_the_code_of_an_escalation_is_stored_also_where_nothing_is_interrupted() -> None:
    caught = '<escalationEventDefinition c:escalationCodeVariable="code"/>'
    outside = (
        f'<boundaryEvent id="b" attachedToRef="T" cancelActivity="false">{caught}</boundaryEvent>'
    )
    thrown = '<escalationEventDefinition escalationRef="Y"/>'
    assert play(failing(thrown, "", outside), ERROR).start().data == {"code": "HIGH"}


@pytest.mark.parametrize("where", ["boundary", "event subprocess"])
def test_an_event_that_catches_an_error_passes_its_outputs_on(where: str) -> None:
    mapped = (
        f"<extensionElements><z:ioMapping>{OUTPUT_OF_CODE}</z:ioMapping></extensionElements>"
        '<errorEventDefinition c:errorCodeVariable="code"/>'
    )
    boundary = f'<boundaryEvent id="b" attachedToRef="T">{mapped}</boundaryEvent>'
    handler = f"""<subProcess id="h" triggeredByEvent="true"><startEvent id="hs">{mapped}
        </startEvent></subProcess>"""
    inside, outside = ("", boundary) if where == "boundary" else (handler, "")
    ran = play(failing('<errorEventDefinition errorRef="X"/>', inside, outside), ERROR).start()
    written = [each for each in ran.records() if isinstance(each, r.DataWritten)]
    assert {each.key: each.value for each in written} == {"code": "LOW", "n": "LOW!"}
