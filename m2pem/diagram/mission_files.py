"""Draws a mission that has several files: one diagram for each, with overlays by the mission's ids.

The ids of elements of other files begin with the file's qualifier (`survey:Start`); in the file
itself they do not.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from m2pem.diagram import Overlays, draw
from m2pem.mission.elements import Element
from m2pem.mission.mission import Mission


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


def draw_mission(
    mission: Mission,
    overlays: Overlays | None = None,
    *,
    title: str = "",
    note: str = "",
    about: str = "",
) -> dict[str, str]:
    """SVG of the mission's own diagram, by "", and of the other files that a run passes.

    The keys of the others are the prefixes of their elements' ids. Overlays name elements by the
    mission's ids; a run passes a file if a step or what is wrong is in it. `title`, `note` and
    `about` are as for `m2pem.diagram.draw`.

    Raises:
        ValueError: a file has no diagram, and cannot be laid out.
    """
    marks = overlays or Overlays()
    shown = [each for each in _files(mission) if each.qualifier == "" or _passed(each, marks)]
    return {
        each.qualifier: draw(each.source, each.marks(marks), title=title, note=note, about=about)
        for each in shown
    }


def _passed(file: _File, marks: Overlays) -> bool:
    """Whether a run passes a file, or a violation is in it."""
    shown = (*(each for step in marks.steps for each in step), *marks.stuck)
    return any(file.has(each) for each in shown)


def _files(mission: Mission) -> list[_File]:
    """The mission's own file first, then the others in the order of their processes."""
    sources = {source.name: source.data for source in mission.library}
    found = {"": _File("", mission.source, mission.elements)}
    for process in mission.processes:
        if process.qualifier and process.file in sources:
            qualifier = process.qualifier
            found[qualifier] = _File(qualifier, sources[process.file], mission.elements)
    return list(found.values())
