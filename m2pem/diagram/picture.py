"""What a drawing has in it: symbols and lines, where they are, and what they look like.

Lengths are the diagram's own units, drawn as pixels; y goes down. `id` is the BPMN element's.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeAlias

Point: TypeAlias = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Bounds:
    """A rectangle with its sides upright."""

    x: float
    y: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """Where it ends, to the right."""
        return self.x + self.width

    @property
    def bottom(self) -> float:
        """Where it ends, below."""
        return self.y + self.height

    @property
    def centre(self) -> Point:
        """Its middle."""
        return self.x + self.width / 2, self.y + self.height / 2

    def holds(self, point: Point) -> bool:
        """Whether a point is in it or on its edge."""
        return self.x <= point[0] <= self.right and self.y <= point[1] <= self.bottom


class Trait(StrEnum):
    """What else a symbol or a line shows."""

    EXPANDED = "expanded"
    """Of a subprocess or pool: its inside is in the same drawing."""
    VERTICAL = "vertical"
    """Of a pool or lane: its name is at the top."""
    THROWING = "throwing"
    NON_INTERRUPTING = "non-interrupting"
    PARALLEL_MULTIPLE = "parallel multiple"
    LOOP = "loop"
    PARALLEL_INSTANCES = "parallel instances"
    SEQUENTIAL_INSTANCES = "sequential instances"
    COMPENSATION = "compensation"
    EVENT_SUBPROCESS = "event subprocess"
    MARKED = "marked"
    """Of an exclusive gateway: with its cross."""
    INSTANTIATING = "instantiating"
    PARALLEL = "parallel"
    """Of an event-based gateway that begins a process: all events must come."""
    COLLECTION = "collection"
    INPUT = "input"
    OUTPUT = "output"
    CONDITIONAL = "conditional"
    """Of a flow out of an activity: only when its condition is true."""
    DEFAULT = "default"
    DIRECTED = "directed"
    """Of an association: with an arrow head."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A symbol. `kind` is the element's BPMN tag; `definitions` those of an event."""

    id: str
    kind: str
    name: str
    bounds: Bounds
    label: Bounds | None = None
    definitions: tuple[str, ...] = ()
    traits: frozenset[Trait] = frozenset()


@dataclass(frozen=True, slots=True)
class Line:
    """A flow or association along `points`."""

    id: str
    kind: str
    name: str
    points: tuple[Point, ...]
    source: str = ""
    target: str = ""
    label: Bounds | None = None
    traits: frozenset[Trait] = frozenset()


@dataclass(frozen=True, slots=True)
class Picture:
    """One plane of a diagram. Shapes are in the order in which they are painted.

    `parents`: by element of the file, drawn or not, the one that contains it.
    """

    title: str
    shapes: tuple[Shape, ...]
    lines: tuple[Line, ...]
    parents: Mapping[str, str] = field(default_factory=dict)

    def box(self) -> Bounds:
        """Return the rectangle around all shapes, lines and labels."""
        boxes = [shape.bounds for shape in self.shapes]
        labels = [each.label for each in self.shapes] + [each.label for each in self.lines]
        boxes += [label for label in labels if label is not None]
        points = [point for line in self.lines for point in line.points]
        xs = [x for x, _ in points] + [x for b in boxes for x in (b.x, b.right)]
        ys = [y for _, y in points] + [y for b in boxes for y in (b.y, b.bottom)]
        if not xs:
            return Bounds(0, 0, 0, 0)
        return Bounds(min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys))
