"""The diagrams of a mission with a report's marks, one for each file that a run passes."""

from m2pem.diagram import Overlays
from m2pem.diagram.mission_files import draw_mission
from m2pem.verify.report.findings import DescribedViolation, Findings, marks_of


def pictures(
    findings: Findings, violation: DescribedViolation | None = None, *, about: str = ""
) -> dict[str, str]:
    """SVG of the mission's diagram, by "", and of the other files that a run passes.

    The keys of the others are the prefixes of their elements' ids. A violation is shown, or (None)
    what is never reached.

    Raises:
        ValueError: a file has no diagram, and cannot be laid out.
    """
    if violation is None:
        marks = Overlays(unreached=findings.unreached)
        title = f"{findings.mission.file}: {findings.verdict.value}"
        return draw_mission(findings.mission, marks, title=title, about=about)
    return draw_mission(
        findings.mission,
        marks_of(violation, findings.unreached),
        title=f"Violated: {violation.answer.text.rstrip('.')}",
        note=violation.found.message,
        about=about,
    )
