"""What findings look like as JSON."""

from collections.abc import Iterable

from pydantic import BaseModel

from m2pem.api import Finding, Severity


class FindingModel(BaseModel):
    """What is wrong, or doubtful: where, and what would be right. `line` 0: none applies."""

    severity: Severity
    rule: str
    number: str
    file: str
    line: int
    element: str
    message: str
    remedy: str


def finding_models(findings: Iterable[object]) -> list[FindingModel]:
    """Findings as JSON."""
    return [
        FindingModel(
            severity=each.severity,
            rule=each.rule,
            number=each.number,
            file=each.file,
            line=each.line,
            element=each.element,
            message=each.message,
            remedy=each.remedy,
        )
        for each in findings
        if isinstance(each, Finding)
    ]
