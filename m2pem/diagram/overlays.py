"""What a drawing points out: a run's path, what is stuck, what is never reached."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from m2pem.diagram.edges import along
from m2pem.diagram.picture import Bounds, Picture, Point, Shape
from m2pem.diagram.style import (
    BACKGROUND,
    IS_STUCK,
    ON_PATH,
    PLAIN,
    UNREACHED,
    WAITS,
    Style,
    width_of,
)
from m2pem.diagram.svg import Group


@dataclass(frozen=True, slots=True)
class Overlays:
    """What to point out, by ids of elements and flows.

    `steps`: by step of a run, numbered from 1, what it passes; the number stands at the first of
    them. `stuck`: where something is wrong, and `waiting`: where else a token stands at the end,
    both with a reason that is shown as a tooltip. `tokens`: where a token is
    drawn. `missing`: flows on which a token is waited for
    that never comes. `unreached`: what no run gets to.
    """

    steps: Sequence[Sequence[str]] = ()
    stuck: Mapping[str, str] = field(default_factory=dict)
    waiting: Mapping[str, str] = field(default_factory=dict)
    tokens: frozenset[str] = frozenset()
    missing: frozenset[str] = frozenset()
    unreached: frozenset[str] = frozenset()

    def on(self, drawn: frozenset[str], parents: Mapping[str, str]) -> "Overlays":
        """The same for a file in which only some is drawn: an inside counts for its outside."""

        def at(name: str) -> str:
            while name not in drawn and name in parents:
                name = parents[name]
            return name

        def moved(marked: Mapping[str, str]) -> dict[str, str]:
            found: dict[str, str] = {}
            for name, reason in marked.items():
                known = found.get(at(name))
                found[at(name)] = f"{known}\n{reason}" if known else reason
            return found

        return Overlays(
            [list(dict.fromkeys(at(name) for name in step)) for step in self.steps],
            moved(self.stuck),
            moved(self.waiting),
            frozenset(at(name) for name in self.tokens),
            self.missing & drawn,
            self.unreached & drawn,
        )

    def numbers(self) -> dict[str, list[int]]:
        """By element, the steps whose number stands at it."""
        found: dict[str, list[int]] = {}
        for number, step in enumerate(self.steps, 1):
            if step:
                found.setdefault(step[0], []).append(number)
        return found

    def styles(self) -> dict[str, Style]:
        """Return the style of each element that is pointed out."""
        found: dict[str, Style] = {}
        groups: Iterable[tuple[Iterable[str], Style]] = (
            (self.unreached, UNREACHED),
            ((name for step in self.steps for name in step), ON_PATH),
            (self.waiting, WAITS),
            (self.missing, IS_STUCK),
            (self.stuck, IS_STUCK),
        )
        for names, style in groups:
            found |= dict.fromkeys(names, style)
        return found

    def legend(self) -> list[tuple[Style, str]]:
        """Return the entries of the legend: styles and what they mean."""
        meant = (
            (any(self.steps), ON_PATH, "the run, step by step"),
            (bool(self.stuck), IS_STUCK, "what is wrong, and where"),
            (bool(self.waiting), WAITS, "other tokens at that moment"),
            (bool(self.unreached), UNREACHED, "never reached"),
        )
        shown = [(style, words) for there, style, words in meant if there]
        return [*shown, (PLAIN, "not in this run")] if any(self.steps) else shown


def ids_of(picture: Picture) -> frozenset[str]:
    """Return the ids of all shapes and lines of a picture."""
    shapes = {shape.id for shape in picture.shapes}
    return frozenset(shapes | {line.id for line in picture.lines})


def numbered(numbers: Sequence[int], most: int = 4) -> str:
    """Steps as a short text: the first ones, if they are many."""
    if len(numbers) > most:
        return ", ".join(map(str, numbers[: most - 1])) + ", \u2026"
    return ", ".join(map(str, numbers))


_SIZE = 10.5
_HEIGHT = 16.0
_TOKEN = 6.0
_ON_LINES = (0.45, 0.3, 0.6, 0.75, 0.15)
"""Where on a flow a number may stand, as parts of its length, the best first."""
_WAITING_ON_LINE = 0.85
_AT_SHAPES = ((0.0, 0.0), (0.0, 1.0), (0.25, 0.0), (0.0, 0.4))
"""Where at a symbol, as parts of its width and height."""


class Badges:
    """Draws numbers of steps, and tokens. `names`: where texts are, which they do not cover."""

    def __init__(self, to: Group, names: Iterable[Bounds]) -> None:
        self.to = to
        self.taken = [*names]

    def paint(
        self, overlays: Overlays, shapes: Mapping[str, Shape], points: Mapping[str, Sequence[Point]]
    ) -> None:
        """Draw the tokens and the numbers of steps."""
        styles = overlays.styles()
        for name in sorted(overlays.tokens):
            style = styles.get(name, WAITS)
            if name in shapes:
                box = shapes[name].bounds
                self._token((box.right - box.width * 0.08, box.y + 2), style)
            elif name in points:
                self._token(along(points[name], _WAITING_ON_LINE), style)
        for name, steps in overlays.numbers().items():
            if name in shapes:
                box = shapes[name].bounds
                places = [
                    (box.x + box.width * dx, box.y + box.height * dy) for dx, dy in _AT_SHAPES
                ]
                self._number(places, numbered(steps), styles[name])
            elif name in points:
                places = [along(points[name], part) for part in _ON_LINES]
                self._number(places, numbered(steps), styles[name])

    def _token(self, at: Point, style: Style) -> None:
        self.to.circle(*at, _TOKEN, fill=style.stroke, stroke=BACKGROUND, stroke_width=1.5)
        self.taken.append(_around(at, 2 * _TOKEN, 2 * _TOKEN))

    def _number(self, places: Sequence[Point], text: str, style: Style) -> None:
        width = max(width_of(text, _SIZE) + 9, _HEIGHT)
        boxes = [_around(at, width, _HEIGHT) for at in places]
        free = (box for box in boxes if not any(_touch(box, each) for each in self.taken))
        box = next(free, boxes[0])
        self.taken.append(box)
        badge = self.to.group((box.x, box.y), f"step {text}")
        badge.rectangle(0, 0, width, _HEIGHT, rx=8, fill=style.stroke, stroke=BACKGROUND)
        badge.text([text], width / 2, 2.2, _SIZE, fill=BACKGROUND, font_weight="bold")


def _around(at: Point, width: float, height: float) -> Bounds:
    return Bounds(at[0] - width / 2, at[1] - height / 2, width, height)


def _touch(a: Bounds, b: Bounds) -> bool:
    return a.x < b.right and b.x < a.right and a.y < b.bottom and b.y < a.bottom
