"""What is wrong with findings themselves: each must say where, what, and what would be right."""

import re
from collections.abc import Iterable, Iterator

from m2pem.bpmn import NO_BPMN_RULES
from m2pem.bpmn.xml import XmlError, parse_xml
from m2pem.findings import Finding

MAX_CHARACTERS = 1000
"""Of a finding as it is printed: more is not read."""

_RULE = re.compile(r"[a-z]+(-[a-z0-9]+)*")


def flaws(data: bytes, name: str, findings: Iterable[Finding]) -> Iterator[str]:
    """What is wrong with the findings about a file, a line for each."""
    lines = data.count(b"\n") + data.count(b"\r") + 1
    by_line, ids = _elements(data)
    for finding in findings:
        where = by_line.get(finding.line, [])
        for said, wrong in (
            ("no such file", finding.file != name),
            ("no such line", not 1 <= finding.line <= lines),
            ("no such element", bool(finding.element) and not _known(finding, ids)),
            ("the element has an id", _anonymous(finding, where)),
            ("no rule", not _RULE.fullmatch(finding.rule)),
            ("no message", not finding.message.strip()),
            ("no remedy", not finding.remedy.strip()),
            ("several lines", len(str(finding).splitlines()) != 1),
            ("too long", len(str(finding)) - len(name) > MAX_CHARACTERS),
        ):
            if wrong:
                yield f"a finding is wrong ({said}): {str(finding)[:MAX_CHARACTERS]}"


def _elements(data: bytes) -> tuple[dict[int, list[str]], set[str]]:
    """The ids ("" for none) of the elements that begin on each line; and all ids."""
    try:
        document = parse_xml(data)
    except XmlError:
        return {}, set()
    by_line: dict[int, list[str]] = {}
    for element in document.root.iter("*"):
        by_line.setdefault(document.line(element), []).append(element.get("id") or "")
    return by_line, {each for line in by_line.values() for each in line}


def _known(finding: Finding, ids: set[str]) -> bool:
    inner = finding.element.rpartition(":")[2]  # behind the name of the file that is called
    return finding.element in ids or inner in ids or "~" in finding.element  # which is made up


def _anonymous(finding: Finding, where: list[str]) -> bool:
    return (
        not finding.element and finding.rule not in NO_BPMN_RULES and len(where) == 1 and any(where)
    )
