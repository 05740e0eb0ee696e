"""Draws the names that stand beside symbols and lines, and says where they are."""

from collections.abc import Sequence
from itertools import pairwise

from m2pem.drawing.ink import PAPER, Ink
from m2pem.drawing.lines import along
from m2pem.drawing.picture import Bounds, Line, Point, Shape
from m2pem.drawing.svg import Group
from m2pem.drawing.text import LINE_HEIGHT, width_of, wrapped

SIZE = 11
_WIDTH = 90.0
_LEAST_ROOM = 24.0
_BESIDE = (
    "Event",
    "Gateway",
    "dataObjectReference",
    "dataStoreReference",
    "dataInput",
    "dataOutput",
)


def has_label(shape: Shape) -> bool:
    """Whether its name stands beside it."""
    return bool(shape.name) and (shape.kind.endswith(_BESIDE) or shape.kind == "group")


def draw_label(to: Group, shape: Shape, ink: Ink) -> Bounds:
    """A symbol's name: where the diagram says, else below it."""
    box = shape.bounds
    if shape.kind == "group":
        return _put(to, shape.name, (box.centre[0], box.y + 5), box.width - 10, ink)
    if shape.label is not None:
        width = max(shape.label.width + 10, _WIDTH)
        return _put(to, shape.name, (shape.label.centre[0], shape.label.y), width, ink)
    if shape.kind == "boundaryEvent":  # a flow leaves it downwards
        half = min(width_of(shape.name, SIZE), _WIDTH) / 2
        return _put(to, shape.name, (box.right + half - 6, box.bottom - 2), _WIDTH, ink)
    return _put(to, shape.name, (box.centre[0], box.bottom + 5), _WIDTH, ink)


def draw_line_label(to: Group, line: Line, points: Sequence[Point], ink: Ink) -> Bounds:
    """A flow's name: where the diagram says, else above its last level part."""
    if line.label is not None:
        width = max(line.label.width + 10, _WIDTH)
        return _put(to, line.name, (line.label.centre[0], line.label.y), width, ink)
    start, end = _level_part(points)
    if abs(start[0] - end[0]) >= abs(start[1] - end[1]):
        width = min(_WIDTH, max(abs(start[0] - end[0]) - 10, 40.0))
        lines = wrapped(line.name, width, SIZE)
        x, y = (
            (start[0] + end[0]) / 2,
            (start[1] + end[1]) / 2 - 5 - len(lines) * SIZE * LINE_HEIGHT,
        )
        return _put(to, line.name, (x, y), width, ink)
    x, y = along(points[:2], 0.5)
    half = min(width_of(line.name, SIZE), _WIDTH) / 2
    return _put(to, line.name, (x + half + 5, y - SIZE / 2), _WIDTH, ink)


def _level_part(points: Sequence[Point]) -> tuple[Point, Point]:
    """The last part that is level and has room; of flows that begin together, those differ."""
    for start, end in reversed([*pairwise(points)]):
        if start[1] == end[1] and abs(start[0] - end[0]) >= _LEAST_ROOM:
            return start, end
    return points[0], points[1]


def _put(to: Group, text: str, top: Point, width: float, ink: Ink) -> Bounds:
    """With a rim of paper around the letters, so that lines below do not hide them.

    Says where the text is.
    """
    lines = wrapped(text, width, SIZE)
    to.text(
        lines, top[0], top[1], SIZE, fill=ink.text, stroke=PAPER,
        stroke_width=3, stroke_linejoin="round", paint_order="stroke",
    )  # fmt: skip
    wide = max((width_of(line, SIZE) for line in lines), default=0.0)
    return Bounds(top[0] - wide / 2, top[1], wide, len(lines) * SIZE * LINE_HEIGHT)
