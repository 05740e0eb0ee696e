"""Requirements in a mission's file: `m2pem:requirement` in a process's extension elements."""

from typing import Any

from lxml import etree

from m2pem.bpmn.names import BPMN, M2PEM
from m2pem.bpmn.xml import Document, parse_xml
from m2pem.findings import Finding, Severity
from m2pem.verify.requirements.names import Names
from m2pem.verify.requirements.reading import UnusableError, Written, made
from m2pem.verify.requirements.requirement import Requirement, RequirementsError, misread


def read_mission_requirements(names: Names) -> list[Requirement]:
    """The requirements in the mission's own file, in its order.

    Raises:
        RequirementsError: one cannot be used; tells all that is wrong.
    """
    mission = names.mission
    document = parse_xml(mission.source)
    found: list[Requirement] = []
    findings: list[Finding] = []
    seen: set[str] = set()
    for number, element in enumerate(_elements(document), 1):
        name = element.get("id") or f"requirement~{number}"

        def error(message: str, remedy: str = "", at: etree._Element = element) -> None:
            findings.append(
                Finding(
                    Severity.ERROR,
                    mission.file,
                    document.line(at),
                    name,  # noqa: B023
                    "requirement",
                    message,
                    remedy,
                )
            )

        if name in seen:
            error("two requirements have this id", "give each its own")
            continue
        seen.add(name)
        if element.get("fair", "true") not in ("true", "false"):
            error(f"fair='{element.get('fair')}' is neither true nor false")
            continue
        try:
            found += made(_written(element, name, mission.file, document), names)
        except UnusableError as unusable:
            wrong = unusable.misread
            if wrong is None:
                error(unusable.message, unusable.remedy)
                continue
            line = document.line(element)
            findings.append(
                misread(mission.file, line, name, unusable.message, wrong.text, wrong.position)
            )
    if findings:
        raise RequirementsError(findings)
    return found


def _elements(document: Document) -> list[etree._Element]:
    return [
        each
        for process in document.root.iter(BPMN + "process")
        for outer in process.iterchildren(BPMN + "extensionElements")
        for each in outer.iterchildren(M2PEM + "requirement")
    ]


def _written(element: etree._Element, name: str, file: str, document: Document) -> Written:
    arguments: dict[str, Any] = {}
    for each in element.iterchildren(M2PEM + "arg"):
        key, value = each.get("name", ""), each.get("value", "")
        if key in arguments:  # said several times: a list
            earlier = arguments[key]
            arguments[key] = [*(earlier if isinstance(earlier, list) else [earlier]), value]
        else:
            arguments[key] = value
    return Written(
        name,
        element.get("ltl"),
        element.get("pattern"),
        arguments,
        element.get("text", ""),
        None if element.get("fair") is None else element.get("fair") == "true",
        file,
        document.line(element),
    )
