"""Diagrams that are written into files: what is where."""

from lxml import etree

from m2pem.diagram.interchange import add_diagrams, undrawn
from tests.editor import BPMNDI, DC, Box, edges, symbols

HEAD = '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="t">'
LANES = """
<collaboration id="Pools"><participant id="Pool" name="All" processRef="P"/></collaboration>
<process id="P"><laneSet id="Set">
  <lane id="Outer" name="outer"><childLaneSet id="Inside">
    <lane id="Left"><flowNodeRef>S</flowNodeRef></lane>
    <lane id="Right"><flowNodeRef>T</flowNodeRef></lane></childLaneSet></lane>
  <lane id="Empty"/></laneSet>
  <startEvent id="S"/><sequenceFlow id="f" sourceRef="S" targetRef="T"/><task id="T"/>
</process></definitions>"""


def drawn(inside: str) -> etree._Element:
    root = etree.fromstring(HEAD + inside)
    add_diagrams(root)
    return root


def boxes(root: etree._Element) -> dict[str, Box]:
    found = {}
    for shape in root.iter(f"{BPMNDI}BPMNShape"):
        bounds = shape.find(f"{DC}Bounds")
        assert bounds is not None
        x, y, width, height = (float(bounds.get(k, "")) for k in ("x", "y", "width", "height"))
        found[shape.get("bpmnElement", "")] = Box(x, y, x + width, y + height)
    return found


def is_in(inner: Box, outer: Box) -> bool:
    return (
        outer.left <= inner.left
        and outer.top <= inner.top
        and inner.right <= outer.right
        and inner.bottom <= outer.bottom
    )


def test_lanes_are_in_the_lanes_that_have_them_and_nodes_in_theirs() -> None:
    found = boxes(drawn(LANES))
    for inner, outer in [
        *(("Outer", "Pool"), ("Empty", "Pool"), ("Left", "Outer"), ("Right", "Outer")),
        *(("S", "Left"), ("T", "Right")),
    ]:
        assert is_in(found[inner], found[outer]), (inner, outer)
    assert (
        found["Left"].bottom <= found["Right"].top and found["Outer"].bottom <= found["Empty"].top
    )
    assert found["Left"].left > found["Outer"].left


def test_pools_that_show_one_process_are_both_drawn() -> None:
    end = "</collaboration>"
    found = boxes(drawn(LANES.replace(end, f'<participant id="Twin" processRef="P"/>{end}')))
    assert is_in(found["T"], found["Pool"]) and "Twin" in found


def test_lines_between_what_is_far_apart_are_straight() -> None:
    root = drawn(
        '<process id="P"><dataObject id="D"/><dataObjectReference id="R" dataObjectRef="D"/>'
        '<subProcess id="Sub"><task id="T"><dataInputAssociation id="a"><sourceRef>R</sourceRef>'
        "</dataInputAssociation></task></subProcess></process></definitions>"
    )
    assert len(edges(root)["a"]) == 1
    assert undrawn(root) == []


def test_no_flow_crosses_a_symbol() -> None:
    root = drawn(LANES)
    crossings = [
        (edge, name)
        for edge, segments in edges(root).items()
        for name, box in symbols(root).items()
        if any(box.meets(*segment) for segment in segments)
    ]
    assert crossings == []
