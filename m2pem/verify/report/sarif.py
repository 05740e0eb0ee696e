"""The report as SARIF 2.1.0, the format of static analysis results that CI services show.

A rule is a property of every mission or a requirement of the author. A violation is a result, with
its run as a code flow, of kind `review` if it may be a false alarm; a property that is undecided is
a result of kind `open`.
"""

from collections.abc import Iterable, Iterator, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any
from urllib.parse import quote

from m2pem.mission.elements import Element, FlowNode, Process, SequenceFlow
from m2pem.mission.mission import Mission
from m2pem.verify.properties.help import HELP
from m2pem.verify.properties.results import Result, Verdict
from m2pem.verify.report.findings import DescribedViolation, Findings
from m2pem.verify.report.run_steps import RunStep

SCHEMA = (
    "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
)
"""The identifier of the format."""


def as_sarif(findings: Findings, version: str) -> dict[str, Any]:
    """Return one log with one run. `version`: of m2pem."""
    rules = {answer.property: number for number, answer in enumerate(findings.results)}
    results = [_violation(findings, rules, each) for each in findings.violations]
    results += [_open(findings, rules, each) for each in findings.results if _is_open(each)]
    return {
        "$schema": SCHEMA,
        "version": "2.1.0",
        "runs": [
            {
                "tool": {
                    "driver": {
                        "name": "m2pem",
                        "version": version,
                        "rules": [_rule(answer, findings) for answer in findings.results],
                    }
                },
                "automationDetails": {"id": f"m2pem/{findings.mission.file}/"},
                "artifacts": [
                    {"location": {"uri": _uri(findings.mission.file)}, "roles": ["analysisTarget"]}
                ],
                "invocations": [_invocation(findings)],
                "results": results,
                "columnKind": "unicodeCodePoints",
            }
        ],
    }


def _invocation(findings: Findings) -> dict[str, Any]:
    stopped = findings.coverage.stopped
    said = [f"{stopped} ended the search"] if stopped else []
    said += findings.coverage.notes
    return {
        "executionSuccessful": True,
        "exitCode": findings.exit_status,
        "toolExecutionNotifications": [
            {"level": "note", "message": {"text": each}} for each in said
        ],
    }


def _rule(answer: Result, findings: Findings) -> dict[str, Any]:
    rule: dict[str, Any] = {
        "id": answer.property,
        "shortDescription": {"text": answer.text},
        "defaultConfiguration": {"level": "error" if findings.counts(answer) else "warning"},
    }
    known = None if answer.required else HELP.get(answer.property)
    if known is not None:
        means = f"{known.means[0].upper()}{known.means[1:]}."
        markdown = f"{means} To correct a violation: {known.correction}."
        rule["help"] = {"text": markdown.replace("`", ""), "markdown": markdown}
    elif answer.author:
        rule["fullDescription"] = {"text": answer.author}
    return rule


def _violation(
    findings: Findings, rules: dict[str, int], violation: DescribedViolation
) -> dict[str, Any]:
    answer, found = violation.answer, violation.found
    where = [*dict.fromkeys(found.elements)]
    result = {
        "ruleId": answer.property,
        "ruleIndex": rules[answer.property],
        "level": "error" if findings.counts(answer) else "warning",
        "message": {"text": found.message},
        "locations": _locations(findings.mission, where[:1] or [findings.net.process]),
        "partialFingerprints": {"elements/v1": _fingerprint([answer.property, *where])},
    }
    if found.doubt:  # a person has to look at it
        text = f"{found.message}; may be a false alarm: {found.doubt}"
        result |= {"kind": "review", "level": "none", "message": {"text": text}}
    if others := _locations(findings.mission, where[1:]):
        result["relatedLocations"] = others
    if violation.run_steps or violation.loop:
        result["codeFlows"] = [_code_flow(findings.mission, violation)]
    return result


def _open(findings: Findings, rules: dict[str, int], answer: Result) -> dict[str, Any]:
    return {
        "ruleId": answer.property,
        "ruleIndex": rules[answer.property],
        "kind": "open",
        "level": "none",
        "message": {"text": f"undecided: {answer.covered or 'not all was searched'}"},
        "locations": _locations(findings.mission, [findings.net.process]),
        "partialFingerprints": {"elements/v1": _fingerprint([answer.property, "undecided"])},
    }


def _is_open(answer: Result) -> bool:
    return answer.verdict is Verdict.UNDECIDED


def _code_flow(mission: Mission, violation: DescribedViolation) -> dict[str, Any]:
    steps = [_step(mission, each, "") for each in violation.run_steps]
    steps += [_step(mission, each, "again and again: ") for each in violation.loop]
    return {"threadFlows": [{"locations": steps}]}


def _step(mission: Mission, step: RunStep, before: str) -> dict[str, Any]:
    (location,) = _locations(mission, [step.element]) or [{}]
    text = f"{step.number}. {before}{step.text}"
    return {"location": {**location, "message": {"text": text}}, "executionOrder": step.number}


def _locations(mission: Mission, elements: Iterable[str]) -> list[dict[str, Any]]:
    return list(_each_location(mission, elements))


def _each_location(mission: Mission, elements: Iterable[str]) -> Iterator[dict[str, Any]]:
    processes = {process.id: process for process in mission.processes}
    for name in elements:
        element: Element | None = mission.elements.get(name) or processes.get(name)
        file = mission.file if element is None else _file_of(mission, element)
        line = 1 if element is None else max(element.line, 1)
        yield {
            "physicalLocation": {
                "artifactLocation": {"uri": _uri(file)},
                "region": {"startLine": line},
            },
            "logicalLocations": [
                {"name": name, "kind": "element" if element is None else element.kind}
            ],
        }


def _file_of(mission: Mission, element: Element) -> str:
    if isinstance(element, SequenceFlow):
        element = element.source
    if isinstance(element, FlowNode | Process):
        return mission.file_of(element)
    return mission.file


def _uri(file: str) -> str:
    """Return a file's URI: relative ones are relative to where the command ran."""
    path = Path(file)
    return path.as_uri() if path.is_absolute() else quote(path.as_posix())


def _fingerprint(parts: Sequence[str]) -> str:
    """Return what a result has in common with the same one of a later run."""
    return sha256("\n".join(parts).encode()).hexdigest()[:32]
