"""The files of a mission while they are read: its own, those it calls into, those they import."""

import re
from dataclasses import dataclass, field, replace
from pathlib import PurePath

from lxml import etree

from m2pem.bpmn.containers import read_process
from m2pem.bpmn.global_tasks import read_global_task
from m2pem.bpmn.names import BPMN, local
from m2pem.bpmn.reading import PendingCall, Reading
from m2pem.bpmn.report import Report
from m2pem.bpmn.roots import read_roots
from m2pem.bpmn.rules.files import IMPORT_UNREADABLE, NOT_BPMN, UNUSABLE_FILE
from m2pem.bpmn.type_names import call_by_role
from m2pem.bpmn.xml import Document, XmlError, parse_xml
from m2pem.errors import MissionError
from m2pem.findings import Finding
from m2pem.mission.elements import CallActivity, Container, Process, SubProcess
from m2pem.mission.events import CorrelationProperty
from m2pem.mission.library import Library, LibraryError, Question, Source

_SUFFIX = re.compile(r"\.(bpmn20\.xml|bpmn2?|xml)$", re.IGNORECASE)
_MODEL = BPMN[1:-1]


@dataclass(slots=True, eq=False)
class Part:
    """One file of a mission.

    `qualifier`: what the ids of its elements begin with; "" in the mission's own file. `answers`:
    why it is there.
    """

    name: str
    data: bytes
    document: Document
    reading: Reading
    qualifier: str = ""
    answers: list[Question] = field(default_factory=list)
    imports: list["Part"] = field(default_factory=list)
    import_namespaces: list[str] = field(default_factory=list)
    """Of `imports`, in the same order: as the importing file writes them."""
    correlation: tuple[CorrelationProperty, ...] = ()
    is_read: bool = False
    _processes: dict[str, Process] = field(default_factory=dict)
    _drawn: list[etree._Element] = field(default_factory=list)
    _drawn_ids: frozenset[str | None] = frozenset()
    _calls: dict[Process, list[PendingCall]] = field(default_factory=dict)

    @property
    def namespace(self) -> str:
        """Its targetNamespace."""
        return str(self.document.root.get("targetNamespace", ""))

    def read_roots(self) -> None:
        """Read the root elements but for the processes."""
        reading = self.reading
        self._drawn = read_roots(reading, self.document.root)
        self._drawn_ids = frozenset(element.get("id") for element in self._drawn)
        for table in (reading.signals, reading.messages, reading.errors, reading.escalations):
            for root in table.values():
                object.__setattr__(root, "file", self.name)

    def has(self, identifier: str) -> bool:
        """Whether a call activity can call that here: a process, or a global task."""
        return identifier in self._drawn_ids or identifier in self.reading.global_tasks

    def read(self) -> tuple[Process, ...]:
        """Read what is in the processes, once; gives them back."""
        if not self.is_read:
            self.is_read = True
            for element in self._drawn:
                read_process(self.reading, element)
            for process in reversed(self.reading.processes):
                self._processes[process.id] = process
            self._sort_calls()
        return tuple(self.reading.processes)

    def process(self, identifier: str) -> Process:
        """What `has` found."""
        self.read()
        found = self._processes.get(identifier)
        if found is None:
            element = self.reading.global_tasks[identifier]
            found = self._processes[identifier] = read_global_task(self.reading, element)
        return found

    def calls(self, process: Process) -> list[PendingCall]:
        """The call activities in a process, at any depth."""
        return self._calls.get(process, [])

    def _sort_calls(self) -> None:
        reading = self.reading
        of: dict[Container, Process] = {process: process for process in reading.processes}
        called: dict[CallActivity, Process] = {}
        for node, container in zip(reading.nodes, reading.containers, strict=True):
            if isinstance(node, SubProcess):
                of[node] = of[container]
            elif isinstance(node, CallActivity):
                called[node] = of[container]
        for pending in reading.calls:
            self._calls.setdefault(called[pending.call], []).append(pending)


def open_part(data: bytes, name: str, qualifier: str = "") -> Part:
    """Parse a file, no more.

    Raises:
        MissionError: it is no BPMN 2.0.
    """
    try:
        document = parse_xml(data)
    except XmlError as error:
        finding = error.rule.finding(name, error.line, "", error.message, error.remedy)
        raise MissionError(f"{name}: no BPMN 2.0 file", [finding]) from None
    report = Report(name, document.line, qualifier)
    if document.root.tag != BPMN + "definitions":
        _not_bpmn(report, document)
        raise MissionError(f"{name}: no BPMN 2.0 file", report.findings)
    call_by_role(document.root)
    return Part(name, data, document, Reading(report), qualifier)


