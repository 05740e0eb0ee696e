"""Collection of a mission's requirements: from its BPMN file and from a spec file.

The BPMN file has `m2pem:requirement` in a process's extension elements; the spec file is YAML
(`m2pem verify --spec FILE`).
"""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from lxml import etree

from m2pem.bpmn.xml import BPMN, M2PEM, Document, parse_xml
from m2pem.findings import Finding, Severity
from m2pem.fleet.yaml_source import KeyPath, YamlSource, dotted, parse_yaml, read_yaml
from m2pem.mission import elements as e
from m2pem.mission.mission import Mission
from m2pem.suggestions import suggest
from m2pem.verify.assumptions import NOTHING, Assumptions
from m2pem.verify.requirements.names import Names
from m2pem.verify.requirements.reader import (
    UnusableError,
    WrittenRequirement,
    assumptions_of,
    requirements_of,
)
from m2pem.verify.requirements.requirement import Requirement, RequirementsError, misread


def read_mission_requirements(names: Names) -> list[Requirement]:
    """The requirements in the mission's own file, in its order.

    Raises:
        RequirementsError: requirements that cannot be used; it lists all findings.
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
        if element.get("monitor", "true") not in ("true", "false"):
            error(f"monitor='{element.get('monitor')}' is neither true nor false")
            continue
        try:
            found += requirements_of(_written(element, name, mission.file, document), names)
        except UnusableError as unusable:
            wrong = unusable.misread
            if wrong is None:
                attribute = "onViolation: " if unusable.where == "on_violation" else ""
                error(attribute + unusable.message, unusable.remedy)
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


def _written(
    element: etree._Element, name: str, file: str, document: Document
) -> WrittenRequirement:
    arguments: dict[str, Any] = {}
    for each in element.iterchildren(M2PEM + "arg"):
        key, value = each.get("name", ""), each.get("value", "")
        if key in arguments:  # said several times: a list
            earlier = arguments[key]
            arguments[key] = [*(earlier if isinstance(earlier, list) else [earlier]), value]
        else:
            arguments[key] = value
    return WrittenRequirement(
        name,
        element.get("ltl"),
        element.get("pattern"),
        arguments,
        element.get("text", ""),
        None if element.get("fair") is None else element.get("fair") == "true",
        file,
        document.line(element),
        element.get("assume", ()),
        element.get("monitor") != "false",
        element.get("onViolation", ""),
    )


def read_assumptions(names: Names, process: e.Process) -> Assumptions:
    """What the mission's file assumes of all runs that begin with a process: its `m2pem:assume`.

    Raises:
        RequirementsError: it cannot be used.
    """
    mission = names.mission
    if process.file:
        return NOTHING  # another file's
    document = parse_xml(mission.source)
    for element in document.root.iter(BPMN + "process"):
        text = element.get(M2PEM + "assume")
        if text is None or element.get("id") != process.id:
            continue
        try:
            return assumptions_of(text, names)
        except UnusableError as error:
            line = document.line(element)
            where = (mission.file, line, process.id, "assumption", error.message, error.remedy)
            raise RequirementsError([Finding(Severity.ERROR, *where)]) from None
    return NOTHING


_KEYS = ("id", "text", "ltl", "pattern", "args", "fair", "assume", "monitor", "on_violation")


def read_spec(path: Path, names: Names) -> list[Requirement]:
    """The requirements of a file, in its order.

    Raises:
        RequirementsError: the file, or something in it, cannot be used; it lists all findings.
    """
    return _requirements(read_yaml(path), names)


def parse_spec(content: bytes, file: str, names: Names) -> list[Requirement]:
    """The requirements of a text; findings call it `file`."""
    return _requirements(parse_yaml(content, file), names)


def _requirements(source: YamlSource, names: Names) -> list[Requirement]:
    found: list[Requirement] = []
    if not source.findings:
        entries = _entries(source)
        of_all = _assumed_of_all(source, names)
        seen: dict[str, int] = {}
        for number, entry in enumerate(entries):
            path: KeyPath = ("requirements", number)
            written = _item(source, path, entry)
            if written is None:
                continue
            if written.id in seen:
                source.error(
                    (*path, "id"),
                    "requirement-id",
                    f"two requirements have the id '{written.id}'",
                    f"give each its own; the first is in line {seen[written.id]}",
                )
                continue
            seen[written.id] = written.line
            try:
                found += (
                    replace(each, assumed=each.assumed & of_all)
                    for each in requirements_of(written, names)
                )
            except UnusableError as error:
                where = (*path, *error.where.split(".", 1)) if error.where else path
                _note(source, where, written.id, error)
    if source.findings:
        raise RequirementsError(_sorted(source.findings))
    return found


def _note(source: YamlSource, where: KeyPath, name: str, error: UnusableError) -> None:
    said = f"{name}: {error.message}"
    wrong = error.misread
    if wrong is None:
        source.error(where, "requirement", said, error.remedy)
        return
    line, key = source.line(where), dotted(where)
    source.findings.append(misread(source.file, line, key, said, wrong.text, wrong.position))


def _sorted(findings: list[Finding]) -> list[Finding]:
    return sorted(findings, key=lambda finding: finding.line)


def _entries(source: YamlSource) -> list[Any]:
    data = source.data
    entries = data.get("requirements") if isinstance(data, dict) else None
    if not isinstance(entries, list):
        source.error((), "requirement", "has no list 'requirements'", "write 'requirements:' first")
        return []
    assert isinstance(data, dict)
    for key in data:
        if key not in ("requirements", "assume"):
            source.error((key,), "requirement", f"'{key}' means nothing here", "delete it")
    return entries


def _assumed_of_all(source: YamlSource, names: Names) -> Assumptions:
    """What a file assumes of all its requirements."""
    data = source.data
    text: Any = data.get("assume", ()) if isinstance(data, dict) else ()
    if not _is_assumption(text):
        source.error(("assume",), "assumption", "'assume' is no text and no list of texts")
        return NOTHING
    try:
        return assumptions_of(text, names)
    except UnusableError as error:
        source.error(("assume",), "assumption", error.message, error.remedy)
        return NOTHING


def _is_assumption(value: Any) -> bool:
    """Whether it is a text, or a list of texts."""
    listed = value if isinstance(value, list | tuple) else [value]
    return all(isinstance(each, str) for each in listed)


def _item(source: YamlSource, path: KeyPath, entry: Any) -> WrittenRequirement | None:
    if not isinstance(entry, dict):
        source.error(
            path, "requirement", "is no requirement", "write 'id:' and 'ltl:' or 'pattern:'"
        )
        return None
    wrong = False
    for key in entry:
        if key not in _KEYS:
            wrong = True
            source.error(
                (*path, key),
                "requirement",
                f"a requirement has no '{key}'",
                suggest(key, _KEYS, "keys"),
            )
    for key in ("id", "text", "ltl", "pattern", "on_violation"):
        if key in entry and not isinstance(entry[key], str):
            wrong = True
            source.error((*path, key), "requirement", f"'{key}' is no text", "quote it")
    if not entry.get("id"):
        wrong = True
        source.error(path, "requirement-id", "a requirement has no id", "write 'id: ...' first")
    if not isinstance(entry.get("args", {}), dict):
        wrong = True
        source.error((*path, "args"), "requirement", "'args' is no map", "write {name: value}")
    if not isinstance(entry.get("fair", False), bool):
        wrong = True
        source.error((*path, "fair"), "requirement", "'fair' is true or false")
    if not _is_assumption(entry.get("assume", ())):
        wrong = True
        source.error((*path, "assume"), "requirement", "'assume' is no text and no list of texts")
    if not isinstance(entry.get("monitor", True), bool):
        wrong = True
        source.error((*path, "monitor"), "requirement", "'monitor' is true or false")
    if wrong:
        return None
    return WrittenRequirement(
        entry["id"],
        entry.get("ltl"),
        entry.get("pattern"),
        entry.get("args", {}),
        entry.get("text", ""),
        entry.get("fair"),
        source.file,
        source.line(path),
        entry.get("assume", ()),
        entry.get("monitor", True),
        entry.get("on_violation", ""),
    )


def begins_all_pools(mission: Mission) -> bool:
    """Whether the mission's file says that all pools begin together: `m2pem:allPools` of a
    collaboration. Not used in a rehearsal or a run.
    """
    if b"allPools" not in mission.source:
        return False
    root = parse_xml(mission.source).root
    collaborations = root.iterchildren(BPMN + "collaboration")
    return any(each.get(M2PEM + "allPools") == "true" for each in collaborations)


def assumptions_given(texts: Iterable[str], names: Names) -> Assumptions:
    """What `--assume` says, once or several times.

    Raises:
        RequirementsError: it cannot be used.
    """
    found = NOTHING
    findings: list[Finding] = []
    for text in texts:
        try:
            found &= assumptions_of(text, names)
        except UnusableError as error:
            where = ("--assume", 0, "", "assumption", error.message, error.remedy)
            findings.append(Finding(Severity.ERROR, *where))
    if findings:
        raise RequirementsError(findings)
    return found


TEXT_NAME = "requirements.yaml"
"""The name in findings of a text that did not come from a file."""


def collect(names: Names, spec: Path | bytes | None = None) -> list[Requirement]:
    """The requirements in the mission's file, then those of a spec file, or of its text.

    Raises:
        RequirementsError: it lists all findings in both, and ids that are in both.
    """
    found: list[Requirement] = []
    findings: list[Finding] = []
    try:
        found += read_mission_requirements(names)
    except RequirementsError as error:
        findings += error.findings
    if spec is not None:
        known = {each.id for each in found}
        try:
            if isinstance(spec, bytes):
                of_spec = parse_spec(spec, TEXT_NAME, names)
            else:
                of_spec = read_spec(spec, names)
        except RequirementsError as error:
            findings += error.findings
            of_spec = []
        findings += [
            Finding(
                Severity.ERROR,
                each.file,
                each.line,
                each.id,
                "requirement-id",
                f"{names.mission.file} has a requirement of this id too",
                "give each its own",
            )
            for each in of_spec
            if each.id in known
        ]
        found += of_spec
    if findings:
        raise RequirementsError(findings)
    return found
