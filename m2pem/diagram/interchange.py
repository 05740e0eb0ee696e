"""Writes diagrams (BPMN 2.0.2, chapter 12) into a file: for all that it draws nowhere.

An editor shows what a diagram shows, and nothing else. Here what has none gets one: collaborations
and processes without a diagram, and subprocesses whose inside is drawn nowhere.
"""

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import replace

from lxml import etree

from m2pem.diagram.edges import has_label, label_of, label_of_line
from m2pem.diagram.layout.file import add_loose, keep_sound, lay_out_pools
from m2pem.diagram.layout.model import (
    BPMN,
    SUBPROCESSES,
    Block,
    Element,
    children,
    is_node,
    name_of,
    referred_id,
    tag,
)
from m2pem.diagram.layout.process import lay_out
from m2pem.diagram.picture import Bounds, Line, Shape
from m2pem.diagram.planes import name_of_symbol

NAMESPACES = {
    "bpmndi": "http://www.omg.org/spec/BPMN/20100524/DI",
    "dc": "http://www.omg.org/spec/DD/20100524/DC",
    "di": "http://www.omg.org/spec/DD/20100524/DI",
}
"""Of diagrams, by the prefix that editors write."""

_DI, _DC, _DD = (f"{{{uri}}}" for uri in NAMESPACES.values())
_MARGIN_X, _MARGIN_Y = 160, 80
_ABOVE_THE_TRACKS = 11
"""Lines run below an activity as near as that, and a name would be crossed."""
_ORDER = {"participant": 0, "lane": 1, "boundaryEvent": 3}
"""What lies below all else, and what above: 2 is all else, the outer before the inner."""


def remove_diagrams(definitions: Element) -> None:
    """Remove all diagrams from the file."""
    for diagram in [*definitions.iterchildren(f"{_DI}BPMNDiagram")]:
        definitions.remove(diagram)


def add_diagrams(definitions: Element) -> list[str]:
    """Draw what is drawn nowhere; return the ids of the processes, pools and subprocesses.

    Everything that has a symbol or a line must have an id. What refers to nothing is left out.
    """
    drawn = {referred_id(each.get("bpmnElement")) for each in _drawn(definitions)}
    sound = deepcopy(definitions)
    keep_sound(sound)
    writer = _Writer(definitions)
    added = []
    for owner in _undrawn(sound, drawn):
        if tag(owner) == "collaboration":
            processes = {name_of(each): each for each in children(sound, "process")}
            block = lay_out_pools(owner, processes)
            shown = [owner, *(processes[each] for each in _processes_of(owner) & {*processes})]
        else:
            block = lay_out(owner)
            shown = [owner]
        for each in shown:
            add_loose(each, block)
        writer.diagram(name_of(owner), block)
        added.append(name_of(owner))
    for closed in _hidden(sound, drawn):
        writer.collapse(name_of(closed))
        block = lay_out(closed)
        add_loose(closed, block)
        writer.diagram(name_of(closed), block)
        added.append(name_of(closed))
    return added


def undrawn(definitions: Element) -> list[str]:
    """Return ids of flow nodes that no diagram shows, though it shows others of their container."""
    drawn = {referred_id(each.get("bpmnElement")) for each in _drawn(definitions)}
    return [
        name_of(each)
        for each in definitions.iter(etree.Element)
        if is_node(each) and each.get("id") and each.get("id") not in drawn
    ]


def _drawn(definitions: Element) -> Iterator[Element]:
    for kind in ("BPMNPlane", "BPMNShape", "BPMNEdge"):
        yield from definitions.iter(f"{_DI}{kind}")


def _processes_of(collaboration: Element) -> set[str]:
    return {referred_id(each.get("processRef")) for each in children(collaboration, "participant")}


def _undrawn(definitions: Element, drawn: set[str]) -> list[Element]:
    """Collaborations and processes of which nothing is drawn."""
    found = []
    pooled: set[str] = set()
    processes = {name_of(each): each for each in children(definitions, "process")}
    for collaboration in children(definitions, "collaboration"):
        pools = [name_of(each) for each in children(collaboration, "participant")]
        inside = [processes[each] for each in _processes_of(collaboration) if each in processes]
        if not pools:
            continue
        if not {name_of(collaboration), *pools} & drawn and not any(
            _shows_inside(each, drawn) for each in inside
        ):
            found.append(collaboration)
            pooled |= _processes_of(collaboration)
        pooled |= {name_of(each) for each in inside if not [*_nodes(each)]}
    for name, process in processes.items():
        if name not in pooled and name not in drawn and not _shows_inside(process, drawn):
            found.append(process)
    return found


