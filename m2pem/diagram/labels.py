"""Draws the names that stand beside symbols and lines, and says where they are."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from m2pem.diagram.ink import PAPER, Ink
from m2pem.diagram.lines import along
from m2pem.diagram.picture import Bounds, Line, Point, Shape
from m2pem.diagram.svg import Group
from m2pem.diagram.text import LINE_HEIGHT, width_of, wrapped

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


@dataclass(frozen=True, slots=True)
class Label:
    """A name broken into `lines`; `top` is the middle of its upper edge."""

    lines: tuple[str, ...]
    top: Point

    @property
    def bounds(self) -> Bounds:
        """Where it is."""
        wide = max((width_of(line, SIZE) for line in self.lines), default=0.0)
        return Bounds(
            self.top[0] - wide / 2, self.top[1], wide, len(self.lines) * SIZE * LINE_HEIGHT
        )


def label_of(shape: Shape) -> Label:
    """A symbol's name: where the diagram says, else below it."""
    box = shape.bounds
    if shape.kind == "group":
        return _label(shape.name, (box.centre[0], box.y + 5), box.width - 10)
    if shape.label is not None:
        width = max(shape.label.width + 10, _WIDTH)
        return _label(shape.name, (shape.label.centre[0], shape.label.y), width)
    if shape.kind == "boundaryEvent":  # a flow leaves it downwards
        half = min(width_of(shape.name, SIZE), _WIDTH) / 2
        return _label(shape.name, (box.right + half - 6, box.bottom - 2), _WIDTH)
    return _label(shape.name, (box.centre[0], box.bottom + 5), _WIDTH)


def label_of_line(line: Line, points: Sequence[Point]) -> Label:
    """A flow's name: where the diagram says, else above its last level part."""
    if line.label is not None:
        width = max(line.label.width + 10, _WIDTH)
        return _label(line.name, (line.label.centre[0], line.label.y), width)
    start, end = _level_part(points)
    if abs(start[0] - end[0]) >= abs(start[1] - end[1]):
        width = min(_WIDTH, max(abs(start[0] - end[0]) - 10, 40.0))
        lines = wrapped(line.name, width, SIZE)
        x, y = (
            (start[0] + end[0]) / 2,
            (start[1] + end[1]) / 2 - 5 - len(lines) * SIZE * LINE_HEIGHT,
        )
        return Label(tuple(lines), (x, y))
    x, y = along(points[:2], 0.5)
    half = min(width_of(line.name, SIZE), _WIDTH) / 2
    return _label(line.name, (x + half + 5, y - SIZE / 2), _WIDTH)


def draw_label(to: Group, shape: Shape, ink: Ink) -> Bounds:
    """Draws a symbol's name, and says where it is."""
    return _put(to, label_of(shape), ink)


def draw_line_label(to: Group, line: Line, points: Sequence[Point], ink: Ink) -> Bounds:
    """Draws a flow's name, and says where it is."""
    return _put(to, label_of_line(line, points), ink)


def _level_part(points: Sequence[Point]) -> tuple[Point, Point]:
    """The last part that is level and has room; of flows that begin together, those differ."""
    for start, end in reversed([*pairwise(points)]):
        if start[1] == end[1] and abs(start[0] - end[0]) >= _LEAST_ROOM:
            return start, end
    return points[0], points[1]


def _label(text: str, top: Point, width: float) -> Label:
    return Label(tuple(wrapped(text, width, SIZE)), top)


def _put(to: Group, label: Label, ink: Ink) -> Bounds:
    """With a rim of paper around the letters, so that lines below do not hide them."""
    to.text(
        label.lines, *label.top, SIZE, fill=ink.text, stroke=PAPER,
        stroke_width=3, stroke_linejoin="round", paint_order="stroke",
    )  # fmt: skip
    return label.bounds
