"""Time and memory over size, as SVG: one drawing for each graph, both axes logarithmic."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

from m2pem.rehearsal.svg import Canvas, text_width

from bench.engines import Figure
from bench.targets import Work

COLOURS = ("#0b6e4f", "#c1440e", "#3066be", "#8e44ad", "#7f6a00", "#00838f", "#ad1457")
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


@dataclass(frozen=True, slots=True)
class Panel:
    """What is drawn of each figure. `value`: None: it says nothing of that."""

    title: str
    value: Callable[[Figure], float | None]
    unit: str


def plot(work: Work, sizes: dict[int, dict[str, Figure]], engines: Sequence[str]) -> str:
    """A drawing of time and memory of the engines that play a graph."""
    panels = (
        Panel(f"CPU seconds over {work.unit}", _cpu_s, "s"),
        Panel(f"Peak memory of the process over {work.unit}", _peak_mb, "MB"),
    )
    return draw(f"{work.title[0].upper()}{work.title[1:]}", panels, sizes, engines)


def draw(
    title: str,
    panels: Sequence[Panel],
    sizes: Mapping[int, Mapping[str, Figure]],
    engines: Sequence[str],
) -> str:
    """A drawing of panels side by side; an engine's line ends with the largest size it bears."""
    canvas = Canvas()
    step = LEFT + WIDTH + RIGHT + GAP
    width, height = len(panels) * step - GAP, TOP + HEIGHT + BOTTOM
    canvas.rectangle(0, 0, width, height, PAPER)
    canvas.text(LEFT, 20, title, INK, size=14, bold=True)
    _legend(canvas, engines, width)
    for number, panel in enumerate(panels):
        _panel(canvas, LEFT + number * step, panel, sizes, engines)
    return canvas.document(width, height)


def _cpu_s(figure: Figure) -> float:
    return figure.values["cpu_s"]


def _peak_mb(figure: Figure) -> float:
    return figure.values["peak_kb"] / 1024


def _legend(canvas: Canvas, engines: Sequence[str], width: float) -> None:
    x, y = LEFT + 190.0, 12.0
    for name, colour in zip(engines, COLOURS, strict=False):
        if x + 15 + text_width(name) > width:
            x, y = LEFT + 190.0, y + 16
        canvas.rectangle(x, y, 10, 10, colour)
        canvas.text(x + 15, y + 9, name, INK)
        x += text_width(name) + 40


def _panel(
    canvas: Canvas,
    left: float,
    panel: Panel,
    sizes: Mapping[int, Mapping[str, Figure]],
    engines: Sequence[str],
) -> None:
    lines: dict[str, Points] = {
        name: [
            (n, value)
            for n, each in sizes.items()
            if _good(each.get(name)) and (value := panel.value(each[name])) is not None
        ]
        for name in engines
    }
    shown = [point for points in lines.values() for point in points]
    if not shown:
        return
    across = Axis.over([x for x, _ in shown], WIDTH)
    up = Axis.over([y for _, y in shown], HEIGHT)
    bottom = TOP + HEIGHT
    canvas.text(left, TOP - 12, panel.title, INK, bold=True)
    for power in range(across.low, across.high + 1):
        x = left + across.place(10.0**power)
        canvas.line((x, TOP), (x, bottom), FAINT)
        canvas.text(x, bottom + 16, f"{10**power:,}", INK, anchor="middle")
    for power in range(up.low, up.high + 1):
        y = bottom - up.place(10.0**power)
        canvas.line((left, y), (left + WIDTH, y), FAINT)
        canvas.text(left - 6, y + 4, f"{10.0**power:,g} {panel.unit}".strip(), INK, anchor="end")
    for (name, points), colour in zip(lines.items(), COLOURS, strict=False):
        group = Canvas(canvas, title=name)
        places = [(left + across.place(x), bottom - up.place(y)) for x, y in points]
        for start, end in pairwise(places):
            group.line(start, end, colour)
        for x, y in places:
            group.rectangle(x - DOT, y - DOT, 2 * DOT, 2 * DOT, colour)


def _good(figure: Figure | None) -> bool:
    return figure is not None and bool(figure.values)
