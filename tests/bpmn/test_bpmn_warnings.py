"""What is doubtful in a file is a warning: which rule, on which line, for which element."""

import pytest
from bpmn_text import around, definitions, flow, line_of, load, process

from m2pem.findings import Severity

S = '<startEvent id="S"/>'
E = '<endEvent id="E"/>'
TASK = '<task id="T"/>'

WARNINGS = {
    "unknown attribute": (
        around('<task id="T" colour="red"/>'),
        [("unknown-attribute", 3, "T")],
    ),
    "unknown attribute of a flow": (
        process(S + E + "\n" + flow("S", "E", ' targetref="x"')),
        [("misspelled-attribute", 4, "S-E")],
    ),
    "unknown child": (around('<task id="T">\n<foo/></task>'), [("unknown-element", 4, "T")]),
    "element order": (
        around('<task id="T"><outgoing>T-E</outgoing>\n<incoming>S-T</incoming></task>'),
        [("element-order", 4, "T")],
    ),
    "element order in a process": (
        process(f'{TASK}{line_of("T")}\n<laneSet id="L"/>'),
        [("element-order", 4, "P")],
    ),
    "assignment of nothing": (
        around(
            '<task id="T"><ioSpecification><dataInput id="i"/>'
            "<inputSet><dataInputRefs>i</dataInputRefs></inputSet><outputSet/></ioSpecification>"
            '<dataInputAssociation id="a"><targetRef>i</targetRef><assignment>\n<from/><to>i</to>'
            "</assignment></dataInputAssociation></task>"
        ),
        [("empty-assignment", 4, "T")],
    ),
    "misplaced extension": (
        around(
            '<task id="T"><extensionElements>\n<m2pem:prompt>x</m2pem:prompt>'
            "</extensionElements></task>"
        ),
        [("misplaced-extension", 4, "T")],
    ),
    "no ids": (
        definitions('<process>\n<task name="Go"/>\n<task/></process>\n<signal/>'),
        [
            ("missing-id", 2, "process~1"),
            ("missing-id", 3, "task~1"),
            ("missing-id", 4, "task~2"),
            ("missing-id", 5, "signal~1"),
        ],
    ),
    "service task without a service": (around('<serviceTask id="T"/>'), [("no-service", 3, "T")]),
    "script task without a script": (around('<scriptTask id="T"/>'), [("empty-script", 3, "T")]),
    "empty subprocess": (around('<subProcess id="T"/>'), [("empty-subprocess", 3, "T")]),
    "empty pool beside a filled one": (
        around(TASK, '\n<process id="Q"/>'),
        [("empty-process", 6, "Q")],
    ),
    "condition of a parallel gateway": (
        process(
            f'<parallelGateway id="T"/>{line_of("T")}<endEvent id="E2"/>\n'
            '<sequenceFlow id="f" sourceRef="T" targetRef="E2">'
            "<conditionExpression>true</conditionExpression></sequenceFlow>"
        ),
        [("condition-ignored", 4, "f")],
    ),
    "condition of a default flow": (
        process(
            f'<exclusiveGateway id="T" default="f"/>{line_of("T")}<endEvent id="E2"/>\n'
            '<sequenceFlow id="f" sourceRef="T" targetRef="E2">'
            "<conditionExpression>true</conditionExpression></sequenceFlow>"
        ),
        [("default-with-condition", 4, "f")],
    ),
    "empty condition": (
        process(
            f'{TASK}{line_of("T")}<endEvent id="E2"/>'
            '<sequenceFlow id="f" sourceRef="T" targetRef="E2">\n'
            "<conditionExpression/></sequenceFlow>"
        ),
        [("empty-condition", 4, "f")],
    ),
    "events that name nothing": (
        process(
            '<startEvent id="S"><messageEventDefinition/></startEvent>\n'
            '<endEvent id="E"><signalEventDefinition/></endEvent>'
            f"{flow('S', 'E')}"
        ),
        [("missing-reference", 3, "S"), ("missing-reference", 4, "E")],
    ),
    "reference to no data object": (
        around(f'{TASK}\n<dataObjectReference id="R" dataObjectRef="nope"/>'),
        [("dangling-reference", 4, "R")],
    ),
    "dangling display references": (
        around(
            TASK,
            '\n<collaboration id="C"><participant id="A" processRef="nope"/>\n'
            '<messageFlow id="M" sourceRef="A" targetRef="nope"/></collaboration>',
        ),
        [("dangling-reference", 6, "A"), ("dangling-reference", 7, "M")],
    ),
}


@pytest.mark.parametrize(("data", "expected"), WARNINGS.values(), ids=WARNINGS.keys())
def test_warns_and_loads(data: bytes, expected: list[tuple[str, int, str]]) -> None:
    warnings = load(data).warnings
    assert [(each.rule, each.line, each.element) for each in warnings] == expected
    assert all(each.severity is Severity.WARNING and each.remedy for each in warnings)
