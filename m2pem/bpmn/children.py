"""The children of one element by tag, checked against what BPMN allows there."""

from dataclasses import dataclass, field

from lxml import etree

from m2pem.bpmn.context import ReadingContext, text_of
from m2pem.bpmn.rules.attributes import ELEMENT_ORDER, UNKNOWN_ELEMENT
from m2pem.bpmn.schema import SHAPES, Shape
from m2pem.bpmn.xml import BPMN, M2PEM, a, kind, local
from m2pem.suggestions import suggest_or

DOCUMENTATION = BPMN + "documentation"
EXTENSIONS = BPMN + "extensionElements"
_FLOW_REFERENCES = frozenset({BPMN + "incoming", BPMN + "outgoing"})
_UNREAD = Shape(frozenset(), {})


@dataclass(slots=True)
class Children:
    """One element's id and children by tag, without `incoming` and `outgoing`."""

    element: etree._Element
    id: str
    children: dict[str, list[etree._Element]] = field(default_factory=dict)

    def of(self, name: str) -> list[etree._Element]:
        """The BPMN children with this local name."""
        return self.children.get(BPMN + name, [])

    def documentation(self) -> str:
        """The text of the first documentation."""
        found = self.children.get(DOCUMENTATION)
        return text_of(found[0]) if found else ""

    def extensions(self) -> list[etree._Element]:
        """The children of its extension elements."""
        return [each for outer in self.children.get(EXTENSIONS, []) for each in outer]


def read_children(context: ReadingContext, element: etree._Element, identifier: str) -> Children:
    """Check an element's attributes and the order of its children; return the children."""
    shape = SHAPES.get(element.tag, _UNREAD)
    context.check_attributes(element, shape, identifier)
    result = Children(element, identifier)
    order = ChildOrder()
    for child in element:
        name = child.tag
        rank = shape.ranks.get(name)
        if rank is None or rank < order.reached:
            order.check(context, element, child, shape, identifier)
        else:
            order.reached = rank
            order.last = name
        if name not in _FLOW_REFERENCES:
            result.children.setdefault(name, []).append(child)
    return result


@dataclass(slots=True)
class ChildOrder:
    """The position of one element's children in BPMN's order; it warns once."""

    reached: int = -1
    last: str = ""
    warned: bool = False

    def check(
        self,
        context: ReadingContext,
        parent: etree._Element,
        child: etree._Element,
        shape: Shape,
        identifier: str,
    ) -> None:
        """Warn of a child that BPMN does not know there, or that comes too late."""
        name = child.tag
        rank = shape.ranks.get(name)
        if rank is None:
            if name.startswith(BPMN):
                context.findings.warning(
                    child,
                    identifier or child.get("id", ""),
                    UNKNOWN_ELEMENT,
                    f"BPMN has no '{local(name)}' in {a(kind(parent.tag))}; it is ignored",
                    suggest_or(local(name), [local(each) for each in shape.ranks], "delete it"),
                )
        elif rank >= self.reached:
            self.reached = rank
            self.last = name
        elif not self.warned:
            self.warned = True
            context.findings.warning(
                child,
                identifier,
                ELEMENT_ORDER,
                f"'{local(name)}' comes after '{local(self.last)}', which BPMN's schema forbids",
                f"move it before the first '{local(self.last)}'; some editors refuse the file",
            )


def own_extensions(found: Children, used: frozenset[str]) -> dict[str, list[etree._Element]]:
    """Those m2pem extension elements that the reader uses, by local name.

    What the others are, rules say (`rules/extensions.py`).
    """
    result: dict[str, list[etree._Element]] = {}
    for child in found.extensions():
        if child.tag.startswith(M2PEM) and (name := local(child.tag)) in used:
            result.setdefault(name, []).append(child)
    return result
