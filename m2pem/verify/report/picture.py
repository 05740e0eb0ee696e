"""The diagrams of a mission with a report's marks, one for each file that a run passes."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from m2pem.diagram import Overlays, draw
from m2pem.mission.elements import Element
from m2pem.mission.mission import Mission
from m2pem.verify.report.findings import DescribedViolation, Findings, marks_of


@dataclass(frozen=True, slots=True)
class _File:
    """A file of processes. `qualifier`: the prefix of its elements' ids; "" for the mission's own
    file.
    """

    qualifier: str
    source: bytes
    elements: Mapping[str, Element]

    def has(self, element: str) -> bool:
        """Whether an element is in the file; what belongs to no process is in the mission's own."""
        known = self.elements.get(element)
        return (known.qualifier if known is not None else "") == self.qualifier

    def local(self, element: str) -> str:
        """The id of an element in the file."""
        known = self.elements.get(element)
        return known.local_id if known is not None else element

    def some(self, elements: Iterable[str]) -> list[str]:
        """The elements that are in the file, by their ids there."""
        return [self.local(each) for each in elements if self.has(each)]

    def marks(self, marks: Overlays) -> Overlays:
        """The marks in the file. A step keeps its number."""

        def mine(marked: Mapping[str, str]) -> dict[str, str]:
            return {self.local(each): why for each, why in marked.items() if self.has(each)}

        steps: Sequence[Sequence[str]] = [self.some(step) for step in marks.steps]
        return Overlays(
            steps,
            mine(marks.stuck),
            mine(marks.waiting),
            frozenset(self.some(marks.tokens)),
            frozenset(self.some(marks.missing)),
            frozenset(self.some(marks.unreached)),
        )


def pictures(
    findings: Findings, violation: DescribedViolation | None = None, *, about: str = ""
) -> dict[str, str]:
    """SVG of the mission's diagram, by "", and of the other files that a run passes.

    The keys of the others are the prefixes of their elements' ids. A violation is shown, or (None)
    what is never reached.

    Raises:
        ValueError: a file has no diagram, and cannot be laid out.
    """
    files = _files(findings.mission)
    if violation is None:
        title = f"{findings.mission.file}: {findings.verdict.value}"
        marks = Overlays(unreached=findings.unreached)
        return {"": draw(files[""].source, files[""].marks(marks), title=title, about=about)}
    marks = marks_of(violation, findings.unreached)
    title = f"Violated: {violation.answer.text.rstrip('.')}"
    shown = [each for each in files.values() if each.qualifier == "" or _passed(each, marks)]
    return {
        each.qualifier: draw(
            each.source, each.marks(marks), title=title, note=violation.found.message, about=about
        )
        for each in shown
    }


def _passed(file: _File, marks: Overlays) -> bool:
    """Whether a run passes a file, or a violation is in it."""
    shown = (*(each for step in marks.steps for each in step), *marks.stuck)
    return any(file.has(each) for each in shown)


def _files(mission: Mission) -> dict[str, _File]:
    """The mission's own file first, then the others in the order of their processes."""
    sources = {source.name: source.data for source in mission.library}
    found = {"": _File("", mission.source, mission.elements)}
    for process in mission.processes:
        if process.qualifier and process.file in sources:
            qualifier = process.qualifier
            found[qualifier] = _File(qualifier, sources[process.file], mission.elements)
    return found
