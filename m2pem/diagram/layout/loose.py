"""Lines whose ends a layout has placed far from each other: straight from one to the other."""

from collections.abc import Iterator

from m2pem.diagram.layout.block import Block, Box, Point
from m2pem.diagram.layout.model import Element, children, data_lines, is_node, local, name_of, tag

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
        yield name_of(line), local(line.get("sourceRef")), local(line.get("targetRef"))
    for inner in within:
        if is_node(inner) and tag(inner).lower().endswith(("process", "transaction")):
            yield from _lines(inner)


def _middle(block: Block, name: str) -> Point | None:
    if name in block.boxes:
        return block.boxes[name].middle
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
