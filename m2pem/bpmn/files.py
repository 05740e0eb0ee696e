"""The files of a mission: opened, searched for what call activities name, and merged.

Called processes and global tasks (BPMN 2.0.2, clause 10.3.6) are looked for in the calling file, in
the files that it imports, in the mission's own file, and on the search path, in this order. A
prefix whose namespace is another file's leaves the calling file to the last.

The ids of other files' elements get the file's name in front (`survey:Start`; no XML id has a
colon), and only the processes that are called take part. Signals, messages and correlation
properties with one id are one, whatever files they are in.
"""

import re
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from typing import TypeVar

from lxml import etree

from m2pem.bpmn.activities import read_global_task
from m2pem.bpmn.context import PendingCall, ReadingContext
from m2pem.bpmn.data_names import remaining_names
from m2pem.bpmn.definitions import read_roots
from m2pem.bpmn.file_findings import FileFindings
from m2pem.bpmn.rules.activities import AMBIGUOUS_CALL, NO_CALLED_ELEMENT
from m2pem.bpmn.rules.files import IMPORT_UNREADABLE, NOT_BPMN, NOT_EXECUTED, UNUSABLE_FILE
from m2pem.bpmn.rules.references import DANGLING_REFERENCE
from m2pem.bpmn.subprocesses import read_process
from m2pem.bpmn.template_properties import read_template_properties
from m2pem.bpmn.xml import BPMN, Document, XmlError, call_by_role, local, parse_xml
from m2pem.errors import MissionError
from m2pem.findings import Finding
from m2pem.mission.elements import (
    CallActivity,
    Container,
    Element,
    FlowNode,
    Process,
    SequenceFlow,
    SubProcess,
)
from m2pem.mission.events import CorrelationProperty, Message, Signal
from m2pem.mission.library import Library, LibraryError, Question, Source
from m2pem.mission.mission import Mission
from m2pem.suggestions import suggest_or

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
    context: ReadingContext
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
        """The targetNamespace of the file."""
        return str(self.document.root.get("targetNamespace", ""))

    def read_roots(self) -> None:
        """Read the root elements but for the processes."""
        context = self.context
        self._drawn = read_roots(context, self.document.root)
        self._drawn_ids = frozenset(element.get("id") for element in self._drawn)
        for table in context.roots:
            for root in table.values():
                object.__setattr__(root, "file", self.name)

    def has(self, identifier: str) -> bool:
        """Whether a call activity can call that here: a process, or a global task."""
        return identifier in self._drawn_ids or identifier in self.context.global_tasks

    def read(self) -> tuple[Process, ...]:
        """Read the content of the processes, once; return the processes."""
        if not self.is_read:
            self.is_read = True
            for element in self._drawn:
                read_process(self.context, element)
            for process in reversed(self.context.processes):
                self._processes[process.id] = process
            self._sort_calls()
        return tuple(self.context.processes)

    def process(self, identifier: str) -> Process:
        """Return the process, or that of the global task, which `has` found."""
        self.read()
        found = self._processes.get(identifier)
        if found is None:
            element = self.context.global_tasks[identifier]
            found = self._processes[identifier] = read_global_task(self.context, element)
        return found

    def calls(self, process: Process) -> list[PendingCall]:
        """The call activities in a process, at any depth."""
        return self._calls.get(process, [])

    def _sort_calls(self) -> None:
        context = self.context
        of: dict[Container, Process] = {process: process for process in context.processes}
        called: dict[CallActivity, Process] = {}
        for node, container in zip(context.nodes, context.containers, strict=True):
            if isinstance(node, SubProcess):
                of[node] = of[container]
            elif isinstance(node, CallActivity):
                called[node] = of[container]
        for pending in context.calls:
            self._calls.setdefault(called[pending.call], []).append(pending)


def open_part(data: bytes, name: str, qualifier: str = "") -> Part:
    """Parse the XML of a file; nothing is read of it yet.

    Raises:
        MissionError: it is no BPMN 2.0.
    """
    try:
        document = parse_xml(data)
    except XmlError as error:
        finding = error.rule.finding(name, error.line, "", error.message, error.remedy)
        raise MissionError(f"{name}: no BPMN 2.0 file", [finding]) from None
    findings = FileFindings(name, document.line, qualifier)
    if document.root.tag != BPMN + "definitions":
        _not_bpmn(findings, document)
        raise MissionError(f"{name}: no BPMN 2.0 file", findings.all)
    call_by_role(document.root)
    document = read_template_properties(document, findings)
    findings.line = document.line
    return Part(name, data, document, ReadingContext(findings), qualifier)


