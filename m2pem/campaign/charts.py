"""Charts of a campaign's report as SVG, for light and dark pages and for screen readers."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree as ET

from m2pem.diagram.style import cut, width_of
from m2pem.diagram.svg import Drawing, Group, clean

WIDTH, RIGHT, TOP, MARGIN = 720.0, 704.0, 44.0, 16.0
SIZE = 12.0
"""Of texts."""

BINS = 40
MOST_TICKS = 8
ROW, BARS = 26.0, 190.0
"""Heights in px: of an interval, and of the bars of a histogram."""

LIGHT = "--paper:#ffffff;--ink:#22242a;--faint:#5f6b77;--rule:#d9dee3;--good:#2f6cb3;--bad:#b3322a"
DARK = "--paper:#14171c;--ink:#e6e8eb;--faint:#a9b1ba;--rule:#3a4048;--good:#6ea8e8;--bad:#f08a80"
DARK_SCREEN = "@media screen and (prefers-color-scheme:dark)"
"""Paper is light, whatever the screen is."""

STYLE = (
    f".chart{{{LIGHT}}}{DARK_SCREEN}{{.chart{{{DARK}}}}}"
    ".chart>rect{fill:var(--paper)}"
    ".chart text{fill:var(--ink)}.chart .faint text{fill:var(--faint)}"
    ".chart .rule{stroke:var(--rule)}.chart .axis{stroke:var(--faint)}"
    ".chart .good{fill:var(--good)}.chart .bad{fill:var(--bad)}"
    ".chart .interval{stroke:var(--good);fill:var(--good);stroke-width:2}"
)


@dataclass(frozen=True, slots=True)
class Histogram:
    """How many runs lie in each part of a quantity's range; those that failed are above the good
    ones. `name`: of the file, and of ids. `label`: the quantity with its unit."""

    name: str
    title: str
    label: str
    good: Sequence[float]
    failed: Sequence[float]

    def svg(self) -> str:
        """Return the chart as an SVG document."""
        values = [*self.good, *self.failed]
        low, high = min(values), max(values)
        if low == high:
            low, high = low - 0.5, high + 0.5
        width = (high - low) / BINS
        counts = [_counted(each, low, width) for each in (self.good, self.failed)]
        most = max(map(sum, zip(*counts, strict=True)))
        up_ticks = _ticks(0, most, whole=True)
        left = MARGIN + 16 + max(width_of(text, SIZE) for _, text in up_ticks)
        bottom = TOP + BARS
        x = _Scale(low, high, left, RIGHT)
        y = _Scale(0, most, bottom, TOP)
        drawing = _begun(self.name, self.title, self._description())
        _across(drawing, x, bottom, bottom, self.label)
        axis = _styled(drawing, "faint")
        for value, text in up_ticks:
            axis.line((left, y(value)), (RIGHT, y(value)), **{"class": "rule"})
            axis.text_line(text, left - 6, y(value) + 4, SIZE, text_anchor="end")
        axis.text_line("runs", MARGIN, TOP - 14, SIZE)
        for place, (good, failed) in enumerate(zip(*counts, strict=True)):
            begins, ends = low + place * width, low + (place + 1) * width
            if good + failed:
                about = f"{begins:.4g} to {ends:.4g}: {good} good, {failed} failed"
                bar = drawing.group(title=about)
                for style, base, count in (("good", 0, good), ("bad", good, failed)):
                    top = y(base + count)
                    height = y(base) - top
                    if count:
                        wide = max(1.0, x(ends) - x(begins) - 1)
                        bar.rectangle(x(begins), top, wide, height, **{"class": style})
        _legend(drawing, (("good", "good"), ("bad", "failed")))
        return drawing.document(WIDTH, bottom + 48)

    def _description(self) -> str:
        parts = [
            f"{len(values):,} {name} runs between {min(values):.1f} and {max(values):.1f}"
            for name, values in (("good", self.good), ("failed", self.failed))
            if values
        ]
        return f"Runs by {self.label}: {'; '.join(parts)}."


@dataclass(frozen=True, slots=True)
class Mark:
    """A value, and the interval that it lies in."""

    name: str
    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Intervals:
    """Values with their intervals, one below the other, and where 0 is."""

    name: str
    title: str
    label: str
    intervals: Sequence[Mark]

    def svg(self) -> str:
        """Return the chart as an SVG document."""
        names = [cut(each.name, WIDTH / 2, SIZE) for each in self.intervals]
        left = MARGIN + 12 + max(width_of(name, SIZE) for name in names)
        low = min(0.0, *(each.low for each in self.intervals))
        high = max(0.0, *(each.high for each in self.intervals))
        x = _Scale(low, high, left, RIGHT)
        top = TOP - 20
        bottom = top + ROW * len(self.intervals)
        drawing = _begun(self.name, self.title, self._description())
        _across(drawing, x, top, bottom, self.label)
        drawing.line((x(0), top), (x(0), bottom), **{"class": "axis"})
        for place, (each, name) in enumerate(zip(self.intervals, names, strict=True)):
            y = top + (place + 0.5) * ROW
            row = drawing.group(title=_said(each))
            row.text_line(name, left - 10, y + 4, SIZE, text_anchor="end")
            marks = _styled(row, "interval")
            marks.line((x(each.low), y), (x(each.high), y))
            for end in (each.low, each.high):
                marks.line((x(end), y - 4), (x(end), y + 4))
            marks.circle(x(each.value), y, 4)
        return drawing.document(WIDTH, bottom + 48)

    def _description(self) -> str:
        return f"{self.label}: {'; '.join(map(_said, self.intervals))}."


Chart = Histogram | Intervals


def _said(each: Mark) -> str:
    return f"{each.name} {each.value:+.4f} ({each.low:+.4f} to {each.high:+.4f})"


@dataclass(frozen=True, slots=True)
class _Scale:
    """Where values of `low` to `high` are between two places of the drawing."""

    low: float
    high: float
    start: float
    end: float

    def __call__(self, value: float) -> float:
        share = (value - self.low) / (self.high - self.low)
        return self.start + (self.end - self.start) * share


def _begun(name: str, title: str, description: str) -> Drawing:
    drawing = Drawing()
    root = drawing.element
    root.set("class", "chart")
    root.set("role", "img")
    said = (("title", "labelledby", title), ("desc", "describedby", description))
    for place, (tag, refers, text) in enumerate(said):
        root.set(f"aria-{refers}", f"{name}-{tag}")
        element = ET.Element(tag, id=f"{name}-{tag}")
        element.text = clean(text)
        root.insert(place, element)
    ET.SubElement(root, "style").text = STYLE
    return drawing


def _across(drawing: Group, x: _Scale, top: float, bottom: float, label: str) -> None:
    """Draw the axis along the bottom, with lines up to `top`."""
    axis = _styled(drawing, "faint")
    for value, text in _ticks(x.low, x.high):
        axis.line((x(value), top), (x(value), bottom + 4), **{"class": "rule"})
        axis.text_line(text, x(value), bottom + 18, SIZE, text_anchor="middle")
    axis.line((x.start, bottom), (x.end, bottom), **{"class": "axis"})
    axis.text_line(label, (x.start + x.end) / 2, bottom + 38, SIZE, text_anchor="middle")


def _styled(drawing: Group, style: str) -> Group:
    return drawing.group(None, "", **{"class": style})


def _legend(drawing: Group, entries: Sequence[tuple[str, str]]) -> None:
    x = RIGHT - sum(30 + width_of(name, SIZE) for _, name in entries)
    for style, name in entries:
        entry = drawing.group()
        entry.rectangle(x, TOP - 24, 12, 12, **{"class": style})
        entry.text_line(name, x + 18, TOP - 14, SIZE)
        x += 30 + width_of(name, SIZE)


def _counted(values: Sequence[float], low: float, width: float) -> list[int]:
    counts = [0] * BINS
    for value in values:
        counts[min(BINS - 1, int((value - low) / width))] += 1
    return counts


def _ticks(low: float, high: float, *, whole: bool = False) -> list[tuple[float, str]]:
    """Return round values of `low` to `high`, and how they are written."""
    power = math.floor(math.log10((high - low) / MOST_TICKS))
    if whole:
        power = max(power, 0)
    step = next(
        factor * 10.0**power
        for factor in (1, 2, 5, 10, 20)
        if (high - low) / (factor * 10.0**power) <= MOST_TICKS
    )
    decimals = max(0, -power)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [(n * step, f"{n * step:,.{decimals}f}") for n in range(first, last + 1)]
