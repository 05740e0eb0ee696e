"""What is known while a file is being read: elements so far, and references to resolve."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from lxml import etree

from m2pem.bpmn.extensions import looks_like_own, unknown_own_attribute
from m2pem.bpmn.file_findings import FileFindings, Where
from m2pem.bpmn.foreign_syntax import expression_remedy, value_remedy
from m2pem.bpmn.rules.attributes import BAD_EXPRESSION, BAD_VALUE, unknown_attribute
from m2pem.bpmn.rules.definitions import DUPLICATE_ID, MISSING_ID
from m2pem.bpmn.rules.extensions import MISPLACED_EXTENSION, UNKNOWN_EXTENSION, WRONG_NAMESPACE
from m2pem.bpmn.schema import Shape
from m2pem.bpmn.xml import BPMN, M2PEM, a, attribute_names, kind, local
from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.behavior import Mappings
from m2pem.mission.elements import (
    Activity,
    BoundaryEvent,
    CallActivity,
    Container,
    DataObject,
    Event,
    FlowNode,
    Process,
    ReceiveTask,
    SendTask,
    SequenceFlow,
    UserTask,
)
from m2pem.mission.events import Error, Escalation, Message, MessageEventDefinition, Signal
from m2pem.mission.expression import Expression, parse, template
from m2pem.mission.geometry import Geometry
from m2pem.mission.mission import Lane, MessageFlow, Participant

KEY = re.compile(r"[^\W\d]\w*(?:\.\w+)*")
"""A dotted name of the data store."""

MARK = re.compile(r"[$#]\{")
"""Where an expression in `${...}` begins, as a whole text or as a part of one."""

_TRUTH = {"true": True, "1": True, "false": False, "0": False}


@dataclass(slots=True)
class FlowEnds:
    """A sequence flow and the ids that it joins, not yet looked up."""

    flow: SequenceFlow
    source_ref: str
    target_ref: str
    container: Container


@dataclass(slots=True)
class DataEnd:
    """One end of a data association. `carriers` may have extension elements."""

    key: str
    carriers: list[etree._Element]
    declared: DataObject | None = None
    refers_to: str = ""


@dataclass(slots=True)
class Association:
    """A data association of an activity, by ids."""

    element: etree._Element
    source_refs: list[str]
    target_ref: str
    simple: bool


@dataclass(slots=True)
class PendingPrompt:
    """A user task whose prompt waits until all data objects are known."""

    task: UserTask
    element: etree._Element
    extensions: dict[str, list[etree._Element]]
    documentation: str
    inputs: list[Association]


@dataclass(slots=True)
class PendingCall:
    """A call activity whose data associations wait until all data objects are known."""

    call: CallActivity
    element: etree._Element
    parameters: dict[str, str]
    """Keys of its own data inputs and outputs, by id."""
    inputs: list[Association]
    outputs: list[Association]


@dataclass(slots=True)
class PendingDataFlow:
    """An activity or event whose data associations wait until all data objects are known."""

    node: Activity | Event
    parameters: dict[str, str]
    """Keys of its own data inputs, data outputs and properties, by id."""
    inputs: list[Association]
    outputs: list[Association]
    foreign: Mappings | None = None
    """What other engines' elements pass."""

    def own_key(self, identifier: str) -> str:
        """The key of a data input, data output or property of its own; "" for others."""
        return self.parameters.get(identifier, "")


@dataclass(slots=True)
class PendingLoop:
    """A multi-instance activity whose collections wait until all data objects are known."""

    node: Activity
    element: etree._Element
    collection_ref: str
    output_ref: str


@dataclass(slots=True)
class MessageUse:
    """An event or task that sends or receives a message, which message flows may have to name."""

    holder: MessageEventDefinition | SendTask | ReceiveTask
    node_id: str
    name: str
    line: int
    catches: bool
    message: Message | None


@dataclass(frozen=True, slots=True)
class Drawn:
    """An association between two elements, by ids (BPMN 2.0.2, clause 8.4.1)."""

    source_ref: str
    target_ref: str
    direction: str


