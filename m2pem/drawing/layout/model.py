"""What of a BPMN file has a symbol or a line, container by container."""

from collections.abc import Iterator

from lxml import etree

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


def local(reference: str | None) -> str:
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
        found.setdefault(local(event.get("attachedToRef")), []).append(event)
    return found


def data_lines(container: Element) -> Iterator[tuple[str, str, str]]:
    """Id, source and target of the data associations of the container's own flow nodes."""
    for node in (e for e in container if is_node(e)):
        for line in children(node, *_LINES_OF_DATA):
            source = next((local(e.text) for e in children(line, "sourceRef")), "")
            target = next((local(e.text) for e in children(line, "targetRef")), "")
            if tag(line) == "dataInputAssociation":
                target = name_of(node)
            else:
                source = name_of(node)
            if source and target:
                yield name_of(line), source, target


def lanes(process: Element) -> tuple[list[Element], dict[str, int]]:
    """The lanes of the process, and the number of each node's; the innermost are not looked at."""
    found = [lane for each in children(process, "laneSet") for lane in children(each, "lane")]
    where = {
        local(ref.text): number
        for number, lane in enumerate(found)
        for ref in children(lane, "flowNodeRef")
    }
    return found, where
