"""One file's XML tree with what the rules look up in it: ids, flows by their ends, containers.

Everything is indexed at most once, and only when a rule asks for it: most files need little.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

from lxml import etree

from m2pem.bpmn.file_findings import FileFindings
from m2pem.bpmn.rules.rule import Rule
from m2pem.bpmn.xml import BPMN, local
from m2pem.findings import Severity

_NOTHING = " "
"""What no reference names."""

Flows = Mapping[str, list[etree._Element]]


def names(text: str) -> frozenset[str]:
    """The tags of BPMN elements by their local names, in one text."""
    return frozenset(BPMN + name for name in text.split())


SUBPROCESSES = names("subProcess transaction adHocSubProcess")
CONTAINERS = SUBPROCESSES | names("process")
TASKS = names(
    "task userTask manualTask scriptTask serviceTask sendTask receiveTask businessRuleTask"
)
ACTIVITIES = TASKS | SUBPROCESSES | names("callActivity")
GATEWAYS = names(
    "exclusiveGateway inclusiveGateway parallelGateway complexGateway eventBasedGateway"
)
CATCHING = names("startEvent intermediateCatchEvent boundaryEvent")
THROWING = names("endEvent intermediateThrowEvent")
EVENTS = CATCHING | THROWING
NODES = ACTIVITIES | GATEWAYS | EVENTS

_OUTER = CONTAINERS | names(
    "definitions collaboration choreography globalConversation laneSet childLaneSet "
    "subConversation category"
)
_PARTS = names(
    "standardLoopCharacteristics multiInstanceLoopCharacteristics ioSpecification ioBinding "
    "dataInputAssociation dataOutputAssociation resourceRole performer humanPerformer "
    "potentialOwner correlationSubscription"
)
_NAMED_BY_READERS = NODES | names("sequenceFlow process")
_TRUE = frozenset({"true", "1"})


def named(text: str) -> str:
    """The id that a reference names, without the prefix of its namespace."""
    return text.strip().rpartition(":")[2]


def _by_reference(elements: Iterable[etree._Element], *attributes: str) -> Flows:
    found: dict[str, list[etree._Element]] = {}
    for element in elements:
        for attribute in attributes:
            found.setdefault(named(element.get(attribute, "")), []).append(element)
    return found


class Tree:
    """The tree, and the findings about it."""

    def __init__(self, root: etree._Element, findings: FileFindings, source: bytes) -> None:
        self.root = root
        self._findings = findings
        self._source = source
        self._target = root.get("targetNamespace", "")
        self._owners: dict[str, set[etree._Element]] = {}

    # --- what is there --------------------------------------------------------------------------

    def mentions(self, name: str) -> bool:
        """Whether the file may have the name: this saves the search for rare attributes."""
        return name.encode() in self._source or b"\0" in self._source[:100]  # UTF-16, UTF-32

    def has_one_before(self, element: etree._Element) -> bool:
        """Whether it is not the first of its tag in its parent; elements come in their order."""
        owners = self._owners.setdefault(element.tag, set())
        owner = parent(element)
        if owner in owners:
            return True
        owners.add(owner)
        return False

    @cached_property
    def ids(self) -> dict[str, etree._Element]:
        """BPMN elements by id; of those that share one, the first."""
        found: dict[str, etree._Element] = {}
        for element in self.root.iter(BPMN + "*"):
            identifier = element.get("id")
            if identifier:
                found.setdefault(identifier, element)
        return found

    @cached_property
    def flows(self) -> list[etree._Element]:
        """All sequence flows."""
        return list(self.root.iter(BPMN + "sequenceFlow"))

    @cached_property
    def _into(self) -> Flows:
        return _by_reference(self.flows, "targetRef")

    @cached_property
    def _out(self) -> Flows:
        return _by_reference(self.flows, "sourceRef")

    def into(self, element: etree._Element) -> list[etree._Element]:
        """The sequence flows that name the element as their target."""
        return self._into.get(element.get("id") or _NOTHING, [])

    def out(self, element: etree._Element) -> list[etree._Element]:
        """The sequence flows that name the element as their source."""
        return self._out.get(element.get("id") or _NOTHING, [])

    @cached_property
    def boundary(self) -> Flows:
        """Boundary events by the id of what they are attached to."""
        return _by_reference(self.root.iter(BPMN + "boundaryEvent"), "attachedToRef")

    @cached_property
    def associations(self) -> Flows:
        """Associations by the id of either end."""
        return _by_reference(self.root.iter(BPMN + "association"), "sourceRef", "targetRef")

    # --- references -----------------------------------------------------------------------------

    def find(self, owner: etree._Element, text: str) -> etree._Element | None:
        """Return the element of this file that a reference names."""
        text = text.strip()
        found = self.ids.get(text)
        if found is None and ":" in text and not self._foreign(owner, text):
            found = self.ids.get(text.rpartition(":")[2])
        return found

    def leads_nowhere(self, owner: etree._Element, text: str, tags: frozenset[str]) -> bool:
        """Whether a reference that is no expression names nothing with these tags.

        What a prefix of another namespace names is in another file, and is not looked for.
        """
        text = text.strip()
        if "{" in text or text.startswith("="):
            return False
        found = self.find(owner, text)
        if found is None:
            return not self._foreign(owner, text)
        return found.tag not in tags

    def _foreign(self, owner: etree._Element, text: str) -> bool:
        prefix, colon, _ = text.partition(":")
        if not colon:
            return False
        namespace = owner.nsmap.get(prefix)
        return namespace is not None and namespace != self._target

    # --- findings -------------------------------------------------------------------------------

    @cached_property
    def _found(self) -> dict[tuple[int, str], set[str]]:
        """The slugs of the readers' findings by line and element, and by line alone."""
        found: dict[tuple[int, str], set[str]] = {}
        for finding in self._findings.all:
            for name in (finding.element, ""):
                found.setdefault((finding.line, name), set()).add(finding.rule)
        return found

    def report(
        self,
        rule: Rule,
        element: etree._Element,
        detail: str = "",
        right: str = "",
        unless: tuple[Rule, ...] = (),
    ) -> None:
        """Report that the rule is broken at an element.

        Nothing is reported where a reader has reported the rule, or one of `unless`, which say the
        same.
        """
        line, identifier = self._findings.line(element), finding_id(element)
        found = self._found.get((line, identifier))
        if found is not None and any(each.slug in found for each in (rule, *unless)):
            return
        add = self._findings.error if rule.severity is Severity.ERROR else self._findings.warning
        message = f"{rule.wrong}: {detail}" if detail else rule.wrong
        add(line, identifier, rule, message, right or rule.right)