def _hidden(definitions: Element, drawn: set[str]) -> list[Element]:
    """Subprocesses that are drawn, but nowhere their inside."""
    return [
        each
        for each in definitions.iter(*(f"{{{BPMN}}}{name}" for name in SUBPROCESSES))
        if name_of(each) in drawn and [*_nodes(each)] and not _shows_inside(each, drawn)
    ]


def _nodes(container: Element) -> Iterator[Element]:
    return (each for each in container if is_node(each))


def _shows_inside(container: Element, drawn: set[str]) -> bool:
    return any(each.get("id") in drawn for each in _nodes(container))


class _Writer:
    """Adds diagrams to one file; ids of theirs are made of the elements', and are new."""

    def __init__(self, definitions: Element) -> None:
        self._root = definitions
        self._elements: dict[str, Element] = {}
        self._taken: set[str] = set()
        for each in definitions.iter(etree.Element):
            name = each.get("id")
            if name:
                self._taken.add(name)
                if tag(each):
                    self._elements.setdefault(name, each)

    def diagram(self, owner: str, block: Block) -> None:
        """A diagram with one plane, that of `owner`."""
        diagram = etree.Element(f"{_DI}BPMNDiagram", id=self._new(f"{owner}_diagram"))
        after = next(children(self._root, "relationship"), None)
        if after is None:
            self._root.append(diagram)
        else:
            after.addprevious(diagram)
        plane = etree.SubElement(
            diagram, f"{_DI}BPMNPlane", id=self._new(f"{owner}_plane"), bpmnElement=owner
        )
        for name in sorted(block.boxes, key=self._order):
            self._shape(plane, name, block)
        for name in block.lines:
            self._edge(plane, name, block)

    def collapse(self, subprocess: str) -> None:
        """Mark the shapes of a subprocess as collapsed."""
        for shape in self._root.iter(f"{_DI}BPMNShape"):
            if referred_id(shape.get("bpmnElement")) == subprocess:
                shape.set("isExpanded", "false")

    def _new(self, wanted: str) -> str:
        name, number = wanted, 1
        while name in self._taken:
            number += 1
            name = f"{wanted}_{number}"
        self._taken.add(name)
        return name

    def _order(self, name: str) -> int:
        return _ORDER.get(tag(self._elements[name]), 2)

    def _shape(self, plane: Element, name: str, block: Block) -> None:
        box, element = block.boxes[name], self._elements[name]
        shape = etree.SubElement(
            plane, f"{_DI}BPMNShape", id=self._new(f"{name}_di"), bpmnElement=name
        )
        if box.horizontal:
            shape.set("isHorizontal", "true")
        if tag(element) in SUBPROCESSES:
            shape.set("isExpanded", "true" if box.expanded else "false")
        if tag(element) == "exclusiveGateway":
            shape.set("isMarkerVisible", "true")
        _bounds(shape, box)
        symbol = Shape(name, tag(element), name_of_symbol(element), box)
        if has_label(symbol):
            label = label_of(symbol).bounds
            if symbol.kind == "boundaryEvent":
                label = replace(label, y=label.y - _ABOVE_THE_TRACKS)
            _label(shape, label)

    def _edge(self, plane: Element, name: str, block: Block) -> None:
        element, points = self._elements[name], tuple(block.lines[name])
        edge = etree.SubElement(
            plane, f"{_DI}BPMNEdge", id=self._new(f"{name}_di"), bpmnElement=name
        )
        for x, y in points:
            etree.SubElement(
                edge, f"{_DD}waypoint", x=_number(x + _MARGIN_X), y=_number(y + _MARGIN_Y)
            )
        text = element.get("name") or ""
        if text:
            line = Line(name, tag(element), text, points)
            _label(edge, label_of_line(line, points).bounds)


def _label(of: Element, bounds: Bounds) -> None:
    _bounds(etree.SubElement(of, f"{_DI}BPMNLabel"), bounds)


def _bounds(of: Element, bounds: Bounds) -> None:
    etree.SubElement(
        of,
        f"{_DC}Bounds",
        x=_number(bounds.x + _MARGIN_X),
        y=_number(bounds.y + _MARGIN_Y),
        width=_number(bounds.width),
        height=_number(bounds.height),
    )


def _number(value: float) -> str:
    return str(round(value))
