"""The report as data for programs: what an editor needs to step through a run.

The shape is that of docs/verification.schema.json. `version` counts up when something that is
there changes its meaning or goes; what is added needs no new version.
"""

from collections.abc import Sequence
from hashlib import sha256
from typing import Any

from m2pem.verify.report.findings import Findings, Violated
from m2pem.verify.report.run_steps import Token, Told

VERSION = 1


def as_data(findings: Findings) -> dict[str, Any]:
    """The whole report."""
    coverage = findings.coverage
    return {
        "version": VERSION,
        "mission": findings.mission.file,
        "sha256": sha256(findings.mission.source).hexdigest(),
        "process": findings.system.process,
        "data": dict(findings.given),
        "verdict": findings.verdict.value,
        "strict": findings.strict,
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
            }
            for answer in findings.results
        ],
        "violations": [_violation(each) for each in findings.violations],
        "unreached": sorted(findings.unreached),
        "approximations": [
            {"element": each.element, "exactness": each.exactness.value, "what": each.what}
            for each in findings.system.approximations
        ],
    }


def _violation(violation: Violated) -> dict[str, Any]:
    return {
        "property": violation.answer.property,
        "warning": violation.answer.warning,
        "required": violation.answer.required,
        "text": violation.found.message,
        "elements": [*violation.found.elements],
        "missing": [*violation.missing],
        "steps": [_step(told) for told in violation.story],
        "loop": [_step(told) for told in violation.loop],
        "tokens": _tokens(violation.tokens),
    }


def _step(told: Told) -> dict[str, Any]:
    return {
        "step": told.number,
        "text": told.text,
        "element": told.element,
        "passes": [*told.passes],
        "trigger": told.trigger or None,
        "detail": told.detail,
        "actions": [
            {"element": each.element, "action": each.action.value, "detail": each.detail}
            for each in told.actions
        ],
        "tokens": _tokens(told.tokens),
        "data": dict(told.data),
        "writes": dict(told.writes),
        "rules": [*told.rules],
    }


def _tokens(tokens: Sequence[Token]) -> list[dict[str, Any]]:
    return [
        {"element": each.element, "count": each.count, "waits": bool(each.flow)} for each in tokens
    ]