def _not_bpmn(report: Report, document: Document) -> None:
    tag = document.root.tag
    namespace = tag.rpartition("}")[0].removeprefix("{") or "none"
    report.error(
        document.root,
        document.root.get("id", ""),
        NOT_BPMN,
        f"the file's root is '{local(tag)}' of the namespace {namespace}, not BPMN 2.0's "
        "'definitions'",
        f'export it as BPMN 2.0: xmlns="{_MODEL}"',
    )


class Files:
    """`parts`: all files so far, the mission's own first; their root elements are read.

    `findings`: about files that are no BPMN. The library None: there are no other files.
    """

    def __init__(self, main: Part, library: Library | None) -> None:
        self.library = library
        self.parts: list[Part] = []
        self.findings: list[Finding] = []
        self._by_content: dict[tuple[str, bytes], Part] = {}
        self._add(main)
        self._settle(0)

    @property
    def main(self) -> Part:
        """The mission's own file."""
        return self.parts[0]

    def called(self, element: str, namespace: str) -> Part | None:
        """The file of the library that has a process or global task; None: there is none.

        Raises:
            LibraryError: there are several.
        """
        source = self.library.called(element, namespace) if self.library is not None else None
        if source is None:
            return None
        known = len(self.parts)
        part = self._take(source, ("call", element, namespace))
        self._settle(known)
        return part

    def sources(self) -> tuple[Source, ...]:
        """What the library gave."""
        return tuple(
            Source(part.name, part.data, tuple(dict.fromkeys(part.answers)))
            for part in self.parts
            if part.answers
        )

    def _add(self, part: Part) -> None:
        self.parts.append(part)
        self._by_content[PurePath(part.name).name, part.data] = part

    def _take(self, source: Source, question: Question) -> Part | None:
        """The part of a file: the same one for the same file, by whatever way it was found."""
        part = self._by_content.get((PurePath(source.name).name, source.data))
        if part is None:
            try:
                part = open_part(source.data, source.name, self._qualifier(source.name))
            except MissionError as error:
                self.findings += [
                    replace(each, rule=UNUSABLE_FILE.slug, number=UNUSABLE_FILE.code)
                    for each in error.findings
                ]
                return None
            self._add(part)
        part.answers.append(question)
        return part

    def _qualifier(self, name: str) -> str:
        """The file's name without its suffix; with a number, where another has the same."""
        stem = re.sub(r"[^\w.-]", "_", _SUFFIX.sub("", PurePath(name).name)) or "file"
        taken = {part.qualifier for part in self.parts}
        for element in self.main.document.root.iter():  # though no XML id has a colon
            before, colon, _ = element.get("id", "").partition(":")
            taken |= {before} if colon else set()
        qualifier, number = stem, 1
        while qualifier in taken:
            number += 1
            qualifier = f"{stem}-{number}"
        return qualifier

    def _settle(self, known: int) -> None:
        """Read the root elements of the parts after the first `known`, and of what they import."""
        place = known
        while place < len(self.parts):
            part = self.parts[place]
            place += 1
            part.read_roots()
            for element in part.document.root.iterchildren(BPMN + "import"):
                if element.get("importType", "").strip() == _MODEL:
                    self._import(part, element)
        for part in self.parts[known:]:
            for imported in part.imports:
                _share_roots(part.reading, imported.reading)

    def _import(self, part: Part, element: etree._Element) -> None:
        location = element.get("location", "").strip()
        if self.library is None or not location:
            return
        try:
            source = self.library.imported(location, part.name)
        except LibraryError as error:
            part.reading.report.warning(
                element, "", IMPORT_UNREADABLE, f"nothing is imported: {error}", error.remedy
            )
            return
        imported = self._take(source, ("import", location, part.name))
        if imported is not None:
            part.imports.append(imported)
            part.import_namespaces.append(element.get("namespace", "").strip())


def _share_roots(importing: Reading, imported: Reading) -> None:
    """Signals, messages, errors and escalations may be referred to where they are imported."""
    for identifier, signal in imported.signals.items():
        importing.signals.setdefault(identifier, signal)
    for identifier, message in imported.messages.items():
        importing.messages.setdefault(identifier, message)
    for identifier, error in imported.errors.items():
        importing.errors.setdefault(identifier, error)
    for identifier, escalation in imported.escalations.items():
        importing.escalations.setdefault(identifier, escalation)
    importing.declared_roots |= imported.declared_roots