@dataclass(slots=True)
class ReadingContext:
    """The state of reading one file."""

    findings: FileFindings
    expression_language: str | None = None
    ids: dict[str, int] = field(default_factory=dict)
    made_up: dict[str, int] = field(default_factory=dict)
    """How many ids were made up for elements without one, by how they begin."""
    event_definitions: dict[str, etree._Element] = field(default_factory=dict)
    global_tasks: dict[str, etree._Element] = field(default_factory=dict)
    signals: dict[str, Signal] = field(default_factory=dict)
    messages: dict[str, Message] = field(default_factory=dict)
    errors: dict[str, Error] = field(default_factory=dict)
    escalations: dict[str, Escalation] = field(default_factory=dict)
    declared_roots: set[str] = field(default_factory=set)
    """Ids of signals, messages, errors and escalations that the file, or an import, declares."""
    correlation_properties: dict[str, etree._Element] = field(default_factory=dict)
    subscriptions: list[tuple[Process, etree._Element]] = field(default_factory=list)
    participants: list[Participant] = field(default_factory=list)
    message_flows: list[tuple[MessageFlow, str]] = field(default_factory=list)
    lanes: list[Lane] = field(default_factory=list)
    processes: list[Process] = field(default_factory=list)
    geometries: dict[str, Geometry] = field(default_factory=dict)
    """Those that the file has itself, by name."""
    nodes: list[FlowNode] = field(default_factory=list)
    containers: list[Container] = field(default_factory=list)
    """The container of each of `nodes`, in the same order."""
    flows: list[FlowEnds] = field(default_factory=list)
    defaults: list[tuple[FlowNode, str, int]] = field(default_factory=list)
    attachments: list[tuple[BoundaryEvent, str]] = field(default_factory=list)
    data: dict[str, DataEnd] = field(default_factory=dict)
    declared: list[tuple[Container, DataObject]] = field(default_factory=list)
    prompts: list[PendingPrompt] = field(default_factory=list)
    calls: list[PendingCall] = field(default_factory=list)
    data_flows: list[PendingDataFlow] = field(default_factory=list)
    loops: list[PendingLoop] = field(default_factory=list)
    data_stores: set[str] = field(default_factory=set)
    """Ids of data stores, and of references to them."""
    written: list[Association] = field(default_factory=list)
    """Data output associations of all activities and events."""
    written_keys: set[str] = field(default_factory=set)
    message_uses: list[MessageUse] = field(default_factory=list)
    self_starting: set[FlowNode] = field(default_factory=set)
    """Refused nodes that need no incoming flow (event subprocesses, link targets, ...)."""
    compensation_handlers: set[FlowNode] = field(default_factory=set)
    """Activities that are marked `isForCompensation`."""
    associations: list[Drawn] = field(default_factory=list)
    broken: set[Container] = field(default_factory=set)
    """Containers with an error in their graph; further checks of it would mislead."""

    @property
    def roots(self) -> tuple[dict[str, Any], ...]:
        """The signals, messages, errors and escalations, by id."""
        return self.signals, self.messages, self.errors, self.escalations

    def claim(self, element: etree._Element) -> str:
        """Return the element's id, and report one that is taken. An element without one gets one.

        Where nothing refers to an element, its id may be left out (BPMN 2.0.2, table 8.5).
        """
        identifier = element.get("id") or self._make_up(element)
        first = self.ids.get(identifier)
        if first is None:
            self.ids[identifier] = self.findings.line(element)
        else:
            self.findings.error(
                element,
                identifier,
                DUPLICATE_ID,
                f"the id '{identifier}' is already that of the element on line {first}",
            )
        return identifier

    def _make_up(self, element: etree._Element) -> str:
        """Make up an id that no valid file has: `~` is not allowed in one."""
        what = local(element.tag)
        flow = what == "sequenceFlow"
        ends = (element.get("sourceRef", ""), element.get("targetRef", ""))
        base = "~".join(ends) if flow else f"{what}~"
        number = self.made_up[base] = self.made_up.get(base, 0) + 1
        identifier = f"{base}{'' if flow and number == 1 else number}"
        if not flow:
            name = element.get("name")
            self.findings.warning(
                element,
                identifier,
                MISSING_ID,
                f"{a(kind(element.tag))} has no id{f' (its name is {name!r})' if name else ''}; it "
                f"is called '{identifier}'",
            )
        return identifier

    def head(self, element: etree._Element, identifier: str) -> tuple[str, str, int]:
        """Id, name and line: what each element of the model begins with."""
        return identifier, element.get("name", ""), self.findings.line(element)

    def optional_id(self, element: etree._Element) -> str:
        """The id of an element that can do without one."""
        return self.claim(element) if element.get("id") else ""

    def check_attributes(self, element: etree._Element, shape: Shape, identifier: str) -> None:
        """Warn of attributes that neither BPMN nor m2pem defines for the element."""
        keys = attribute_names(element)
        if shape.attributes.issuperset(keys):
            return
        for key in keys:
            if key in shape.attributes:
                continue
            if key[0] != "{":
                rule, message, remedy = unknown_attribute(element, key, shape.attributes)
                self.findings.warning(element, identifier, rule, message, remedy)
            elif key.startswith(M2PEM):
                self._own_attribute(element, identifier, local(key))
            elif looks_like_own("", namespace := key[1:].partition("}")[0]):
                self.findings.error(
                    element,
                    identifier,
                    WRONG_NAMESPACE,
                    f"'{local(key)}' is of the namespace '{namespace}', which is not m2pem's",
                    f"did you mean '{M2PEM[1:-1]}'?",
                )

    def _own_attribute(self, element: etree._Element, identifier: str, name: str) -> None:
        wrong = unknown_own_attribute(element.tag, name)
        if wrong is None:
            return
        known, message, remedy = wrong
        if known:
            self.findings.warning(element, identifier, MISPLACED_EXTENSION, message, remedy)
        else:
            self.findings.error(element, identifier, UNKNOWN_EXTENSION, message, remedy)

    def note_outputs(self, elements: list[etree._Element]) -> list[Association]:
        """Keep data output associations: they say what the element writes."""
        found = [association(each) for each in elements]
        self.written += found
        return found

    def data_key(self, identifier: str) -> str:
        """The key of a data object, property, data store or reference to one; "" for others."""
        end = self.data.get(identifier)
        if end is None:
            return ""
        target = self.data.get(end.refers_to, end)
        return target.declared.key if target.declared is not None else target.key

    def boolean(self, element: etree._Element, name: str, default: bool, identifier: str) -> bool:
        """An attribute of XML Schema's type boolean."""
        text = element.get(name)
        if text is None:
            return default
        value = _TRUTH.get(text.strip())
        if value is None:
            self.findings.error(
                element,
                identifier,
                BAD_VALUE,
                f"{name}='{text}' is neither true nor false",
                f'write {name}="true" or {name}="false"',
            )
            return default
        return value

    def expression(
        self, where: Where, identifier: str, text: str, language: str | None = None
    ) -> Expression | None:
        """Parse an expression of any dialect; report a syntax error, and return None."""
        try:
            return self._parse(text, language)
        except ExpressionSyntaxError as error:
            self._bad_expression(where, identifier, error)
            return None

    def expression_in(self, element: etree._Element, identifier: str) -> Expression | None:
        """Parse the text of an element, in the language that it names."""
        return self.expression(element, identifier, text_of(element), element.get("language"))

    def first_expression(
        self, elements: Iterable[etree._Element], identifier: str
    ) -> Expression | None:
        """Parse the first of the elements that has a text; None: there is none, or it is wrong."""
        written = next((each for each in elements if text_of(each)), None)
        return None if written is None else self.expression_in(written, identifier)

    def own_expression(
        self, element: etree._Element, identifier: str, attribute: str, foreign: tuple[str, str]
    ) -> Expression | None:
        """Parse an attribute of m2pem's, else of another engine's extension element.

        `foreign`: the tag of that, and the name of the attribute there.
        """
        text, where = element.get(M2PEM + attribute, ""), element
        tag, name = foreign
        for extensions in element.iterchildren(BPMN + "extensionElements"):
            for where in extensions.iterchildren(tag):
                text = text or where.get(name, "")
        return self.expression(where, identifier, text) if text.strip() else None

    def _parse(self, text: str, language: str | None) -> Expression:
        """Parse by the language given; by the bare dialect what only a file's default misnames.

        Editors write a default (XPath, which is BPMN's, or FEEL) over conditions in no language.
        """
        try:
            return parse(text, language or self.expression_language)
        except ExpressionSyntaxError as error:
            if language is not None and "xpath" not in language.lower():
                raise
            try:
                return parse(text)
            except ExpressionSyntaxError:
                raise error from None

    def template(self, where: Where, identifier: str, text: str) -> Expression | None:
        """Parse a text with or without `${...}`; report a syntax error, and return None."""
        try:
            return template(text)
        except ExpressionSyntaxError as error:
            self._bad_expression(where, identifier, error)
            return None

    def value(
        self, where: Where, identifier: str, text: str, language: str | None = None
    ) -> Expression | None:
        """Parse a value: an expression, or a text with `${...}` parts."""
        try:
            if MARK.search(text) and not text.lstrip().startswith("="):
                return template(text)
            return self._parse(text, language)
        except ExpressionSyntaxError as error:
            self._bad_expression(where, identifier, error, value_remedy(text))
            return None

    def _bad_expression(
        self, where: Where, identifier: str, error: ExpressionSyntaxError, remedy: str = ""
    ) -> None:
        self.findings.error(
            where,
            identifier,
            BAD_EXPRESSION,
            f"not an expression: {error}",
            remedy or expression_remedy(error.text),
        )


def association(element: etree._Element) -> Association:
    """A data input or output association."""
    sources: list[str] = []
    target = ""
    simple = True
    for child in element:
        name = local(child.tag)
        if name == "sourceRef":
            sources.append(reference(text_of(child)))
        elif name == "targetRef":
            target = reference(text_of(child))
        elif name in ("assignment", "transformation"):
            simple = False
    return Association(element, sources, target, simple and len(sources) <= 1)


def text_of(element: etree._Element) -> str:
    """Return all text inside an element, without the space around it."""
    if not len(element):
        return (element.text or "").strip()
    return "".join(map(str, element.itertext())).strip()


def reference(text: str) -> str:
    """The id that a reference (a QName in BPMN's schema) names, without its prefix."""
    return text.strip().rpartition(":")[2]
