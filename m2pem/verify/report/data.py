"""The report as data for programs: what an editor needs to step through a run.

The shape is that of docs/verification.schema.json. `version` counts up when something that is
there changes its meaning or goes; what is added needs no new version.
"""

from hashlib import sha256
from typing import Any

from m2pem.verify.properties.results import Result
from m2pem.verify.report.conditions import condition_of
from m2pem.verify.report.findings import DescribedViolation, Findings

VERSION = 1


def as_data(findings: Findings) -> dict[str, Any]:
    coverage = findings.coverage
    return {
        "version": VERSION,
        "mission": findings.mission.file,
        "sha256": sha256(findings.mission.source).hexdigest(),
        "process": findings.net.process,
        "data": dict(findings.given),
        "verdict": findings.verdict.value,
        "strict": findings.strict,
        "assumed": str(findings.assumed),
        "together": [*findings.together],
        "engine": coverage.engine,
        "coverage": {
            "states": coverage.states,
            "transitions": coverage.transitions,
            "seconds": round(coverage.seconds, 6),
            "stopped": coverage.stopped or None,
            "notes": [*coverage.notes],
        },
        "properties": [
            {
                "property": answer.property,
                "says": answer.text,
                "verdict": answer.verdict.value,
                "warning": answer.warning,
                "note": answer.covered,
                "required": answer.required,
                "author": answer.author,
                "assumed": str(answer.assumed),
                "condition": condition_of(findings, answer),
                "without": _without(findings, answer),
                "would_hold_if": str(answer.would_hold_if),
                "would_hold_if_fair": answer.would_hold_if_fair,
            }
            for answer in findings.results
        ],
        "violations": [_violation(each) for each in findings.violations],
        "unreached": sorted(findings.unreached),
        "approximations": [
            {"element": each.element, "exactness": each.exactness.value, "what": each.what}
            for each in findings.net.approximations
        ],
    }


def _without(findings: Findings, answer: Result) -> dict[str, Any] | None:
    """The answer where nothing is assumed."""
    if answer.without is None:
        return None
    violation = findings.violation_without(answer)
    return {
        "verdict": answer.without.verdict.value,
        "note": answer.without.covered,
        "violation": _violation(violation) if violation is not None else None,
    }


def _violation(violation: DescribedViolation) -> dict[str, Any]:
    return {
        "property": violation.answer.property,
        "warning": violation.answer.warning,
        "required": violation.answer.required,
        "text": violation.found.message,
        "doubt": violation.found.doubt,
        "elements": [*violation.found.elements],
        "missing": [*violation.missing],
        "steps": [each.as_data() for each in violation.run_steps],
        "loop": [each.as_data() for each in violation.loop],
        "tokens": [each.as_data() for each in violation.tokens],
    }
