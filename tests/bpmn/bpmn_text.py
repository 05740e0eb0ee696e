"""Small BPMN texts for the tests of reading: the body of `process` begins on line 3."""

from itertools import pairwise

from m2pem.bpmn import parse_mission
from m2pem.errors import MissionError
from m2pem.findings import Finding
from m2pem.mission.mission import Mission

HEAD = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
    ' xmlns:m2pem="https://m2pem.org/schema/1"'
    ' xmlns:camunda="http://camunda.org/schema/1.0/bpmn"'
    ' xmlns:zeebe="http://camunda.org/schema/zeebe/1.0"'
    ' xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"'
    ' xmlns:tns="urn:t" targetNamespace="urn:t">'
)


def definitions(text: str) -> bytes:
    """A file; `text` begins on line 2."""
    return f"{HEAD}\n{text}\n</definitions>".encode()


def process(body: str, roots: str = "") -> bytes:
    """A file with the process P, whose body begins on line 3; `roots` come after it."""
    return definitions(f'<process id="P">\n{body}\n</process>{roots}')


def flow(source: str, target: str, more: str = "") -> str:
    """A sequence flow with the id `source-target`."""
    return f'<sequenceFlow id="{source}-{target}" sourceRef="{source}" targetRef="{target}"{more}/>'


def line_of(*elements: str) -> str:
    """Start S, the elements' ids in a row, end E, each flow on the last line of the text."""
    ids = ["S", *elements, "E"]
    return '<startEvent id="S"/><endEvent id="E"/>' + "".join(
        flow(one, two) for one, two in pairwise(ids)
    )


def around(task: str, roots: str = "") -> bytes:
    """A process in which a task with the id T (on line 3) stands between start and end."""
    return process(f"{task}\n{line_of('T')}", roots)


def load(data: bytes) -> Mission:
    """Parse, under the name that findings show."""
    return parse_mission(data, "m.bpmn")


def findings(data: bytes) -> tuple[Finding, ...]:
    """All findings, whether the file loads or not."""
    try:
        return load(data).warnings
    except MissionError as error:
        return error.findings


def summary(data: bytes) -> list[tuple[str, int, str]]:
    """Rule, line and element of every finding."""
    return [(each.rule, each.line, each.element) for each in findings(data)]
