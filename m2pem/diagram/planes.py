"""The diagrams of a BPMN file (BPMN 2.0.2, chapter 12) as pictures; laid out where it has none."""

from collections.abc import Iterable, Iterator

from lxml import etree

from m2pem.bpmn.xml import parse_xml
from m2pem.diagram.layout.file import lay_out_file
from m2pem.diagram.layout.model import (
    SUBPROCESSES,
    Block,
    Element,
    children,
    is_node,
    referred_id,
    tag,
)
from m2pem.diagram.picture import Bounds, Line, Picture, Point, Shape, Trait

_DI = "{http://www.omg.org/spec/BPMN/20100524/DI}"
_DC = "{http://www.omg.org/spec/DD/20100524/DC}"
_DD = "{http://www.omg.org/spec/DD/20100524/DI}"
_SURFACES = ("participant", "lane")
_DATA_LINES = ("dataInputAssociation", "dataOutputAssociation")
LINES = ("sequenceFlow", "messageFlow", "association", "conversationLink", *_DATA_LINES)
"""Tags of what is drawn as a line."""


def pictures_of(source: bytes) -> tuple[Picture, ...]:
    """A picture for each plane that shows something.

    Raises:
        m2pem.bpmn.xml.XmlError: the bytes are no XML that m2pem reads.
        ValueError: the file has no diagram, and its flows lead nowhere.
    """
    root = parse_xml(source).root
    file = _File(root)
    planes = [*root.iter(f"{_DI}BPMNPlane")]
    found = [file.picture(plane) for plane in planes]
    found = [each for each in found if each.shapes]
    if found:
        return tuple(found)
    return (file.laid_out(),)


