"""The diagram interchange part of a BPMN file (BPMN 2.0, chapter 12), and how the file is set."""

from lxml import etree

from m2pem.diagram.layout import model
from m2pem.diagram.layout.file import lay_out_file
from m2pem.diagram.layout.model import BPMN, Block, Element, name_of, tag

DI = {
    "bpmndi": "http://www.omg.org/spec/BPMN/20100524/DI",
    "dc": "http://www.omg.org/spec/DD/20100524/DC",
    "di": "http://www.omg.org/spec/DD/20100524/DI",
}
_XSI = "http://www.w3.org/2001/XMLSchema-instance"
_OWN = "https://m2pem.org/schema/1"
_MARGIN_X, _MARGIN_Y = 160, 80
_DECLARATION = b"<?xml version='1.0' encoding='UTF-8'?>\n"  # as lxml puts it
_MARKED = ("exclusiveGateway",)


def draw(source: bytes) -> bytes:
    """The same model with a new diagram, neatly set; names are made of ids where there are none.

    Raises:
        ValueError: it cannot be drawn; the message tells why.
    """
    parser = etree.XMLParser(remove_blank_text=True, resolve_entities=False)
    read = etree.fromstring(source, parser)
    root = _renewed(read)
    _complete(root)
    block = lay_out_file(root)
    _add_diagram(root, block)
    _break_scripts(root)
    etree.indent(root, space="  ")
    text: bytes = etree.tostring(root, encoding="UTF-8", pretty_print=True)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + text.removeprefix(_DECLARATION)


def _renewed(read: Element) -> Element:
    """With all namespaces declared at the top, and without the diagram it had."""
    spaces: dict[str | None, str] = {None: BPMN, "xsi": _XSI, "m2pem": _OWN}
    spaces.update(DI)
    spaces |= {prefix: uri for prefix, uri in read.nsmap.items() if uri not in spaces.values()}
    root = etree.Element(read.tag, nsmap=spaces)  # type: ignore[arg-type]
    for key, value in read.attrib.items():
        root.set(key, value)
    for child in read:
        if child.tag != f"{{{DI['bpmndi']}}}BPMNDiagram":
            root.append(child)
    if not any(str(each.tag).startswith(f"{{{_OWN}}}") for each in root.iter(etree.Element)):
        etree.cleanup_namespaces(root, keep_ns_prefixes=["bpmndi", "dc", "di", "xsi"])
    return root


def _complete(root: Element) -> None:
    """What an editor writes and an author need not: names, types of expressions, pools."""
    for element in root.iter(etree.Element):
        if model.is_node(element) and element.get("name") is None:
            element.set("name", name_of(element))
        if tag(element) == "conditionExpression" and f"{{{_XSI}}}type" not in element.attrib:
            element.set(f"{{{_XSI}}}type", "tFormalExpression")
        flow = element.getparent()
        if tag(element) == "conditionExpression" and flow is not None and not flow.get("name"):
            flow.set("name", element.text or "")
    processes = [*model.children(root, "process")]
    if len(processes) > 1 and next(model.children(root, "collaboration"), None) is None:
        collaboration = etree.Element(f"{{{BPMN}}}collaboration", id="pools")
        for process in processes:
            name = name_of(process)
            pool = etree.SubElement(collaboration, f"{{{BPMN}}}participant", id=f"pool_{name}")
            pool.set("name", process.get("name") or name)
            pool.set("processRef", name)
        processes[0].addprevious(collaboration)


def _break_scripts(root: Element) -> None:
    for script in root.iter(f"{{{BPMN}}}script"):
        if script.text and "\n" in script.text:
            lines = [line.strip() for line in script.text.splitlines() if line.strip()]
            script.text = "\n".join(lines)


def _add_diagram(root: Element, block: Block) -> None:
    owner = next(model.children(root, "collaboration"), None)
    if owner is None:
        owner = next(model.children(root, "process"))
    bpmndi, dc, di = (f"{{{uri}}}" for uri in DI.values())
    diagram = etree.SubElement(root, f"{bpmndi}BPMNDiagram", id="diagram")
    plane = etree.SubElement(diagram, f"{bpmndi}BPMNPlane", id="plane", bpmnElement=name_of(owner))
    tags = {str(e.get("id")): tag(e) for e in root.iter(etree.Element) if e.get("id")}
    for name, box in sorted(block.boxes.items(), key=lambda item: _depth(tags[item[0]])):
        shape = etree.SubElement(plane, f"{bpmndi}BPMNShape", id=f"{name}_di", bpmnElement=name)
        if box.horizontal:
            shape.set("isHorizontal", "true")
        if box.expanded:
            shape.set("isExpanded", "true")
        if tags[name] in _MARKED:
            shape.set("isMarkerVisible", "true")
        etree.SubElement(
            shape,
            f"{dc}Bounds",
            x=_number(box.x + _MARGIN_X),
            y=_number(box.y + _MARGIN_Y),
            width=_number(box.width),
            height=_number(box.height),
        )
    for name, points in block.lines.items():
        edge = etree.SubElement(plane, f"{bpmndi}BPMNEdge", id=f"{name}_di", bpmnElement=name)
        for x, y in points:
            etree.SubElement(
                edge, f"{di}waypoint", x=_number(x + _MARGIN_X), y=_number(y + _MARGIN_Y)
            )


def _depth(kind: str) -> int:
    """Pools lie below lanes, and these below all else; what is within lies above (stable sort)."""
    return {"participant": 0, "lane": 1, "boundaryEvent": 3}.get(kind, 2)


def _number(value: float) -> str:
    return str(round(value))
