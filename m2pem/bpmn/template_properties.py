"""m2pem's elements as properties of Camunda's, which element templates can write (docs/editors.md).

An element template writes no element of a namespace that its editor does not know. It writes
`zeebe:property` (Camunda 8) and `camunda:property` (Camunda 7), and a property whose name begins
with `m2pem:` means an element of m2pem's:

    m2pem:behavior = goto           <m2pem:behavior type="vehicle" name="goto">
    m2pem:type = vehicle
    m2pem:property:speed = 2 m/s      <m2pem:properties><m2pem:property name="speed" value="2 m/s"/>
    m2pem:vehicle:mover = ugv1        <m2pem:resources><m2pem:role name="mover" vehicle="ugv1"
    m2pem:wait:mover = PT10M                                            wait="PT10M"/>

The elements take the properties' place in the tree before it is read, so that readers and rules
know only m2pem's elements.
"""

from dataclasses import dataclass, field

from lxml import etree

from m2pem.bpmn.file_findings import FileFindings
from m2pem.bpmn.needs import NEED_ATTRIBUTES
from m2pem.bpmn.rules.behaviors import DUPLICATE_PROPERTY
from m2pem.bpmn.rules.extensions import UNKNOWN_EXTENSION
from m2pem.bpmn.xml import BPMN, CAMUNDA, M2PEM, ZEEBE, Document
from m2pem.mission.behavior import RoleKind
from m2pem.suggestions import suggest_or

PREFIX = "m2pem:"
BEHAVIOR = f"{PREFIX}behavior"
TYPE = f"{PREFIX}type"
PROMPT = f"{PREFIX}prompt"
STORE = f"{PREFIX}store"
OPERATORS = f"{PREFIX}role"
TIMEOUT = f"{PREFIX}timeout"

_SETTINGS = (STORE, OPERATORS, TIMEOUT)
_SINGLE = frozenset({BEHAVIOR, TYPE, PROMPT, *_SETTINGS})
_OF_ROLES = (*NEED_ATTRIBUTES, "onLoss", "keep")
_ROLES = frozenset({*RoleKind, *_OF_ROLES})
_NAMED = frozenset({"property", "decision", *_ROLES})
_CONTAINERS = (CAMUNDA + "properties", ZEEBE + "properties")
_EXTENSIONS = BPMN + "extensionElements"
_NAMESPACE = {"m2pem": M2PEM[1:-1]}


def property_name(what: str, name: str) -> str:
    """Return the property's name for a parameter, decision, vehicle, payload or team."""
    return f"{PREFIX}{what}:{name}"


def read_template_properties(document: Document, findings: FileFindings) -> Document:
    """Replace each property `m2pem:...` by what it means; report those that mean nothing.

    Changes the document's tree. The lines of new elements are those of their properties.
    """
    origins: dict[etree._Element, etree._Element] = {}
    for container in [*document.root.iter(*_CONTAINERS)]:
        outer = container.getparent()
        if outer is not None and outer.tag == _EXTENSIONS:
            properties = [each for each in container if each.get("name", "").startswith(PREFIX)]
            if properties:
                _Replacement(outer, findings, origins).replace(container, properties)
                if not len(container):
                    outer.remove(container)
    if not origins:
        return document
    line = document.line
    return Document(document.root, lambda element: line(origins.get(element, element)))


