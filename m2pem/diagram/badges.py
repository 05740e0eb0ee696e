"""Numbers of steps, and tokens, on a drawing: small signs that cover no name and not each other."""

from collections.abc import Iterable, Mapping, Sequence

from m2pem.diagram.ink import PAPER, WAITS, Ink
from m2pem.diagram.lines import along
from m2pem.diagram.marks import Marks, numbered
from m2pem.diagram.picture import Bounds, Point, Shape
from m2pem.diagram.svg import Group
from m2pem.diagram.text import width_of

_SIZE = 10.5
_HEIGHT = 16.0
_TOKEN = 6.0
_ON_LINES = (0.45, 0.3, 0.6, 0.75, 0.15)
"""Where on a flow a number may stand, as parts of its length, the best first."""
_WAITING_ON_LINE = 0.85
_AT_SHAPES = ((0.0, 0.0), (0.0, 1.0), (0.25, 0.0), (0.0, 0.4))
"""Where at a symbol, as parts of its width and height."""


class Badges:
    """Draws the signs. `names`: where texts are."""

    def __init__(self, to: Group, names: Iterable[Bounds]) -> None:
        self.to = to
        self.taken = [*names]

    def paint(
        self, marks: Marks, shapes: Mapping[str, Shape], points: Mapping[str, Sequence[Point]]
    ) -> None:
        """All of them."""
        inks = marks.inks()
        for name in sorted(marks.tokens):
            ink = inks.get(name, WAITS)
            if name in shapes:
                box = shapes[name].bounds
                self._token((box.right - box.width * 0.08, box.y + 2), ink)
            elif name in points:
                self._token(along(points[name], _WAITING_ON_LINE), ink)
        for name, steps in marks.numbers().items():
            if name in shapes:
                box = shapes[name].bounds
                places = [
                    (box.x + box.width * dx, box.y + box.height * dy) for dx, dy in _AT_SHAPES
                ]
                self._number(places, numbered(steps), inks[name])
            elif name in points:
                places = [along(points[name], part) for part in _ON_LINES]
                self._number(places, numbered(steps), inks[name])

    def _token(self, at: Point, ink: Ink) -> None:
        self.to.circle(*at, _TOKEN, fill=ink.stroke, stroke=PAPER, stroke_width=1.5)
        self.taken.append(_around(at, 2 * _TOKEN, 2 * _TOKEN))

    def _number(self, places: Sequence[Point], text: str, ink: Ink) -> None:
        width = max(width_of(text, _SIZE) + 9, _HEIGHT)
        boxes = [_around(at, width, _HEIGHT) for at in places]
        free = (box for box in boxes if not any(_touch(box, each) for each in self.taken))
        box = next(free, boxes[0])
        self.taken.append(box)
        badge = self.to.group((box.x, box.y), f"step {text}")
        badge.rectangle(0, 0, width, _HEIGHT, rx=8, fill=ink.stroke, stroke=PAPER)
        badge.text([text], width / 2, 2.2, _SIZE, fill=PAPER, font_weight="bold")


def _around(at: Point, width: float, height: float) -> Bounds:
    return Bounds(at[0] - width / 2, at[1] - height / 2, width, height)


def _touch(a: Bounds, b: Bounds) -> bool:
    return a.x < b.right and b.x < a.right and a.y < b.bottom and b.y < a.bottom