class _File:
    def __init__(self, root: Element) -> None:
        self.root = root
        self.elements: dict[str, Element] = {}
        self.parents: dict[str, str] = {}
        for element in root.iter(etree.Element):
            name = element.get("id")
            if name and tag(element):
                self.elements.setdefault(name, element)
                owner = _owner(element)
                if owner:
                    self.parents.setdefault(name, owner)
        for pool in self.root.iter(etree.Element):
            if tag(pool) == "participant" and pool.get("processRef") and pool.get("id"):
                self.parents.setdefault(referred_id(pool.get("processRef")), str(pool.get("id")))

    def element(self, reference: str | None) -> Element | None:
        """What a diagram refers to, by id or by a name with a prefix."""
        found = self.elements.get(reference or "")
        return found if found is not None else self.elements.get(referred_id(reference))

    # --- drawn by its author --------------------------------------------------------------------

    def picture(self, plane: Element) -> Picture:
        """One plane as it was drawn."""
        drawn = [each for each in plane if each.tag == f"{_DI}BPMNShape"]
        owner = self.element(plane.get("bpmnElement"))
        shapes = [shape for each in drawn if (shape := self._shape(each, drawn)) is not None]
        hidden = self._hidden(shapes, "" if owner is None else str(owner.get("id")))
        shapes = [each for each in shapes if each.id not in hidden]
        edges = [each for each in plane if each.tag == f"{_DI}BPMNEdge"]
        lines = [line for each in edges if (line := self._line(each)) is not None]
        lines = [each for each in lines if each.id not in hidden]
        title = "" if owner is None else owner.get("name") or ""
        return Picture(title, self._painted(shapes), tuple(lines), self.parents)

    def _shape(self, drawn: Element, beside: list[Element]) -> Shape | None:
        element = self.element(drawn.get("bpmnElement"))
        bounds = _bounds(drawn)
        if element is None or bounds is None:
            return None
        traits = set(traits_of(element))
        kind = tag(element)
        if self._shows_inside(drawn, element, beside):
            traits.add(Trait.EXPANDED)
        if kind in _SURFACES and not flag(drawn, "isHorizontal", True):
            traits.add(Trait.VERTICAL)
        if flag(drawn, "isMarkerVisible"):
            traits.add(Trait.MARKED)
        return Shape(
            str(element.get("id")),
            kind,
            name_of_symbol(element),
            bounds,
            _label(drawn),
            definitions_of(element),
            frozenset(traits),
        )

    def _shows_inside(self, drawn: Element, element: Element, beside: list[Element]) -> bool:
        """What the diagram says; where it says nothing, whether the inside is drawn there."""
        if tag(element) == "participant":
            return bool(element.get("processRef"))
        if tag(element) not in (*SUBPROCESSES, "callActivity"):
            return False
        if drawn.get("isExpanded") is not None:
            return flag(drawn, "isExpanded")
        inside = {str(each.get("id")) for each in element if is_node(each)}
        return any(referred_id(each.get("bpmnElement")) in inside for each in beside)

    def _hidden(self, shapes: Iterable[Shape], plane: str) -> set[str]:
        """What is inside of collapsed subprocesses on the same plane."""
        closed = {
            each.id
            for each in shapes
            if each.kind in SUBPROCESSES and Trait.EXPANDED not in each.traits
        } - {plane}
        return {name for name in self.elements if closed & {*self._above(name, plane)}}

    def _above(self, name: str, until: str) -> Iterator[str]:
        while (name := self.parents.get(name, "")) and name != until:
            yield name

    def _line(self, drawn: Element) -> Line | None:
        element = self.element(drawn.get("bpmnElement"))
        points = [(_number(each, "x"), _number(each, "y")) for each in drawn.iter(f"{_DD}waypoint")]
        if element is None or len(points) < 2 or tag(element) not in LINES:
            return None
        return self._as_line(element, tuple(points), _label(drawn))

    def _as_line(
        self, element: Element, points: tuple[Point, ...], label: Bounds | None = None
    ) -> Line:
        kind = tag(element)
        source, target = _ends(element)
        traits = traits_of(element)
        if kind == "sequenceFlow":
            traits = traits_of_flow(element, self.element(source))
        name = element.get("name") or ""
        return Line(str(element.get("id")), kind, name, points, source, target, label, traits)

    # --- laid out here --------------------------------------------------------------------------

    def laid_out(self) -> Picture:
        """All of the file, on one plane."""
        block = lay_out_file(self.root)
        shapes = [self._placed(name, block) for name in block.boxes]
        lines = [
            self._as_line(self.elements[name], tuple(points))
            for name, points in block.lines.items()
        ]
        return Picture("", self._painted(shapes), tuple(lines), self.parents)

    def _placed(self, name: str, block: Block) -> Shape:
        element, box = self.elements[name], block.boxes[name]
        traits = set(traits_of(element)) | {Trait.MARKED}
        if box.expanded or element.get("processRef"):
            traits.add(Trait.EXPANDED)
        text = name_of_symbol(element)
        if is_node(element) and not text and not tag(element).endswith("Gateway"):
            text = name
        kind = tag(element)
        return Shape(name, kind, text, box, None, definitions_of(element), frozenset(traits))

    def _painted(self, shapes: Iterable[Shape]) -> tuple[Shape, ...]:
        """What contains others comes first, what lies upon others last."""

        def order(shape: Shape) -> tuple[int, int]:
            if shape.kind in _SURFACES:
                return _SURFACES.index(shape.kind), len([*self._above(shape.id, "")])
            if Trait.EXPANDED in shape.traits:
                return 2, len([*self._above(shape.id, "")])
            return (4 if shape.kind == "boundaryEvent" else 5 if shape.kind == "group" else 3), 0

        return tuple(sorted(shapes, key=order))


def _owner(element: Element) -> str:
    """The id of the nearest element around it that has one and is BPMN; an event's activity."""
    attached = element.get("attachedToRef")
    if attached and tag(element) == "boundaryEvent":
        element_of = element.getparent()
        return "" if element_of is None else str(element_of.get("id") or "")
    around = element.getparent()
    while around is not None:
        if around.get("id") and tag(around) not in ("", "definitions", "collaboration"):
            return str(around.get("id"))
        around = around.getparent()
    return ""


def _ends(element: Element) -> tuple[str, str]:
    if tag(element) not in _DATA_LINES:
        return referred_id(element.get("sourceRef")), referred_id(element.get("targetRef"))
    owner = element.getparent()
    host = "" if owner is None else owner.get("id") or ""
    source = next((e.text or "" for e in children(element, "sourceRef")), "").strip()
    target = next((e.text or "" for e in children(element, "targetRef")), "").strip()
    return (source, host) if tag(element) == "dataInputAssociation" else (host, target)


def _bounds(drawn: Element) -> Bounds | None:
    found = drawn.find(f"{_DC}Bounds")
    if found is None:
        return None
    return Bounds(*(_number(found, each) for each in ("x", "y", "width", "height")))


def _label(drawn: Element) -> Bounds | None:
    label = drawn.find(f"{_DI}BPMNLabel")
    return None if label is None else _bounds(label)


