"""Which part of the world the map shows: its centre, and the metres of a cell."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from m2pem.api import EastNorth
from m2pem_plugin_terminal.raster import Place

CELL_RATIO = 2.0
"""A cell of a terminal is about twice as high as it is wide."""

NEAREST_M, FARTHEST_M = 0.05, 50_000.0
"""Metres that a cell may be wide."""

MARGIN = 0.12
"""Free at each side, as a part of the picture."""

LEAST_M = 20.0
"""A fleet that stands at one place is shown in a square of that size."""

STEPS = (1, 2, 5)


@dataclass(frozen=True, slots=True)
class Viewport:
    """`columns` and `rows`: of the picture. `east_m`, `north_m`: its centre in the local frame."""

    columns: int
    rows: int
    east_m: float = 0.0
    north_m: float = 0.0
    metres: float = 1.0

    def place(self, point: EastNorth) -> Place:
        """Return the column and row of a point."""
        column = self.columns / 2 + (point[0] - self.east_m) / self.metres
        row = self.rows / 2 - (point[1] - self.north_m) / (self.metres * CELL_RATIO)
        return column, row

    def point(self, place: Place) -> EastNorth:
        """Return the point at a column and row."""
        east_m = self.east_m + (place[0] - self.columns / 2) * self.metres
        north_m = self.north_m - (place[1] - self.rows / 2) * self.metres * CELL_RATIO
        return east_m, north_m

    def shows(self, point: EastNorth) -> bool:
        """Return whether a point is in the picture."""
        column, row = self.place(point)
        return 0 <= column < self.columns and 0 <= row < self.rows

    def sized(self, columns: int, rows: int) -> "Viewport":
        """Return the same centre and scale in a picture of another size."""
        return replace(self, columns=columns, rows=rows)

    def moved(self, right: float, down: float) -> "Viewport":
        """Return what is seen `right` cells to the right and `down` rows below."""
        return replace(
            self,
            east_m=self.east_m + right * self.metres,
            north_m=self.north_m - down * self.metres * CELL_RATIO,
        )

    def zoomed(self, factor: float, at: Place | None = None) -> "Viewport":
        """Return a picture in which all is `factor` times as large, around a place of it."""
        at = at or (self.columns / 2, self.rows / 2)
        east_m, north_m = self.point(at)
        metres = min(FARTHEST_M, max(NEAREST_M, self.metres / factor))
        share = metres / self.metres
        return replace(
            self,
            metres=metres,
            east_m=east_m + (self.east_m - east_m) * share,
            north_m=north_m + (self.north_m - north_m) * share,
        )

    def centred(self, point: EastNorth) -> "Viewport":
        """Return the same scale around another point."""
        return replace(self, east_m=point[0], north_m=point[1])

    def fitted(self, points: Iterable[EastNorth]) -> "Viewport":
        """Return the picture that shows all points; this one, if there are none."""
        places = list(points)
        if not places or not self.columns or not self.rows:
            return self
        easts, norths = zip(*places, strict=True)
        low, high = min(easts), max(easts)
        bottom, top = min(norths), max(norths)
        used = 1 - 2 * MARGIN
        metres = max(
            max(high - low, LEAST_M) / (self.columns * used),
            max(top - bottom, LEAST_M) / (self.rows * CELL_RATIO * used),
        )
        metres = min(FARTHEST_M, max(NEAREST_M, metres))
        return replace(self, east_m=(low + high) / 2, north_m=(bottom + top) / 2, metres=metres)

    def scale_bar(self) -> tuple[int, str]:
        """Return the cells of a round distance of about a quarter of the width, and its name."""
        most_m = self.columns * self.metres / 4
        best = 0.1
        power = 0.1
        while power <= most_m:
            best = max([best, *(power * step for step in STEPS if power * step <= most_m)])
            power *= 10
        cells = max(2, round(best / self.metres))
        named = f"{best / 1000:g} km" if best >= 1000 else f"{best:g} m"
        return cells, named
