"""Draws edges (flows and associations), and the labels of symbols and edges."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from m2pem.diagram.picture import Bounds, Line, Point, Shape, Trait
from m2pem.diagram.style import BACKGROUND, LINE_HEIGHT, Style, width_of, wrapped
from m2pem.diagram.svg import Attributes, Group, number

_ROUND = 5.0
_DASHES = {
    "messageFlow": "10 6",
    "association": "1 5",
    "dataInputAssociation": "1 5",
    "dataOutputAssociation": "1 5",
}
_CLOSE_ENOUGH = 0.25


def draw_line(
    to: Group, line: Line, points: Sequence[Point], style: Style, dashes: str = ""
) -> None:
    """A line along `points` with what stands at its ends. `dashes`: instead of its kind's own."""
    dashes = dashes or _DASHES.get(line.kind, "")
    attributes: Attributes = {
        "stroke": style.stroke,
        "fill": "none",
        "stroke_width": 1.6 + style.weight,
    }
    if dashes:
        attributes["stroke_dasharray"] = dashes
    if dashes.startswith("1 "):
        attributes["stroke_linecap"] = "round"
    to.path(_rounded(points), stroke_linejoin="round", **attributes)
    before, end = points[-2], points[-1]
    if line.kind == "sequenceFlow":
        _head(to, before, end, style.stroke, style.stroke)
    elif line.kind == "messageFlow":
        _head(to, before, end, style.stroke, BACKGROUND)
        to.circle(*points[0], 4, stroke=style.stroke, fill=BACKGROUND, stroke_width=1.4)
    elif line.kind != "association" or Trait.DIRECTED in line.traits:
        _open_head(to, before, end, style.stroke)
    if Trait.DEFAULT in line.traits:
        _slash(to, points[0], points[1], style)
    if Trait.CONDITIONAL in line.traits:
        _diamond(to, points[0], points[1], style.stroke)


def docked(line: Line, shapes: Mapping[str, Shape]) -> tuple[Point, ...]:
    """The line's points, from edge to edge: some editors draw to the middle of symbols."""
    points = [*line.points]
    source, target = shapes.get(line.source), shapes.get(line.target)
    if source is not None:
        points = _out_of(points, source)
    if target is not None:
        points = _out_of(points[::-1], target)[::-1]
    return tuple(points)


def _out_of(points: list[Point], shape: Shape) -> list[Point]:
    if not _inside(shape, points[0]):
        return points
    while len(points) > 2 and _inside(shape, points[1]):
        points = points[1:]
    (x1, y1), (x2, y2) = points[0], points[1]
    if _inside(shape, (x2, y2)):
        return points
    low, high = 0.0, 1.0
    while (high - low) * math.dist(points[0], points[1]) > _CLOSE_ENOUGH:
        middle = (low + high) / 2
        at = (x1 + (x2 - x1) * middle, y1 + (y2 - y1) * middle)
        low, high = (middle, high) if _inside(shape, at) else (low, middle)
    return [(x1 + (x2 - x1) * high, y1 + (y2 - y1) * high), *points[1:]]


def _inside(shape: Shape, point: Point) -> bool:
    """Whether a point is well within a symbol."""
    box = shape.bounds
    (x, y), (px, py) = box.centre, point
    dx, dy = abs(px - x), abs(py - y)
    if shape.kind.endswith("Event"):
        return math.hypot(dx, dy) < min(box.width, box.height) / 2 - 1
    if shape.kind.endswith("Gateway"):
        return dx / max(box.width, 1) + dy / max(box.height, 1) < 0.5 - 1 / max(box.width, 2)
    return dx < box.width / 2 - 1 and dy < box.height / 2 - 1


def along(points: Sequence[Point], part: float) -> Point:
    """The point at a part, 0 to 1, of the line's length."""
    rest = part * sum(math.dist(a, b) for a, b in pairwise(points))
    for a, b in pairwise(points):
        step = math.dist(a, b)
        if step and rest <= step:
            return a[0] + (b[0] - a[0]) * rest / step, a[1] + (b[1] - a[1]) * rest / step
        rest -= step
    return points[-1]


def _rounded(points: Sequence[Point]) -> str:
    parts = [f"M{_at(points[0])}"]
    for before, corner, after in zip(points, points[1:], points[2:], strict=False):
        cut = min(_ROUND, math.dist(before, corner) / 2, math.dist(corner, after) / 2)
        start, end = _towards(corner, before, cut), _towards(corner, after, cut)
        parts.append(f"L{_at(start)}Q{_at(corner)} {_at(end)}")
    return "".join([*parts, f"L{_at(points[-1])}"])


def _at(point: Point) -> str:
    return f"{number(point[0])} {number(point[1])}"


def _towards(a: Point, b: Point, length: float) -> Point:
    whole = math.dist(a, b)
    if not whole:
        return a
    return a[0] + (b[0] - a[0]) * length / whole, a[1] + (b[1] - a[1]) * length / whole


def _turned(at: Point, towards: Point, corners: Iterable[Point]) -> list[Point]:
    """Corners given with the line coming from the left, turned to where it comes from."""
    a = math.atan2(towards[1] - at[1], towards[0] - at[0])
    return [
        (at[0] + x * math.cos(a) - y * math.sin(a), at[1] + x * math.sin(a) + y * math.cos(a))
        for x, y in corners
    ]


def _head(to: Group, before: Point, end: Point, stroke: str, fill: str) -> None:
    back = _towards(end, before, 1.0)
    corners = _turned(back, end, [(-9.5, -4.2), (0.8, 0), (-9.5, 4.2)])
    to.polygon(corners, stroke=stroke, fill=fill, stroke_width=1.1, stroke_linejoin="round")


def _open_head(to: Group, before: Point, end: Point, stroke: str) -> None:
    a, b, c = _turned(end, _towards(end, before, -5), [(-8, -4.5), (0, 0), (-8, 4.5)])
    to.path(f"M{_at(a)}L{_at(b)}L{_at(c)}", stroke=stroke, fill="none", stroke_width=1.5)


def _slash(to: Group, start: Point, towards: Point, style: Style) -> None:
    a, b = _turned(_towards(start, towards, 9), towards, [(2.5, -5), (-2.5, 5)])
    to.path(f"M{_at(a)}L{_at(b)}", stroke=style.stroke, stroke_width=1.6 + style.weight)


def _diamond(to: Group, start: Point, towards: Point, stroke: str) -> None:
    corners = _turned(start, towards, [(0, 0), (8, -4.5), (16, 0), (8, 4.5)])
    to.polygon(corners, stroke=stroke, fill=BACKGROUND, stroke_width=1.2)


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


def _level_part(points: Sequence[Point]) -> tuple[Point, Point]:
    """The last part that is level and has room; of flows that begin together, those differ."""
    for start, end in reversed([*pairwise(points)]):
        if start[1] == end[1] and abs(start[0] - end[0]) >= _LEAST_ROOM:
            return start, end
    return points[0], points[1]


def _label(text: str, top: Point, width: float) -> Label:
    return Label(tuple(wrapped(text, width, SIZE)), top)


def draw_label(to: Group, label: Label, style: Style) -> Bounds:
    """Write a label with a background-coloured outline, so that lines below do not hide it, and
    say where it is."""
    to.text(
        label.lines, *label.top, SIZE, fill=style.text, stroke=BACKGROUND,
        stroke_width=3, stroke_linejoin="round", paint_order="stroke",
    )  # fmt: skip
    return label.bounds
