"""Lays out one container: its grid becomes boxes, its flows become lines between them."""

from collections.abc import Container

from m2pem.diagram.layout import model
from m2pem.diagram.layout.grid import Link, arrange
from m2pem.diagram.layout.model import Block, Box, Element, LaneTree, name_of, tag
from m2pem.diagram.layout.routing import Router

_EVENT = 36
_SIZES = {"Event": (36, 36), "Gateway": (50, 50)}
_TASK = (100, 80)
_DATA_SIZES = {
    "dataObjectReference": (36, 50),
    "dataStoreReference": (50, 50),
    "textAnnotation": (100, 50),
}
LANE_HEADER = 30
_EMPTY_LANE = 120
_BOUNDARY_PITCH = 46


def lay_out(container: Element) -> Block:
    """The inside of a process or subprocess."""
    nodes = {name_of(node): node for node in model.flow_nodes(container)}
    surfaces = {name_of(each): each for each in model.children(container, *model.SURFACES)}
    boundary = model.boundary_events(container)
    host = {name_of(e): activity for activity, events in boundary.items() for e in events}
    for event, activity in host.items():
        if activity not in nodes:
            raise ValueError(f"{event} is attached to {activity!r}, which is not beside it")
    links = _links(container, nodes, host)
    lanes = model.lanes(container)
    grid = arrange([*nodes], links, {n: k for n, k in lanes.of_node.items() if n in nodes})
    ties = _ties(container, {**nodes, **host, **surfaces}, surfaces)
    bottom = max(grid.rows, 1)
    taken: set[int] = set()
    for surface in surfaces:
        column = next((grid.cells[host.get(n, n)][0] for s, n in ties.values() if s == surface), 0)
        while column in taken:
            column += 1
        taken.add(column)
        grid.cells[surface] = (column, bottom)

    inner = {name: lay_out(e) for name, e in nodes.items() if tag(e) in model.SUBPROCESSES}
    sizes = {name: _size(e, inner.get(name), boundary.get(name, [])) for name, e in nodes.items()}
    sizes |= {name: _DATA_SIZES[tag(e)] for name, e in surfaces.items()}
    router = Router(grid, sizes)
    for link in links:
        router.add(link)
    for name, (surface, node) in ties.items():
        router.tie(name, host.get(node, node), surface)

    block = Block()
    block.width, block.height = router.size()
    for name in [*nodes, *surfaces]:
        x, y = router.corner(name)
        width, height = sizes[name]
        block.boxes[name] = Box(x, y, width, height, expanded=name in inner)
        if name in inner:
            block.put(inner[name], x, y)
        attached = boundary.get(name, [])
        for number, each in enumerate(attached, 1):
            centre = x + width * number / (len(attached) + 1)
            block.boxes[name_of(each)] = Box(
                centre - _EVENT / 2, y + height - _EVENT / 2, _EVENT, _EVENT
            )
    block.lines |= router.lines(block.boxes, reverse=_reversed(container, surfaces))
    bands = [router.band(first, last) for first, last in grid.lane_rows]
    return _in_lanes(block, lanes, bands) if lanes.leaves else block


def _in_lanes(block: Block, lanes: LaneTree, bands: list[tuple[float, float]]) -> Block:
    """With the lanes below it; inner ones are in the outer ones, beside these' names."""
    names = LANE_HEADER * max(lanes.depth.values())
    ends = dict(zip(lanes.leaves, bands, strict=False))
    below = block.height
    for lane in lanes.leaves[len(bands) :]:
        ends[lane] = (below, below + _EMPTY_LANE)
        below += _EMPTY_LANE
    if bands:
        last = lanes.leaves[min(len(bands), len(lanes.leaves)) - 1]
        ends[last] = (ends[last][0], block.height)
    found = Block(block.width + names, below)
    for lane, depth in lanes.depth.items():
        leaves = lanes.within[lane]
        x, top = LANE_HEADER * depth, ends[leaves[0]][0]
        height = ends[leaves[-1]][1] - top
        found.boxes[lane] = Box(x, top, found.width - x, height, horizontal=True)
    found.put(block, names, 0)
    return found


def _links(container: Element, nodes: dict[str, Element], host: dict[str, str]) -> list[Link]:
    found = []
    lines = [*model.children(container, "sequenceFlow")]
    lines += [
        a
        for a in model.children(container, "association")
        if model.referred_id(a.get("sourceRef")) in host
    ]
    for line in lines:
        source, target = (
            model.referred_id(line.get("sourceRef")),
            model.referred_id(line.get("targetRef")),
        )
        if target not in nodes:
            if tag(line) == "association":
                continue
            raise ValueError(f"{name_of(line)} leads to {target!r}, which is not beside it")
        if source not in nodes and source not in host:
            raise ValueError(f"{name_of(line)} comes from {source!r}, which is not beside it")
        found.append(Link(name_of(line), source, target, host.get(source, source)))
    return found


def _ties(
    container: Element, here: Container[str], surfaces: Container[str]
) -> dict[str, tuple[str, str]]:
    """Lines between a node and a data object or annotation of the same container."""
    lines = [*model.data_lines(container)]
    lines += [
        (name_of(a), model.referred_id(a.get("sourceRef")), model.referred_id(a.get("targetRef")))
        for a in model.children(container, "association")
    ]
    found = {}
    for name, source, target in lines:
        if source in here and target in here and (source in surfaces) != (target in surfaces):
            found[name] = (source, target) if source in surfaces else (target, source)
    return found


def _reversed(container: Element, surfaces: Container[str]) -> set[str]:
    """The ties that lead from the data object to the node."""
    found = {name for name, source, _ in model.data_lines(container) if source in surfaces}
    associations = model.children(container, "association")
    return found | {
        name_of(a) for a in associations if model.referred_id(a.get("sourceRef")) in surfaces
    }


def _size(node: Element, inner: Block | None, events: list[Element]) -> tuple[float, float]:
    name = tag(node)
    for ending, size in _SIZES.items():
        if name.endswith(ending):
            return size
    wide = _BOUNDARY_PITCH * len(events) + 10
    if inner is not None:
        return max(inner.width, wide, _TASK[0]), max(inner.height, _TASK[1])
    return max(_TASK[0], wide), _TASK[1]
