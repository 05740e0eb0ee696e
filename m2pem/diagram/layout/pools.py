"""Lays out a whole file: one process, or a collaboration's pools one below the other."""

from m2pem.diagram.layout import model
from m2pem.diagram.layout.block import Block, Box, Point
from m2pem.diagram.layout.model import Element, local, name_of, tag
from m2pem.diagram.layout.place import lay_out

_HEADER = 30
_CLOSED = 60  # the height of a pool that shows no process
_BETWEEN = 40
_TRACK = 10
_LEAST_WIDTH = 300


def lay_out_file(definitions: Element) -> Block:
    """Everything, with the corner of the paper at 0, 0.

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
        process = local(pool.get("processRef"))
        if process in processes and process not in shown:
            shown.add(process)
            insides[name_of(pool)] = lay_out(processes[process])
    width = max([_LEAST_WIDTH, *(inside.width for inside in insides.values())])
    flows = [*model.children(collaboration, "messageFlow")]
    between = _BETWEEN + _TRACK * len(flows)
    block = Block(width=width + _HEADER)
    for pool in pools:
        inside = insides.get(name_of(pool))
        lanes = [] if inside is None else _lanes(processes[local(pool.get("processRef"))])
        for lane in lanes:
            assert inside is not None
            inside.boxes[lane].width = width - inside.boxes[lane].x
        height = max(inside.height if inside is not None else 0, _CLOSED)
        block.boxes[name_of(pool)] = Box(0, block.height, block.width, height, horizontal=True)
        if inside is not None:
            block.put(inside, _HEADER, block.height)
        block.height += height + between
    block.height -= between
    for number, flow in enumerate(flows):
        block.lines[name_of(flow)] = _message(flow, number, block, pools)
    return block


def _lanes(process: Element) -> list[str]:
    return [*model.lanes(process).depth]


def _message(flow: Element, number: int, block: Block, pools: list[Element]) -> list[Point]:
    source, target = local(flow.get("sourceRef")), local(flow.get("targetRef"))
    for end in (source, target):
        if end not in block.boxes:
            raise ValueError(f"{name_of(flow)}: nothing drawn is called {end!r}")
    a, b = block.boxes[source], block.boxes[target]
    closed = {name_of(pool) for pool in pools if tag(pool) == "participant"}
    shift = _TRACK * (number % 3 - 1)
    x1 = (b if source in closed else a).middle[0] + shift
    x2 = (a if target in closed else b).middle[0] + shift
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
