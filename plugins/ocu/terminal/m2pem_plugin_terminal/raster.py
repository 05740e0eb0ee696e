"""A small picture in characters: lines of braille dots, and marks and texts over them.

A braille character has two dots beside each other and four above each other, so that lines look
smooth. Where a terminal shows ASCII only, a line is a row of one character.
"""

from collections.abc import Iterable, Sequence
from itertools import groupby, pairwise
from typing import Final

from rich.segment import Segment
from rich.style import Style

DOTS: Final = ((0x01, 0x02, 0x04, 0x40), (0x08, 0x10, 0x20, 0x80))
"""The bits of a braille character, by column and row of the dot (Unicode block 2800)."""
BRAILLE: Final = 0x2800

Place = tuple[float, float]
"""A column and a row of the picture, in cells from the upper left corner; fractions count."""

NO_STYLE = Style.null()


class Raster:
    """`columns` times `rows` cells; what is outside is cut off. `ascii`: without braille."""

    def __init__(self, columns: int, rows: int, *, ascii: bool = False) -> None:  # noqa: A002
        self.columns, self.rows, self.ascii = columns, rows, ascii
        cells = columns * rows
        self.bits = [0] * cells
        self.marks = [""] * cells
        self.styles = [NO_STYLE] * cells

    def copy(self) -> "Raster":
        """Return the same picture, to be drawn on."""
        made = Raster(0, 0, ascii=self.ascii)
        made.columns, made.rows = self.columns, self.rows
        made.bits, made.marks = self.bits[:], self.marks[:]
        made.styles = self.styles[:]
        return made

    def polyline(self, places: Iterable[Place], style: Style, mark: str = ".") -> None:
        """Draw lines from place to place. `mark`: the character of the line in ASCII."""
        for start, end in pairwise(places):
            self._line(start, end, style, mark)

    def _line(self, start: Place, end: Place, style: Style, mark: str) -> None:
        clipped = _clipped(start, end, self.columns, self.rows)
        if clipped is None:
            return
        wide, high = (1, 1) if self.ascii else (2, 4)
        last_x, last_y = self.columns * wide - 1, self.rows * high - 1
        (x, y), (end_x, end_y) = (
            (min(int(column * wide), last_x), min(int(row * high), last_y))
            for column, row in clipped
        )
        step_x, step_y = (1 if end_x > x else -1), (1 if end_y > y else -1)
        across, down = abs(end_x - x), -abs(end_y - y)
        error = across + down  # Bresenham's algorithm
        bits, marks, styles, columns = self.bits, self.marks, self.styles, self.columns
        while True:
            cell = (y // high) * columns + x // wide
            if self.ascii:
                marks[cell] = mark
            else:
                bits[cell] |= DOTS[x % 2][y % 4]
            styles[cell] = style
            if x == end_x and y == end_y:
                return
            doubled = 2 * error
            if doubled >= down:
                error += down
                x += step_x
            if doubled <= across:
                error += across
                y += step_y

    def put(self, column: int, row: int, text: str, style: Style) -> None:
        """Write over what is there; one character takes a cell."""
        if not 0 <= row < self.rows:
            return
        for place, character in enumerate(text, column):
            if 0 <= place < self.columns:
                cell = row * self.columns + place
                self.marks[cell], self.styles[cell] = character, style

    def row(self, row: int) -> Sequence[Segment]:
        """Return a row as it is written to the terminal."""
        start = row * self.columns
        cells = range(start, start + self.columns)
        return [
            Segment("".join(map(self._character, run)), style)
            for style, run in groupby(cells, self.styles.__getitem__)
        ]

    def text(self) -> str:
        """Return the characters, a line for each row."""
        return "\n".join(
            "".join(each.text for each in self.row(row)).rstrip() for row in range(self.rows)
        )

    def _character(self, cell: int) -> str:
        if mark := self.marks[cell]:
            return mark
        bits = self.bits[cell]
        return chr(BRAILLE + bits) if bits else " "


def _clipped(start: Place, end: Place, columns: int, rows: int) -> tuple[Place, Place] | None:
    """Return the part of a line that is in the picture, by Liang and Barsky; None: no part."""
    (x0, y0), (x1, y1) = start, end
    dx, dy = x1 - x0, y1 - y0
    first, last = 0.0, 1.0
    for step, room in ((-dx, x0), (dx, columns - x0), (-dy, y0), (dy, rows - y0)):
        if step == 0:
            if room < 0:
                return None
            continue
        crossing = room / step
        if step < 0:
            first = max(first, crossing)
        else:
            last = min(last, crossing)
    if first > last:
        return None
    return (x0 + first * dx, y0 + first * dy), (x0 + last * dx, y0 + last * dy)
