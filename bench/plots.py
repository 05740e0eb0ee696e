"""Time and memory over size, as SVG: one drawing for each graph, both axes logarithmic."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

from bench.engines import Figure
from bench.targets import Work
from m2pem.diagram.style import width_of
from m2pem.diagram.svg import Drawing, Group

COLOURS = ("#0b6e4f", "#c1440e", "#3066be", "#8e44ad", "#7f6a00", "#00838f", "#ad1457")
TEXT, FAINT = "#222222", "#dddddd"
SIZE = 11.0
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
    canvas = Drawing()
    step = LEFT + WIDTH + RIGHT + GAP
    width, height = len(panels) * step - GAP, TOP + HEIGHT + BOTTOM
    canvas.text_line(title, LEFT, 20, 14, fill=TEXT, font_weight="600")
    _legend(canvas, engines, width)
    for number, panel in enumerate(panels):
        _panel(canvas, LEFT + number * step, panel, sizes, engines)
    return canvas.document(width, height)


def _cpu_s(figure: Figure) -> float:
    return figure.values["cpu_s"]


def _peak_mb(figure: Figure) -> float:
    return figure.values["peak_kb"] / 1024


def _legend(canvas: Group, engines: Sequence[str], width: float) -> None:
    x, y = LEFT + 190.0, 12.0
    for name, colour in zip(engines, COLOURS, strict=False):
        if x + 15 + width_of(name, SIZE) > width:
            x, y = LEFT + 190.0, y + 16
        canvas.rectangle(x, y, 10, 10, fill=colour)
        canvas.text_line(name, x + 15, y + 9, SIZE, fill=TEXT)
        x += width_of(name, SIZE) + 40


def _panel(
    canvas: Group,
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
    canvas.text_line(panel.title, left, TOP - 12, SIZE, fill=TEXT, font_weight="600")
    for power in range(across.low, across.high + 1):
        x = left + across.place(10.0**power)
        canvas.line((x, TOP), (x, bottom), stroke=FAINT)
        label = f"{10**power:,}"
        canvas.text_line(label, x, bottom + 16, SIZE, fill=TEXT, text_anchor="middle")
    for power in range(up.low, up.high + 1):
        y = bottom - up.place(10.0**power)
        canvas.line((left, y), (left + WIDTH, y), stroke=FAINT)
        label = f"{10.0**power:,g} {panel.unit}".strip()
        canvas.text_line(label, left - 6, y + 4, SIZE, fill=TEXT, text_anchor="end")
    for (name, points), colour in zip(lines.items(), COLOURS, strict=False):
        group = canvas.group(title=name)
        places = [(left + across.place(x), bottom - up.place(y)) for x, y in points]
        for start, end in pairwise(places):
            group.line(start, end, stroke=colour)
        for x, y in places:
            group.rectangle(x - DOT, y - DOT, 2 * DOT, 2 * DOT, fill=colour)


def _good(figure: Figure | None) -> bool:
    return figure is not None and bool(figure.values)
