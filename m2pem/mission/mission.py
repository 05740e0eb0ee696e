"""A mission as a whole: what a BPMN file, and those that it calls into, hold, and what names a
version of it: a hash of these files."""

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Self

from m2pem.findings import Finding
from m2pem.mission.behavior import Behavior
from m2pem.mission.elements import Activity, CallActivity, Element, FlowNode, Process, SequenceFlow
from m2pem.mission.events import (
    CorrelationProperty,
    Error,
    Escalation,
    Message,
    RootElement,
    Signal,
)
from m2pem.mission.geometry import Geometry
from m2pem.mission.library import MissionFile, Source

SHORT = 12
"""Digits of a version that people read: no two versions of a mission will have the same."""


@dataclass(frozen=True, slots=True, eq=False)
class Participant(Element):
    """A pool; no effect on execution."""

    process_id: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class MessageFlow(Element):
    """A message flow between pools, by the ids at its ends; kept for display."""

    source_id: str = ""
    target_id: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Lane(Element):
    """A lane; no effect on execution. `node_ids`: what it shows."""

    process_id: str = ""
    node_ids: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Mission:
    """A whole BPMN file with all that it calls, ready to run.

    `file` is its name for findings; `source` its bytes, kept for the journal; `library` the other
    files that it uses. `nodes` and `flows` list all of them, of all containers; `element.index` is
    the place there. `processes` are in the order of the XML, those of other files last: only the
    ones that are called.
    """

    file: str
    source: bytes = field(repr=False)
    processes: tuple[Process, ...]
    nodes: tuple[FlowNode, ...] = field(repr=False)
    flows: tuple[SequenceFlow, ...] = field(repr=False)
    signals: Mapping[str, Signal]
    messages: Mapping[str, Message]
    errors: Mapping[str, Error]
    escalations: Mapping[str, Escalation]
    participants: tuple[Participant, ...] = ()
    message_flows: tuple[MessageFlow, ...] = ()
    lanes: tuple[Lane, ...] = ()
    warnings: tuple[Finding, ...] = ()
    elements: Mapping[str, Element] = field(default_factory=dict, repr=False)
    """Processes, flow nodes and sequence flows by id."""
    associated: frozenset[str] = frozenset()
    """Keys that data output associations name as written; without an effect on execution."""
    remaining_names: frozenset[str] = frozenset()
    """Names that are read of what is left of tasks (`m2pem.mission.remaining`)."""
    data_stores: frozenset[str] = frozenset()
    """Keys of the data stores, which all processes of a run share (clause 10.4.1)."""
    correlation_properties: tuple[CorrelationProperty, ...] = ()
    geometries: Mapping[str, Geometry] = field(default_factory=dict, repr=False)
    """Routes, areas and points that the files have themselves, in place of the fleet's."""
    library: tuple[Source, ...] = field(repr=False, default=())

    def __deepcopy__(self, memo: object) -> Self:
        return self  # it never changes

    def process(self, process_id: str | None = None) -> Process:
        """The process a run begins with: the one named, else the file's main one.

        The main one is the first that no call activity of the file calls, among those with
        `isExecutable="true"`, or among all when none is so marked.

        Raises:
            KeyError: no process has that id.
        """
        own = [process for process in self.processes if not process.global_task]
        if process_id is not None:
            return {process.id: process for process in own}[process_id]
        own = [process for process in own if not process.file]
        called = {
            node.called
            for node in self.nodes
            if isinstance(node, CallActivity) and not node.container.process.file
        }
        candidates = [process for process in own if process.executable] or own
        return next((each for each in candidates if each not in called), candidates[0])

    def file_of(self, element: FlowNode | Process | RootElement) -> str:
        """The name of the file that an element is in, for findings."""
        if isinstance(element, FlowNode):
            element = element.container.process
        return element.file or self.file

    def files(self) -> Iterator[MissionFile]:
        """Its own file, and those that it uses."""
        yield MissionFile(self.file, "", self.source)
        qualifiers = {each.file: each.qualifier for each in self.processes if each.file}
        for each in self.library:
            yield MissionFile(each.name, qualifiers.get(each.name, ""), each.data)

    def activities(self) -> Iterator[Activity]:
        """Every activity, in the order of the XML."""
        return (node for node in self.nodes if isinstance(node, Activity))

    @property
    def chooses_resources(self) -> bool:
        """Whether a behavior gets its resources only when its task starts (docs/allocation.md)."""
        return any(behavior.allocated_at_start for _, behavior in self.commands())

    def commands(self) -> Iterator[tuple[Activity, Behavior]]:
        """Yield the tasks that command a behavior, with it."""
        for task in self.activities():
            behavior: Behavior | None = getattr(task, "behavior", None)
            if behavior is not None:
                yield task, behavior


def version_of_files(mission: bytes, library: Iterable[Source]) -> str:
    """Return the version of a mission's file with the other files that it uses: 64 hexadecimal
    digits. The names of the files are no part of it, but for those by which the mission asks."""
    whole = hashlib.sha256()
    parts = [mission]
    for source in library:
        parts += [repr(source.answers).encode(), source.data]
    for part in parts:
        whole.update(len(part).to_bytes(8))
        whole.update(part)
    return whole.hexdigest()


def version_of(mission: Mission) -> str:
    """Return the version of a mission that was read."""
    return version_of_files(mission.source, mission.library)