Check: TypeAlias = Callable[[Tree, etree._Element], None]


@dataclass(frozen=True, slots=True)
class Checks:
    """Checks of single elements, by local name, and of the whole file."""

    by_name: Mapping[str, Check]
    whole: tuple[Callable[[Tree], None], ...] = ()


def finding_id(element: etree._Element) -> str:
    """The id that a finding about an element shows: that of what is drawn, or of a root element.

    Where that has none (the readers make one up), the element's own, or "".
    """
    found: etree._Element | None = element
    while found is not None:
        parent = found.getparent()
        outside = parent is None or parent.tag in _OUTER
        named = found.get("id") or found.tag in _NAMED_BY_READERS
        if outside and named and found.tag not in _PARTS:
            break
        found = parent
    drawn = "" if found is None else found.get("id", "")
    return drawn or element.get("id", "")


def children(element: etree._Element, text: str) -> Iterator[etree._Element]:
    """The children that have one of the local names in a text."""
    return element.iterchildren(*(BPMN + name for name in text.split()))


def texts(element: etree._Element, name: str) -> list[str]:
    """Return the texts of the children with a local name, without the space around them."""
    return ["".join(map(str, child.itertext())).strip() for child in children(element, name)]


def has(element: etree._Element, text: str) -> bool:
    """Whether a child has one of the local names in a text."""
    return next(children(element, text), None) is not None


def parent(element: etree._Element) -> etree._Element:
    """The parent of an element; the root, which has none, is its own."""
    found: etree._Element | None = element.getparent()
    return element if found is None else found


def is_true(element: etree._Element, name: str) -> bool:
    """Whether an attribute is there and true."""
    return element.get(name, "").strip() in _TRUE


def is_false(element: etree._Element, name: str) -> bool:
    """Whether an attribute is there and false."""
    return element.get(name, "").strip() in ("false", "0")


def what(element: etree._Element) -> str:
    """An element as a finding names it."""
    return f"'{element.get('id', '')}'"


def name_of(element: etree._Element) -> str:
    """The local name of an element's tag."""
    return local(element.tag)


def triggers(tree: Tree, event: etree._Element) -> list[etree._Element]:
    """The definitions of an event, also those that it refers to."""
    found: list[etree._Element] = []
    for child in event:
        tag = child.tag
        if not tag.startswith(BPMN):
            continue
        if tag.endswith("EventDefinition"):
            found.append(child)
        elif tag == BPMN + "eventDefinitionRef":
            referred = tree.find(child, child.text or "")
            if referred is not None and referred.tag.endswith("EventDefinition"):
                found.append(referred)
    return found


def trigger_name(definition: etree._Element) -> str:
    """The kind of a definition: "message", "compensate", ..."""
    return local(definition.tag).removesuffix("EventDefinition")


def has_trigger(tree: Tree, event: etree._Element, kind: str) -> bool:
    """Whether an event has a definition of a kind."""
    return any(trigger_name(each) == kind for each in triggers(tree, event))
