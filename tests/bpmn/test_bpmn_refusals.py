"""What cannot be executed is refused: which rule, on which line, for which element."""

import pytest
from bpmn_text import around, definitions, findings, flow, line_of, load, process, summary

from m2pem.errors import MissionError
from m2pem.findings import Severity

S = '<startEvent id="S"/>'
E = '<endEvent id="E"/>'
TASK = '<task id="T"/>'

ERRORS = {
    # --- not executed yet -----------------------------------------------------------------------
    "ordering that nobody knows": (
        around('<adHocSubProcess id="T" ordering="Random"><task id="x"/></adHocSubProcess>'),
        [("ad-hoc-ordering", 3, "T")],
    ),
    "start quantity": (around('<task id="T" startQuantity="two"/>'), [("start-quantity", 3, "T")]),
    "completion quantity": (
        around('<task id="T" completionQuantity="many"/>'),
        [("completion-quantity", 3, "T")],
    ),
    "assignment that says nothing": (
        around(
            '<task id="T"><ioSpecification><dataInput id="i"/></ioSpecification>'
            '<dataInputAssociation id="a"><targetRef>i</targetRef><assignment><to>i</to>'
            "</assignment></dataInputAssociation></task>"
        ),
        [("bad-assignment", 3, "T")],
    ),
    "parallel event-based gateway that begins nothing": (
        around('<eventBasedGateway id="T" eventGatewayType="Parallel"/>'),
        [
            ("parallel-event-gateway", 3, "T"),
            ("event-gateway-branches", 3, "T"),
            ("event-gateway-target", 3, "T"),
        ],
    ),
    "called expression": (
        around('<callActivity id="T" calledElement="${which}"/>'),
        [("not-executed", 3, "T")],
    ),
    "choreography": (
        definitions('<choreography id="C"/><process id="P"><startEvent id="S"/></process>'),
        [("not-executed", 2, "C")],
    ),
    # --- ids and references ---------------------------------------------------------------------
    "duplicate id": (
        process(f'{TASK}\n<task id="T"/>\n{line_of("T")}'),
        [("duplicate-id", 4, "T")],
    ),
    "id of a root taken": (
        around(TASK, '\n<signal id="T"/>'),
        [("duplicate-id", 3, "T")],
    ),
    "dangling flow ends": (
        process(
            f"{TASK}{line_of('T')}\n"
            '<sequenceFlow id="f" sourceRef="T" targetRef="nowhere"/>\n'
            '<sequenceFlow id="g" targetRef="T"/>\n'
            '<dataObject id="D"/>\n<sequenceFlow id="h" sourceRef="D" targetRef="T"/>'
        ),
        [
            ("dangling-reference", 4, "f"),
            ("dangling-reference", 5, "g"),
            ("dangling-reference", 7, "h"),
        ],
    ),
    "dangling default": (
        around('<exclusiveGateway id="T" default="nope"/>'),
        [("dangling-reference", 3, "T")],
    ),
    "dangling attachment": (
        around(
            f'{TASK}\n<boundaryEvent id="B" attachedToRef="X"><errorEventDefinition/>'
            "</boundaryEvent>"
        ),
        [("dangling-reference", 4, "B")],
    ),
    "dangling signal": (
        around(
            '<intermediateThrowEvent id="T">\n<signalEventDefinition signalRef="s"/>'
            "</intermediateThrowEvent>"
        ),
        [("dangling-reference", 4, "T")],
    ),
    "signal that is a message": (
        around(
            '<intermediateThrowEvent id="T">\n<signalEventDefinition signalRef="m"/>'
            "</intermediateThrowEvent>",
            '<message id="m"/>',
        ),
        [("dangling-reference", 4, "T")],
    ),
    "dangling message of a task": (
        around('<receiveTask id="T" messageRef="m"/>'),
        [("dangling-reference", 3, "T")],
    ),
    "dangling error and escalation": (
        process(
            f'{S}<endEvent id="A"><errorEventDefinition errorRef="e"/></endEvent>\n'
            '<endEvent id="B"><escalationEventDefinition escalationRef="e"/></endEvent>'
            f"{flow('S', 'A')}{flow('S', 'B')}"
        ),
        [("dangling-reference", 3, "A"), ("dangling-reference", 4, "B")],
    ),
    "dangling eventDefinitionRef": (
        process(
            f'{S}<endEvent id="E">\n<eventDefinitionRef>d</eventDefinitionRef>'
            f"</endEvent>{flow('S', 'E')}"
        ),
        [("dangling-reference", 4, "E")],
    ),
    "called process that is not there": (
        around('<callActivity id="T" calledElement="Q"/>'),
        [("dangling-reference", 3, "T")],
    ),
    "nothing called": (around('<callActivity id="T"/>'), [("no-called-element", 3, "T")]),
    # --- the graph ------------------------------------------------------------------------------
    "flow into a subprocess": (
        process(f'<subProcess id="X"><task id="x"/></subProcess>{line_of("X")}\n{flow("S", "x")}'),
        [("flow-crosses-border", 4, "S-x")],
    ),
    "flow into a start event": (
        process(f"{TASK}{line_of('T')}\n{flow('T', 'S')}"),
        [("flow-into-start", 4, "T-S")],
    ),
    "flow out of an end event": (
        process(f"{TASK}{line_of('T')}\n{flow('E', 'T')}"),
        [("flow-out-of-end", 4, "E-T")],
    ),
    "flow into a boundary event": (
        process(
            f"{TASK}{line_of('T')}"
            '<boundaryEvent id="B" attachedToRef="T"><errorEventDefinition/></boundaryEvent>\n'
            f"{flow('S', 'B')}"
        ),
        [("flow-into-boundary", 4, "S-B")],
    ),
    "default of another": (
        around('<exclusiveGateway id="T" default="S-T"/>'),
        [("default-not-own", 3, "T")],
    ),
    "boundary event on a gateway": (
        around(
            '<exclusiveGateway id="T"/>\n'
            '<boundaryEvent id="B" attachedToRef="T"><errorEventDefinition/></boundaryEvent>'
        ),
        [("bad-attachment", 4, "B")],
    ),
    "boundary event on nothing": (
        around(f'{TASK}\n<boundaryEvent id="B"><errorEventDefinition/></boundaryEvent>'),
        [("bad-attachment", 4, "B")],
    ),
    "boundary event on an inner task": (
        around(
            '<subProcess id="T"><task id="x"/></subProcess>\n'
            '<boundaryEvent id="B" attachedToRef="x"><errorEventDefinition/></boundaryEvent>'
        ),
        [("bad-attachment", 4, "B")],
    ),
    "nothing can start": (
        process(f'<task id="A"/><task id="B"/>{flow("A", "B")}{flow("B", "A")}'),
        [("no-start", 2, "P")],
    ),
    "empty process": (definitions('<process id="P"/>'), [("empty-process", 2, "P")]),
    "no process": (definitions('<signal id="s"/>'), [("no-process", 1, "")]),
    "called process is empty": (
        around('<callActivity id="T" calledElement="Q"/>', '\n<process id="Q"/>'),
        [("empty-process", 6, "Q")],
    ),
    "unreachable, beside another error": (
        process(f'{TASK}{line_of("T")}\n<task id="U"/>', '<process id="Q"><event/></process>'),
        [("unreachable", 4, "U"), ("not-executed", 5, "")],
    ),
    # --- events ---------------------------------------------------------------------------------
    "typed start in a subprocess": (
        around(
            '<subProcess id="T">\n<startEvent id="x"><timerEventDefinition><timeDuration>PT1S'
            "</timeDuration></timerEventDefinition></startEvent></subProcess>"
        ),
        [("typed-start-in-subprocess", 4, "x")],
    ),
    "error that does not interrupt": (
        around(
            f'{TASK}\n<boundaryEvent id="B" attachedToRef="T" cancelActivity="false">'
            "<errorEventDefinition/></boundaryEvent>"
        ),
        [("error-not-interrupting", 4, "B")],
    ),
    "error start event": (
        process(f'<startEvent id="S"><errorEventDefinition/></startEvent>{E}{flow("S", "E")}'),
        [("start-trigger", 3, "S")],
    ),
    "timer end event": (
        process(
            f'{S}<endEvent id="E"><timerEventDefinition><timeDuration>PT1S</timeDuration>'
            f"</timerEventDefinition></endEvent>{flow('S', 'E')}"
        ),
        [("end-result", 3, "E")],
    ),
    "catching terminate": (
        around(
            '<intermediateCatchEvent id="T"><terminateEventDefinition/></intermediateCatchEvent>'
        ),
        [("catch-trigger", 3, "T")],
    ),
    "catch without a trigger": (
        around('<intermediateCatchEvent id="T"/>'),
        [("no-trigger", 3, "T")],
    ),
    "boundary without a trigger": (
        around(f'{TASK}\n<boundaryEvent id="B" attachedToRef="T"/>'),
        [("no-trigger", 4, "B")],
    ),
    "timer without a time": (
        around('<intermediateCatchEvent id="T">\n<timerEventDefinition/></intermediateCatchEvent>'),
        [("timer-time", 4, "T")],
    ),
    "timer with a wrong time": (
        around(
            '<intermediateCatchEvent id="T"><timerEventDefinition>\n<timeDuration>5 minutes'
            "</timeDuration></timerEventDefinition></intermediateCatchEvent>"
        ),
        [("timer-time", 4, "T")],
    ),
    "timer with two times": (
        around(
            '<intermediateCatchEvent id="T">\n<timerEventDefinition><timeDuration>PT1S'
            "</timeDuration><timeCycle>R/PT1S</timeCycle></timerEventDefinition>"
            "</intermediateCatchEvent>"
        ),
        [("timer-time", 4, "T")],
    ),
    "cancelActivity that is no truth": (
        around(
            f'{TASK}\n<boundaryEvent id="B" attachedToRef="T" cancelActivity="maybe">'
            "<errorEventDefinition/></boundaryEvent>"
        ),
        [("bad-value", 4, "B")],
    ),
    "sender that is no operator": (
        around(TASK, '\n<signal id="s" m2pem:from="nobody"/>'),
        [("bad-value", 6, "s")],
    ),
    # --- expressions ----------------------------------------------------------------------------
    "condition that is none": (
        process(
            f'{TASK}{line_of("T")}<endEvent id="E2"/>'
            '<sequenceFlow id="f" sourceRef="T" targetRef="E2">\n'
            "<conditionExpression>a ==</conditionExpression></sequenceFlow>"
        ),
        [("bad-expression", 4, "f")],
    ),
    "condition in another language": (
        process(
            f'{TASK}{line_of("T")}<endEvent id="E2"/>'
            '<sequenceFlow id="f" sourceRef="T" targetRef="E2">\n'
            '<conditionExpression language="groovy">true</conditionExpression></sequenceFlow>'
        ),
        [("bad-expression", 4, "f")],
    ),
    "condition out of an event": (
        process(
            f"{S}{E}"
            '<sequenceFlow id="f" sourceRef="S" targetRef="E">'
            "<conditionExpression>true</conditionExpression></sequenceFlow>"
        ),
        [("condition-not-allowed", 3, "f")],
    ),
    "misspelt element": (
        process(f'{TASK}{line_of("T")}\n<scriptTaks id="X"/>'),
        [("unknown-element", 4, "X")],
    ),
}