def _number(element: Element, name: str) -> float:
    try:
        value = float(element.get(name, "0"))
    except ValueError:
        return 0.0
    return value if abs(value) < 1e6 else 0.0


_LOOPS = {
    "standardLoopCharacteristics": Trait.LOOP,
    "multiInstanceLoopCharacteristics": Trait.PARALLEL_INSTANCES,
}
_DATA = {
    "dataInput": (Trait.INPUT,),
    "dataOutput": (Trait.OUTPUT,),
    "dataObjectReference": (),
}
_TRUE = ("true", "1")
_THROWING = ("endEvent", "intermediateThrowEvent")


def flag(element: Element, name: str, default: bool = False) -> bool:
    """An attribute that says true or false."""
    text = element.get(name)
    return default if text is None else text.strip() in _TRUE


def definitions_of(element: Element) -> tuple[str, ...]:
    """What triggers an event, or results from it: `timer`, `message`, ..."""
    ending = "EventDefinition"
    own = [tag(e).removesuffix(ending) for e in element if tag(e).endswith(ending)]
    for reference in children(element, "eventDefinitionRef"):
        wanted = referred_id(reference.text)
        for each in element.getroottree().getroot():
            if each.get("id") == wanted and tag(each).endswith(ending):
                own.append(tag(each).removesuffix(ending))
    return tuple(own)


def name_of_symbol(element: Element) -> str:
    """The text at it, "" for none."""
    if tag(element) == "textAnnotation":
        return "".join((e.text or "").strip() for e in children(element, "text"))
    if tag(element) == "group":
        return _category(element)
    name = element.get("name") or ""
    state = next(children(element, "dataState"), None)
    if state is not None and state.get("name"):
        name = f"{name} [{state.get('name')}]"
    return name


def traits_of(element: Element) -> frozenset[Trait]:
    """What the symbol or line shows beside its kind."""
    kind = tag(element)
    found: set[Trait] = set()
    for each, trait in _LOOPS.items():
        for loop in children(element, each):
            sequential = flag(loop, "isSequential") and trait is Trait.PARALLEL_INSTANCES
            found.add(Trait.SEQUENTIAL_INSTANCES if sequential else trait)
    if flag(element, "isForCompensation"):
        found.add(Trait.COMPENSATION)
    if kind in SUBPROCESSES and flag(element, "triggeredByEvent"):
        found.add(Trait.EVENT_SUBPROCESS)
    if kind in _THROWING:
        found.add(Trait.THROWING)
    if not flag(element, "cancelActivity", True) or not flag(element, "isInterrupting", True):
        found.add(Trait.NON_INTERRUPTING)
    if flag(element, "parallelMultiple"):
        found.add(Trait.PARALLEL_MULTIPLE)
    if flag(element, "instantiate"):
        found.add(Trait.INSTANTIATING)
    if element.get("eventGatewayType") == "Parallel":
        found.add(Trait.PARALLEL)
    if kind == "association" and element.get("associationDirection", "None") != "None":
        found.add(Trait.DIRECTED)
    return frozenset(found | _of_data(element, kind))


def traits_of_flow(flow: Element, source: Element | None) -> frozenset[Trait]:
    """What a sequence flow shows where it begins."""
    if source is None:
        return frozenset()
    if source.get("default") == flow.get("id"):
        return frozenset({Trait.DEFAULT})
    conditional = next(children(flow, "conditionExpression"), None) is not None
    if conditional and not tag(source).endswith("Gateway"):
        return frozenset({Trait.CONDITIONAL})
    return frozenset()


def _of_data(element: Element, kind: str) -> set[Trait]:
    if kind == "participant":
        several = next(children(element, "participantMultiplicity"), None) is not None
        return {Trait.PARALLEL_INSTANCES} if several else set()
    if kind not in _DATA:
        return set()
    found = {*_DATA[kind]}
    of = element
    if kind == "dataObjectReference":
        wanted = element.get("dataObjectRef")
        of = next((e for e in _siblings(element) if e.get("id") == wanted), element)
    if flag(of, "isCollection"):
        found.add(Trait.COLLECTION)
    return found


def _siblings(element: Element) -> list[Element]:
    parent = element.getparent()
    return [] if parent is None else [*parent]


def _category(group: Element) -> str:
    wanted = referred_id(group.get("categoryValueRef"))
    for each in group.getroottree().getroot().iter(etree.Element):
        if wanted and tag(each) == "categoryValue" and each.get("id") == wanted:
            return each.get("value") or ""
    return ""
