"""The diagram with what a report says marked on it."""

from m2pem.drawing import Marks, draw
from m2pem.verify.report.findings import Findings, Violated, marks_of


def picture(findings: Findings, violation: Violated | None = None, *, about: str = "") -> str:
    """The mission's diagram as SVG: a violation, or (None) what is never reached.

    Raises:
        ValueError: the file has no diagram, and cannot be laid out.
    """
    unreached = findings.unreached
    if violation is None:
        marks = Marks(unreached=unreached)
        title = f"{findings.mission.file}: {findings.verdict.value}"
        return draw(findings.mission.source, marks, title=title, about=about)
    return draw(
        findings.mission.source,
        marks_of(violation, unreached),
        title=f"Violated: {violation.answer.text.rstrip('.')}",
        note=violation.found.message,
        about=about,
    )