@dataclass(slots=True)
class _Replacement:
    """What takes the place of the properties of one BPMN element.

    `origins`: the property of each new element.
    """

    outer: etree._Element
    findings: FileFindings
    origins: dict[etree._Element, etree._Element]
    single: dict[str, etree._Element] = field(default_factory=dict)
    named: list[tuple[str, str, etree._Element]] = field(default_factory=list)
    """What it is (`property`, `decision`, `vehicle`, ...), its name, and the property."""

    def replace(self, container: etree._Element, properties: list[etree._Element]) -> None:
        """Append m2pem's elements to the extension elements; take out what they are made of."""
        for element in properties:
            if not _value(element) or self._sort(element):
                container.remove(element)
        if BEHAVIOR in self.single:
            self._behavior(self.single[BEHAVIOR])
        elif TYPE in self.single:
            self._error(
                self.single[TYPE],
                f"'{TYPE}' is without '{BEHAVIOR}'",
                f"add the property '{BEHAVIOR}' with a name of the catalogue",
            )
        else:
            for item in self._of(("property",)):
                self._property(self.outer, *item)
            self._roles(self.outer)
        self._prompt()

    def _sort(self, element: etree._Element) -> bool:
        """Note what the property means; return False when it means nothing, which is reported."""
        whole = element.get("name", "").strip()
        if whole in _SINGLE:
            first = self.single.setdefault(whole, element)
            if first is not element:
                self.findings.error(
                    element,
                    self._owner(),
                    DUPLICATE_PROPERTY,
                    f"the property '{whole}' is given twice",
                )
            return first is element
        what, colon, name = whole.removeprefix(PREFIX).partition(":")
        if what in _NAMED and name:
            self.named.append((what, name, element))
            return True
        if what in _NAMED:
            right = f"write for example '{property_name(what, _EXAMPLES[what])}'"
            which = "role" if what in _OF_ROLES else what
            self._error(element, f"the property '{whole}' does not say which {which}", right)
        else:
            forms = [*sorted(_SINGLE), *(f"{PREFIX}{each}:" for each in sorted(_NAMED))]
            right = f"{PREFIX}{what}{colon}"
            suggestion = suggest_or(right, forms, f"there are: {', '.join(forms)}")
            self._error(element, f"m2pem reads no property '{whole}'", suggestion)
        return False

    def _behavior(self, origin: etree._Element) -> None:
        behavior = self._add(self.outer, "behavior", origin, name=_value(origin))
        if TYPE in self.single:
            behavior.set("type", _value(self.single[TYPE]))
        if properties := self._of(("property",)):
            inside = self._add(behavior, "properties", origin)
            for item in properties:
                self._property(inside, *item)
        if self._of(tuple(_ROLES)):
            self._roles(self._add(behavior, "resources", origin))

    def _prompt(self) -> None:
        decisions = self._of(("decision",))
        parts = [self.single[name] for name in (PROMPT, *_SETTINGS) if name in self.single]
        if not (parts or decisions):
            return
        origin = parts[0] if parts else decisions[0][2]
        task = self._add(self.outer, "userTask", origin)
        for name in _SETTINGS:
            if name in self.single:
                task.set(name.removeprefix(PREFIX), _value(self.single[name]))
        if PROMPT in self.single:
            question = self.single[PROMPT]
            self._add(task, "prompt", question).text = _value(question)
        for _, value, element in decisions:
            self._add(task, "decision", element, value=value, label=_value(element))

    def _of(self, kinds: tuple[str, ...]) -> list[tuple[str, str, etree._Element]]:
        return [each for each in self.named if each[0] in kinds]

    def _property(self, outer: etree._Element, _: str, name: str, origin: etree._Element) -> None:
        self._add(outer, "property", origin, name=name, value=_value(origin))

    def _roles(self, outer: etree._Element) -> None:
        """Add a role of each name: its properties are attributes of one element.

        What is given twice makes two elements, which the reader of roles reports.
        """
        roles: dict[str, etree._Element] = {}
        for what, name, origin in self._of(tuple(_ROLES)):
            role = roles.get(name)
            if role is None or what in role.attrib:
                role = roles[name] = self._add(outer, "role", origin, name=name)
            role.set(what, _value(origin))

    def _add(
        self, outer: etree._Element, tag: str, origin: etree._Element, /, **attributes: str
    ) -> etree._Element:
        element = etree.SubElement(outer, M2PEM + tag, attributes, _NAMESPACE)
        self.origins[element] = origin
        return element

    def _error(self, element: etree._Element, message: str, remedy: str) -> None:
        self.findings.error(element, self._owner(), UNKNOWN_EXTENSION, message, remedy)

    def _owner(self) -> str:
        owner = self.outer.getparent()
        return "" if owner is None else owner.get("id", "")


_EXAMPLES = {
    "property": "speed",
    "decision": "continue",
    "vehicle": "mover",
    "payload": "camera",
    "team": "team",
    **dict.fromkeys(_OF_ROLES, "mover"),
}


def _value(element: etree._Element) -> str:
    """The property's value; "" says nothing: an editor keeps the fields that were left empty."""
    value = element.get("value")
    return (value if value is not None else element.text or "").strip()
