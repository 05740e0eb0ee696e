"""Lays out a whole file: one process, or a collaboration's pools one below the other."""

from collections.abc import Iterator
from dataclasses import replace

from lxml import etree

from m2pem.diagram.layout import model
from m2pem.diagram.layout.model import (
    Block,
    Box,
    Element,
    children,
    data_lines,
    flow_nodes,
    is_node,
    name_of,
    referred_id,
    tag,
)
from m2pem.diagram.layout.process import lay_out
from m2pem.diagram.picture import Point

_HEADER = 30
_CLOSED = 60  # the height of a pool that shows no process
_BETWEEN = 40
_TRACK = 10
_LEAST_WIDTH = 300


def lay_out_file(definitions: Element) -> Block:
    """Everything, with the upper left corner at 0, 0.

    Raises:
        ValueError: the file has no process, or dangling references.
    """
    processes = {name_of(p): p for p in model.children(definitions, "process")}
    collaboration = next(model.children(definitions, "collaboration"), None)
    if collaboration is None:
        return _stacked(processes)
    return lay_out_pools(collaboration, processes)


def _stacked(processes: dict[str, Element]) -> Block:
    """Processes without pools, one below the other."""
    if not processes:
        raise ValueError("there is no process to be drawn")
    block = Block()
    for process in processes.values():
        inside = lay_out(process)
        block.put(inside, 0, block.height)
        block.width = max(block.width, inside.width)
        block.height += inside.height
    return block


def lay_out_pools(collaboration: Element, processes: dict[str, Element]) -> Block:
    """The pools of a collaboration, with the corner of the upper one at 0, 0.

    Of a process that has several pools, the first one shows it.

    Raises:
        ValueError: there are dangling references.
    """
    pools = [*model.children(collaboration, "participant")]
    insides: dict[str, Block] = {}
    shown: set[str] = set()
    for pool in pools:
        process = referred_id(pool.get("processRef"))
        if process in processes and process not in shown:
            shown.add(process)
            insides[name_of(pool)] = lay_out(processes[process])
    width = max([_LEAST_WIDTH, *(inside.width for inside in insides.values())])
    flows = [*model.children(collaboration, "messageFlow")]
    between = _BETWEEN + _TRACK * len(flows)
    block = Block(width=width + _HEADER)
    for pool in pools:
        inside = insides.get(name_of(pool))
        if inside is not None:
            for lane in model.lanes(processes[referred_id(pool.get("processRef"))]).depth:
                box = inside.boxes[lane]
                inside.boxes[lane] = replace(box, width=width - box.x)
        height = max(inside.height if inside is not None else 0, _CLOSED)
        block.boxes[name_of(pool)] = Box(0, block.height, block.width, height, horizontal=True)
        if inside is not None:
            block.put(inside, _HEADER, block.height)
        block.height += height + between
    block.height -= between
    for number, flow in enumerate(flows):
        block.lines[name_of(flow)] = _message(flow, number, block, pools)
    return block


def _message(flow: Element, number: int, block: Block, pools: list[Element]) -> list[Point]:
    source, target = referred_id(flow.get("sourceRef")), referred_id(flow.get("targetRef"))
    for end in (source, target):
        if end not in block.boxes:
            raise ValueError(f"{name_of(flow)}: nothing drawn is called {end!r}")
    a, b = block.boxes[source], block.boxes[target]
    closed = {name_of(pool) for pool in pools if tag(pool) == "participant"}
    shift = _TRACK * (number % 3 - 1)
    x1 = (b if source in closed else a).centre[0] + shift
    x2 = (a if target in closed else b).centre[0] + shift
    down = a.y < b.y
    start, end_y = (a.bottom, b.y) if down else (a.y, b.bottom)
    upper = next(
        block.boxes[name_of(pool)]
        for pool in reversed(pools)
        if block.boxes[name_of(pool)].y <= min(a.y, b.y)
    )
    level = upper.bottom + _BETWEEN / 2 + _TRACK * number
    if x1 == x2:
        return [(x1, start), (x2, end_y)]
    return [(x1, start), (x1, level), (x2, level), (x2, end_y)]


_GAP = 20
_NOTE = (100, 50)


def add_loose(within: Element, block: Block) -> None:
    """Add to `block` what the layout of `within`, a process or collaboration, has left out."""
    for note in children(within, "textAnnotation"):
        if name_of(note) not in block.boxes:
            block.boxes[name_of(note)] = Box(0, block.height + _GAP, *_NOTE)
            block.height += _GAP + _NOTE[1]
    for name, source, target in _lines(within):
        if name not in block.lines and source != target:
            start, end = _middle(block, source), _middle(block, target)
            if start is not None and end is not None:
                block.lines[name] = [_edge(block, source, end), _edge(block, target, start)]


def _lines(within: Element) -> Iterator[tuple[str, str, str]]:
    yield from data_lines(within)
    for line in children(within, "association"):
        yield name_of(line), referred_id(line.get("sourceRef")), referred_id(line.get("targetRef"))
    for inner in within:
        if is_node(inner) and tag(inner).lower().endswith(("process", "transaction")):
            yield from _lines(inner)


def _middle(block: Block, name: str) -> Point | None:
    if name in block.boxes:
        return block.boxes[name].centre
    points = block.lines.get(name)
    if not points:
        return None
    (x1, y1), (x2, y2) = points[(len(points) - 1) // 2 : (len(points) - 1) // 2 + 2]
    return (x1 + x2) / 2, (y1 + y2) / 2


def _edge(block: Block, name: str, towards: Point) -> Point:
    """Where a straight line from the middle leaves a symbol; of a line, its middle."""
    x, y = _middle(block, name) or towards
    box = block.boxes.get(name)
    if box is None:
        return x, y
    dx, dy = towards[0] - x, towards[1] - y
    part = min(box.width / 2 / abs(dx) if dx else 1.0, box.height / 2 / abs(dy) if dy else 1.0, 1.0)
    return x + dx * part, y + dy * part


def keep_sound(definitions: Element) -> None:
    """Remove flows and boundary events whose ends are not in the same container."""
    for container in [*definitions.iter(etree.Element)]:
        if tag(container) == "collaboration":
            _keep_flows_between_pools(container, definitions)
        elif tag(container):
            _keep_within(container)


def _keep_within(container: Element) -> None:
    nodes = {name_of(each) for each in flow_nodes(container)}
    for event in [*children(container, "boundaryEvent")]:
        if referred_id(event.get("attachedToRef")) in nodes:
            nodes.add(name_of(event))
        else:
            container.remove(event)
    events = {name_of(each) for each in children(container, "boundaryEvent")}
    for flow in [*children(container, "sequenceFlow")]:
        ends = referred_id(flow.get("sourceRef")), referred_id(flow.get("targetRef"))
        if ends[0] not in nodes or ends[1] not in nodes - events:
            container.remove(flow)


def _keep_flows_between_pools(collaboration: Element, definitions: Element) -> None:
    pools = [*children(collaboration, "participant")]
    known = {name_of(each) for each in pools}
    shown = {referred_id(each.get("processRef")) for each in pools}
    for process in children(definitions, "process"):
        if name_of(process) in shown:
            known |= {name_of(each) for each in process.iter(etree.Element) if is_node(each)}
    for flow in [*children(collaboration, "messageFlow")]:
        if not {referred_id(flow.get("sourceRef")), referred_id(flow.get("targetRef"))} <= known:
            collaboration.remove(flow)