def _not_bpmn(findings: FileFindings, document: Document) -> None:
    tag = document.root.tag
    namespace = tag.rpartition("}")[0].removeprefix("{") or "none"
    findings.error(
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
        """The files that came from the library."""
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
                _share_roots(part.context, imported.context)

    def _import(self, part: Part, element: etree._Element) -> None:
        location = element.get("location", "").strip()
        if self.library is None or not location:
            return
        try:
            source = self.library.imported(location, part.name)
        except LibraryError as error:
            part.context.findings.warning(
                element, "", IMPORT_UNREADABLE, f"nothing is imported: {error}", error.remedy
            )
            return
        imported = self._take(source, ("import", location, part.name))
        if imported is not None:
            part.imports.append(imported)
            part.import_namespaces.append(element.get("namespace", "").strip())


def _share_roots(importing: ReadingContext, imported: ReadingContext) -> None:
    """Signals, messages, errors and escalations may be referred to where they are imported."""
    for own, others in zip(importing.roots, imported.roots, strict=True):
        for identifier, root in others.items():
            own.setdefault(identifier, root)
    importing.declared_roots |= imported.declared_roots


_MAX_LISTED = 10


def find_called(files: Files) -> set[Process]:
    """Link each call activity to its called process; return the processes that take part.

    All of the mission's own file do, and of others those that are called, by whatever way. What
    cannot be found is reported.
    """
    waiting = deque((files.main, process) for process in files.main.read())
    reached = {process for _, process in waiting}
    while waiting:
        part, process = waiting.popleft()
        for pending in part.calls(process):
            target = _target(files, part, pending)
            if target is None:
                continue
            called = target.process(pending.call.called_id)
            object.__setattr__(pending.call, "called", called)
            if called not in reached:
                reached.add(called)
                waiting.append((target, called))
    return reached


def _target(files: Files, part: Part, pending: PendingCall) -> Part | None:
    """The file in which the called element is; None when a finding says why there is none."""
    name = pending.call.called_id
    rule, remedy = DANGLING_REFERENCE, ""
    if not name:
        rule, message = NO_CALLED_ELEMENT, "the call activity does not say what it calls"
    elif name.startswith("=") or "{" in name:
        rule = NOT_EXECUTED
        message = "m2pem does not execute a calledElement that is an expression"
        remedy = (
            "write the process's id, so that it can be checked before anything moves; to choose "
            "between several, use a gateway and a call activity for each"
        )
    else:
        try:
            found = _look(files, part, name, _namespace(part, pending))
        except LibraryError as error:
            rule, message, remedy = AMBIGUOUS_CALL, error.message, error.remedy
        else:
            if found is not None:
                return found
            message = f"calledElement names '{name}', which is no process or global task of "
            places = files.library.places if files.library is not None else ()
            message += "this file" + (
                f", nor of a BPMN file in {', '.join(places)}" if places else ""
            )
    remedy = remedy or _existing(files, part, name)
    part.context.findings.error(pending.call.line, pending.call.id, rule, message, remedy)
    return None


def _existing(files: Files, part: Part, name: str) -> str:
    known = [process.id for process in part.read()] + list(part.context.global_tasks)
    listed = ", ".join(f"'{each}'" for each in dict.fromkeys(known[:_MAX_LISTED]))
    remedy = f"name a process of this file: {listed}"
    if files.library is not None:
        remedy += "; or name the folder of its file with --path"
    return suggest_or(name, known, remedy) if name else remedy


def _namespace(part: Part, pending: PendingCall) -> str:
    """The namespace that the name's prefix is bound to, if it is another file's; else ""."""
    prefix, colon, _ = pending.element.get("calledElement", "").strip().rpartition(":")
    namespace = pending.element.nsmap.get(prefix, "") if colon else ""
    return "" if namespace in (part.namespace, BPMN[1:-1]) else str(namespace)


def _look(files: Files, part: Part, name: str, namespace: str) -> Part | None:
    if not namespace and part.has(name):
        return part
    imports = zip(part.imports, part.import_namespaces, strict=True)
    imported = {
        each: None
        for each, declared in imports
        if each.has(name) and namespace in ("", declared, each.namespace)
    }
    if len(imported) > 1:
        raise LibraryError(
            f"'{name}' is in several imported files: {', '.join(each.name for each in imported)}",
            "import one of them, or write the prefix of its namespace",
        )
    for each in imported:
        return each
    main = files.main
    if main.has(name) and namespace in ("", main.namespace):
        return main
    found = files.called(name, namespace)
    if found is not None and found.has(name):
        return found
    return part if part.has(name) else None  # editors write prefixes that mean nothing


T = TypeVar("T")
Operated = TypeVar("Operated", Signal, Message)

_set = object.__setattr__


def merge(files: Files, reached: set[Process]) -> Mission:
    """The mission that files without an error make; `reached`: the processes that take part."""
    parts = [part for part in files.parts if part.is_read]
    for part in files.parts[1:]:
        _qualify(part)
    inside = _inside(reached, parts)
    nodes = [node for part in parts for node in part.context.nodes if node.container in inside]
    flows = [ends.flow for part in parts for ends in part.context.flows if ends.container in inside]
    processes = [p for part in parts for p in part.context.processes if p in reached]
    for index, node in enumerate(nodes):
        if node.index != index:
            _set(node, "index", index)
        if isinstance(node, CallActivity):
            _set(node, "called_id", node.called.id)
    for index, flow in enumerate(flows):
        if flow.index != index:
            _set(flow, "index", index)
    contexts = [part.context for part in parts]
    main = files.main.context
    return Mission(
        file=files.main.name,
        source=files.main.data,
        processes=tuple(processes),
        nodes=tuple(nodes),
        flows=tuple(flows),
        signals=_operated([context.signals for context in contexts]),
        messages=_operated([context.messages for context in contexts]),
        errors=_first([context.errors for context in contexts]),
        escalations=_first([context.escalations for context in contexts]),
        participants=tuple(main.participants),
        message_flows=tuple(flow for flow, _ in main.message_flows),
        lanes=tuple(main.lanes),
        warnings=tuple(each for part in files.parts for each in part.context.findings.sorted()),
        elements=_elements(nodes, flows, processes),
        associated=frozenset().union(*(context.written_keys for context in contexts)),
        remaining_names=remaining_names(nodes),
        data_stores=frozenset(
            context.data_key(store) for context in contexts for store in context.data_stores
        ),
        correlation_properties=_correlation(parts),
        geometries=_first([context.geometries for context in contexts]),
        library=files.sources(),
    )


def _inside(reached: set[Process], parts: list[Part]) -> set[Container]:
    """Return these processes, and the subprocesses in them."""
    inner = [each for part in parts for each in part.context.nodes if isinstance(each, SubProcess)]
    return {*reached, *(each for each in inner if each.process in reached)}


def _qualify(part: Part) -> None:
    """Put the file's name in front of ids, also of root elements made up for one event or task."""
    context = part.context
    elements: list[Element] = [*context.processes, *context.nodes]
    elements += [ends.flow for ends in context.flows]
    for element in elements:
        _set(element, "qualifier", part.qualifier)
        _set(element, "id", f"{part.qualifier}:{element.id}")
    for process in context.processes:
        _set(process, "file", part.name)
    for table in context.roots:
        for identifier, root in list(table.items()):
            if not root.file:
                _set(root, "file", part.name)
            if identifier not in context.declared_roots:
                _set(root, "id", f"{part.qualifier}:{identifier}")
                table[root.id] = table.pop(identifier)


def _elements(
    nodes: list[FlowNode], flows: list[SequenceFlow], processes: list[Process]
) -> dict[str, Element]:
    """By id. A global task's process has the id of the task, which is the one to be found."""
    drawn = [process for process in processes if not process.global_task]
    everything: list[Element] = [*flows, *nodes, *drawn]
    return {element.id: element for element in everything}


def _first(tables: list[dict[str, T]]) -> dict[str, T]:
    found: dict[str, T] = {}
    for table in tables:
        for identifier, root in table.items():
            found.setdefault(identifier, root)
    return found


def _operated(tables: list[dict[str, Operated]]) -> Mapping[str, Operated]:
    """Operators send what any file says they send."""
    found = _first(tables)
    for table in tables:
        for identifier, root in table.items():
            first = found[identifier]
            if root.from_operator and not first.from_operator:
                found[identifier] = replace(first, from_operator=True)
                _set(found[identifier], "file", first.file)
    return found


def _correlation(parts: list[Part]) -> tuple[CorrelationProperty, ...]:
    found: dict[str, CorrelationProperty] = {}
    for part in parts:
        for each in part.correlation:
            known = found.setdefault(each.id, each)
            found[each.id] = replace(known, retrieve={**each.retrieve, **known.retrieve})
    return tuple(found.values())
