"""Time and memory over size, as SVG: one drawing for each graph, both axes logarithmic."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

from bench.engines import Figure
from bench.targets import Work
from m2pem.sim.svg import Canvas, text_width

COLOURS = ("#0b6e4f", "#c1440e", "#3066be", "#8e44ad", "#7f6a00")
INK, FAINT, PAPER = "#222222", "#dddddd", "#ffffff"
WIDTH, HEIGHT = 380.0, 260.0
LEFT, TOP, BOTTOM, GAP, RIGHT = 62.0, 58.0, 44.0, 30.0, 16.0
DOT = 3.0

Points: TypeAlias = list[tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Axis:
    """Powers of ten from `low` to `high` on so many pixels."""

    low: int
    high: int
    pixels: float

    def place(self, value: float) -> float:
        """Pixels from the beginning of the axis."""
        return (math.log10(value) - self.low) / (self.high - self.low) * self.pixels

    @staticmethod
    def over(values: Sequence[float], pixels: float) -> "Axis":
        """The axis that shows all values."""
        low = math.floor(math.log10(min(values)))
        return Axis(low, max(low + 1, math.ceil(math.log10(max(values)))), pixels)


def plot(work: Work, sizes: dict[int, dict[str, Figure]], engines: Sequence[str]) -> str:
    """A drawing with two panels; an engine's line ends with the largest size that it bears."""
    canvas = Canvas()
    width, height = 2 * (LEFT + WIDTH + RIGHT) + GAP, TOP + HEIGHT + BOTTOM
    canvas.rectangle(0, 0, width, height, PAPER)
    canvas.text(LEFT, 20, f"{work.title[0].upper()}{work.title[1:]}", INK, size=14, bold=True)
    _legend(canvas, engines)
    _panel(canvas, LEFT, f"CPU seconds over {work.unit}", sizes, engines, _cpu_s, "s")
    second = LEFT + WIDTH + RIGHT + GAP + LEFT
    title = f"Peak memory of the process over {work.unit}"
    _panel(canvas, second, title, sizes, engines, _peak_mb, "MB")
    return canvas.document(width, height)


def _cpu_s(figure: Figure) -> float:
    return figure.values["cpu_s"]


def _peak_mb(figure: Figure) -> float:
    return figure.values["peak_kb"] / 1024


def _legend(canvas: Canvas, engines: Sequence[str]) -> None:
    x = LEFT + 190.0
    for name, colour in zip(engines, COLOURS, strict=False):
        canvas.rectangle(x, 12, 10, 10, colour)
        canvas.text(x + 15, 21, name, INK)
        x += text_width(name) + 40


def _panel(
    canvas: Canvas,
    left: float,
    title: str,
    sizes: dict[int, dict[str, Figure]],
    engines: Sequence[str],
    value: Callable[[Figure], float],
    unit: str,
) -> None:
    lines: dict[str, Points] = {
        name: [(n, value(each[name])) for n, each in sizes.items() if _good(each.get(name))]
        for name in engines
    }
    shown = [point for points in lines.values() for point in points]
    if not shown:
        return
    across = Axis.over([x for x, _ in shown], WIDTH)
    up = Axis.over([y for _, y in shown], HEIGHT)
    bottom = TOP + HEIGHT
    canvas.text(left, TOP - 12, title, INK, bold=True)
    for power in range(across.low, across.high + 1):
        x = left + across.place(10.0**power)
        canvas.line((x, TOP), (x, bottom), FAINT)
        canvas.text(x, bottom + 16, f"{10**power:,}", INK, anchor="middle")
    for power in range(up.low, up.high + 1):
        y = bottom - up.place(10.0**power)
        canvas.line((left, y), (left + WIDTH, y), FAINT)
        canvas.text(left - 6, y + 4, f"{10.0**power:,g} {unit}", INK, anchor="end")
    for (name, points), colour in zip(lines.items(), COLOURS, strict=False):
        group = Canvas(canvas, title=name)
        places = [(left + across.place(x), bottom - up.place(y)) for x, y in points]
        for start, end in pairwise(places):
            group.line(start, end, colour)
        for x, y in places:
            group.rectangle(x - DOT, y - DOT, 2 * DOT, 2 * DOT, colour)


def _good(figure: Figure | None) -> bool:
    return figure is not None and bool(figure.values)
