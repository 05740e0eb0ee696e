"""A container that is laid out: where its symbols are and how its lines run."""

from dataclasses import dataclass, field

Point = tuple[float, float]


@dataclass(slots=True)
class Box:
    """In the diagram's units; y grows downwards."""

    x: float
    y: float
    width: float
    height: float
    expanded: bool | None = None
    horizontal: bool = False

    @property
    def middle(self) -> Point:
        """Its centre."""
        return (self.x + self.width / 2, self.y + self.height / 2)

    @property
    def right(self) -> float:
        """Its right side."""
        return self.x + self.width

    @property
    def bottom(self) -> float:
        """Its lower side."""
        return self.y + self.height


@dataclass(slots=True)
class Block:
    """Everything within a rectangle whose corner is at 0, 0."""

    width: float = 0
    height: float = 0
    boxes: dict[str, Box] = field(default_factory=dict)
    lines: dict[str, list[Point]] = field(default_factory=dict)

    def put(self, other: "Block", x: float, y: float) -> None:
        """Take in all that is in `other`, moved by that much."""
        for name, box in other.boxes.items():
            box.x += x
            box.y += y
            self.boxes[name] = box
        for name, points in other.lines.items():
            self.lines[name] = [(px + x, py + y) for px, py in points]
