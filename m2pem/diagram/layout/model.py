"""What of a BPMN file has a symbol or a line, and where a layout puts it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from lxml import etree

from m2pem.diagram.picture import Bounds, Point

BPMN = "http://www.omg.org/spec/BPMN/20100524/MODEL"

Element = etree._Element

SUBPROCESSES = ("subProcess", "transaction", "adHocSubProcess")
DATA = ("dataObjectReference", "dataStoreReference")
SURFACES = (*DATA, "textAnnotation")
_LINES_OF_DATA = ("dataInputAssociation", "dataOutputAssociation")


def tag(element: Element) -> str:
    """The name in the namespace of BPMN, "" in others."""
    name = element.tag
    if not isinstance(name, str):
        return ""
    return name.removeprefix(f"{{{BPMN}}}") if name.startswith(f"{{{BPMN}}}") else ""


def name_of(element: Element) -> str:
    """Its id.

    Raises:
        ValueError: it has none.
    """
    identifier = element.get("id")
    if not identifier:
        raise ValueError(f"line {element.sourceline}: <{tag(element)}> needs an id to be drawn")
    return identifier


def referred_id(reference: str | None) -> str:
    """An id that is referred to, without the prefix of its namespace."""
    return (reference or "").rpartition(":")[2].strip()


def children(element: Element, *tags: str) -> Iterator[Element]:
    """Those directly in it that have one of the tags."""
    return (child for child in element if tag(child) in tags)


def is_node(element: Element) -> bool:
    """Whether it is a flow node, boundary events too."""
    name = tag(element)
    return (
        name in SUBPROCESSES
        or name == "callActivity"
        or name.endswith(("task", "Task", "Gateway", "Event"))
    )


def flow_nodes(container: Element) -> list[Element]:
    """Without boundary events."""
    return [e for e in container if is_node(e) and tag(e) != "boundaryEvent"]


def boundary_events(container: Element) -> dict[str, list[Element]]:
    """By the activity that they are attached to."""
    found: dict[str, list[Element]] = {}
    for event in children(container, "boundaryEvent"):
        found.setdefault(referred_id(event.get("attachedToRef")), []).append(event)
    return found


def data_lines(container: Element) -> Iterator[tuple[str, str, str]]:
    """Id, source and target of the data associations of the container's own flow nodes."""
    for node in (e for e in container if is_node(e)):
        for line in children(node, *_LINES_OF_DATA):
            source = next((referred_id(e.text) for e in children(line, "sourceRef")), "")
            target = next((referred_id(e.text) for e in children(line, "targetRef")), "")
            if tag(line) == "dataInputAssociation":
                target = name_of(node)
            else:
                source = name_of(node)
            if source and target:
                yield name_of(line), source, target


@dataclass(frozen=True, slots=True)
class LaneTree:
    """The lanes of a process, an outer one before those in it.

    `leaves`: those without others in them, in their order. `depth`: of each, from 0. `within`: of
    each, its leaves. `of_node`: the number of the leaf that a node is in.
    """

    leaves: tuple[str, ...]
    depth: Mapping[str, int]
    within: Mapping[str, tuple[str, ...]]
    of_node: Mapping[str, int]


def lanes(process: Element) -> LaneTree:
    """The lanes of a process. Of several lane sets beside each other, the first one's are drawn."""
    leaves: list[str] = []
    depth: dict[str, int] = {}
    within: dict[str, tuple[str, ...]] = {}
    of_node: dict[str, int] = {}

    def add(lane: Element, level: int) -> None:
        name = name_of(lane)
        depth[name] = level
        first = len(leaves)
        for inner in children(lane, "childLaneSet"):
            for each in children(inner, "lane"):
                add(each, level + 1)
        if len(leaves) == first:
            leaves.append(name)
            refs = (referred_id(ref.text) for ref in children(lane, "flowNodeRef"))
            of_node.update(dict.fromkeys(refs, first))
        within[name] = tuple(leaves[first:])

    for lane_set in [*children(process, "laneSet")][:1]:
        for lane in children(lane_set, "lane"):
            add(lane, 0)
    return LaneTree(tuple(leaves), depth, within, of_node)


@dataclass(frozen=True, slots=True)
class Box(Bounds):
    """A symbol's place, in the diagram's units; y grows downwards."""

    expanded: bool = False
    horizontal: bool = False


@dataclass(slots=True)
class Block:
    """Everything within a rectangle whose corner is at 0, 0."""

    width: float = 0
    height: float = 0
    boxes: dict[str, Box] = field(default_factory=dict)
    lines: dict[str, list[Point]] = field(default_factory=dict)

    def put(self, other: "Block", x: float, y: float) -> None:
        """Take in all that is in `other`, moved by that much."""
        for name, box in other.boxes.items():
            self.boxes[name] = replace(box, x=box.x + x, y=box.y + y)
        for name, points in other.lines.items():
            self.lines[name] = [(px + x, py + y) for px, py in points]
