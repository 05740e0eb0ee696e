"""Lines that cross no symbol: they run in the gaps between the grid's columns and rows.

Every line has tracks of its own in the gaps that it uses, so that no two run on top of each other.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from m2pem.diagram.layout.grid import Grid, Link
from m2pem.diagram.layout.model import Box
from m2pem.diagram.picture import Point

_TRACK = 10
_GAP = 40  # a gap without a line
_FIRST = 26  # from a row's lower end to its first track: boundary events hang that far down


@dataclass(slots=True)
class _Gaps:
    """Tracks in the gaps before each column (or row) and after the last."""

    used: dict[int, list[str]] = field(default_factory=dict)

    def take(self, gap: int, line: str) -> None:
        self.used.setdefault(gap, []).append(line)

    def width(self, gap: int) -> float:
        return _GAP + _TRACK * len(self.used.get(gap, ()))

    def track(self, gap: int, line: str) -> float:
        return _FIRST + _TRACK * self.used[gap].index(line)


@dataclass(frozen=True, slots=True)
class _Tie:
    node: str
    surface: str


class Router:
    """Say first what lines there are, then ask where all is."""

    def __init__(self, grid: Grid, sizes: Mapping[str, tuple[float, float]]) -> None:
        self._grid = grid
        self._links: list[Link] = []
        self._ties: dict[str, _Tie] = {}
        self._columns, self._rows = _Gaps(), _Gaps()
        self._widths = [0.0] * grid.columns
        self._heights = [0.0] * grid.rows
        for name, (column, row) in grid.cells.items():
            width, height = sizes[name]
            self._widths[column] = max(self._widths[column], width)
            self._heights[row] = max(self._heights[row], height)
        self._sizes = sizes

    def add(self, link: Link) -> None:
        """Add a flow to be routed."""
        self._links.append(link)
        column, row = self._grid.cells[link.at]
        if link.below:
            self._rows.take(row + 1, link.id)
        if link.id in self._grid.back:
            self._rows.take(0, link.id)
            self._columns.take(column + 1, link.id)
            self._columns.take(self._grid.cells[link.target][0], link.id)
            return
        rows = [-1 if link.below else row, *self._grid.ways[link.id]]
        rows.append(self._grid.cells[link.target][1])
        for step, (before, after) in enumerate(pairwise(rows), column + 1):
            if before != after:
                self._columns.take(step, link.id)

    def tie(self, name: str, node: str, surface: str) -> None:
        """A line between a node and something in the lowest row."""
        self._ties[name] = _Tie(node, surface)
        column, row = self._grid.cells[node]
        self._rows.take(row + 1, name)
        if self._grid.cells[surface][1] != row + 1:
            self._columns.take(column + 1, name)
            self._rows.take(self._grid.cells[surface][1], name)

    # --- where things are -----------------------------------------------------------------------

    def size(self) -> tuple[float, float]:
        """Return width and height of the whole layout."""
        return self._left(self._grid.columns), self._top(self._grid.rows)

    def corner(self, name: str) -> Point:
        """Return the upper left corner of a symbol."""
        column, row = self._grid.cells[name]
        width, height = self._sizes[name]
        return (
            self._left(column) + (self._widths[column] - width) / 2,
            self._top(row) + (self._heights[row] - height) / 2,
        )

    def band(self, first: int, last: int) -> tuple[float, float]:
        """Upper and lower end of these rows, each with half of the gap around it."""
        top = 0 if first == 0 else self._top(first) - self._rows.width(first) / 2
        return top, self._top(last) - (self._rows.width(last) / 2 if last < self._grid.rows else 0)

    def _left(self, column: int) -> float:
        """Where the column begins; of the one after the last, where the container ends."""
        gaps = sum(self._columns.width(gap) for gap in range(column + 1))
        return gaps + sum(self._widths[:column])

    def _top(self, row: int) -> float:
        gaps = sum(self._rows.width(gap) for gap in range(row + 1))
        return gaps + sum(self._heights[:row])

    def _x(self, gap: int, line: str) -> float:
        return self._left(gap) - self._columns.width(gap) + self._columns.track(gap, line) - 6

    def _y(self, gap: int, line: str) -> float:
        return self._top(gap) - self._rows.width(gap) + self._rows.track(gap, line)

    def _centre(self, row: int) -> float:
        return self._top(row) + self._heights[row] / 2

    # --- lines ----------------------------------------------------------------------------------

    def lines(self, boxes: Mapping[str, Box], *, reverse: set[str]) -> dict[str, list[Point]]:
        """The points of every line; those in `reverse` begin at the surface."""
        found = {link.id: self._flow(link, boxes) for link in self._links}
        for name, tie in self._ties.items():
            points = self._tied(name, tie, boxes)
            found[name] = points[::-1] if name in reverse else points
        return {name: _without_bends(points) for name, points in found.items()}

    def _flow(self, link: Link, boxes: Mapping[str, Box]) -> list[Point]:
        column, row = self._grid.cells[link.at]
        source, target = boxes[link.source], boxes[link.target]
        if link.below:
            y = self._y(row + 1, link.id)
            points = [(source.centre[0], source.bottom), (source.centre[0], y)]
        else:
            y = source.centre[1]
            points = [(source.right, y)]
        end = target.centre[1]
        if link.id in self._grid.back:
            out = self._x(column + 1, link.id)
            into = self._x(self._grid.cells[link.target][0], link.id)
            over = self._y(0, link.id)
            points += [(out, y), (out, over), (into, over), (into, end)]
        else:
            rows = [*self._grid.ways[link.id], self._grid.cells[link.target][1]]
            for gap, after in enumerate(rows, column + 1):
                level = self._centre(after)
                if level != y:
                    x = self._x(gap, link.id)
                    points += [(x, y), (x, level)]
                    y = level
        return [*points, (target.x, end)]

    def _tied(self, name: str, tie: _Tie, boxes: Mapping[str, Box]) -> list[Point]:
        column, row = self._grid.cells[tie.node]
        node, surface = boxes[tie.node], boxes[tie.surface]
        x = node.x + 12
        end = surface.centre[0]
        first = self._y(row + 1, name)
        points: list[Point] = [(x, node.bottom), (x, first)]
        if self._grid.cells[tie.surface][1] != row + 1:
            side = self._x(column + 1, name)
            last = self._y(self._grid.cells[tie.surface][1], name)
            points += [(side, first), (side, last), (end, last)]
        else:
            points.append((end, first))
        return [*points, (end, surface.y)]


def _without_bends(points: Sequence[Point]) -> list[Point]:
    """Without points that stand on a straight line between their neighbours, or twice."""
    found: list[Point] = []
    for point in points:
        while len(found) >= 2 and _straight(found[-2], found[-1], point):
            found.pop()
        if not found or found[-1] != point:
            found.append(point)
    return found


def _straight(a: Point, b: Point, c: Point) -> bool:
    return any(
        a[k] == b[k] == c[k] and min(a[1 - k], c[1 - k]) <= b[1 - k] <= max(a[1 - k], c[1 - k])
        for k in (0, 1)
    )