@pytest.mark.parametrize(("data", "expected"), ERRORS.values(), ids=ERRORS.keys())
def test_a_mission_with_an_error_is_refused(
    data: bytes, expected: list[tuple[str, int, str]]
) -> None:
    with pytest.raises(MissionError) as caught:
        load(data)
    errors = [each for each in caught.value.findings if each.severity is Severity.ERROR]
    assert [(each.rule, each.line, each.element) for each in errors] == expected
    for each in errors:
        assert each.file == "m.bpmn"
        assert each.message
        assert each.remedy


def test_finds_everything_at_once_sorted_by_line() -> None:
    data = process(
        '<endEvent id="E"/><startEvent id="S"/>\n<choreographyTask id="A"/>\n<task id="S"/>\n'
        '<sequenceFlow id="f" sourceRef="S" targetRef="gone"/>\n<task id="T" wrong="1"/>\n'
        '<callActivity id="C" calledElement="Q"/>'
    )
    assert summary(data) == [
        ("not-executed", 4, "A"),
        ("duplicate-id", 5, "S"),
        ("dangling-reference", 6, "f"),
        ("unknown-attribute", 7, "T"),
        ("dangling-reference", 8, "C"),
    ]


def test_a_refused_element_names_its_kind() -> None:
    (finding,) = findings(around('<choreographyTask id="T"/>'))
    assert finding.message == "m2pem does not execute a choreography task yet"


def test_a_misspelt_reference_gets_the_near_match() -> None:
    (finding,) = findings(process(f'{S}{E}<task id="DriveRoute"/>\n{flow("S", "DriveRuote")}'))
    assert finding.remedy == "did you mean 'DriveRoute'?"


def test_a_missing_called_process_lists_those_that_exist() -> None:
    (finding,) = findings(around('<callActivity id="T" calledElement="Detektion"/>'))
    assert "'P'" in finding.remedy


def test_a_finding_reads_as_one_line() -> None:
    (finding,) = findings(around('<choreographyTask id="T"/>'))
    assert str(finding) == (
        "m.bpmn:3: T: error: m2pem does not execute a choreography task yet; draw the mission as "
        "processes [not-executed M110]"
    )
