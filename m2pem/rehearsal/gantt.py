"""Draws a rehearsal as a Gantt chart: who was busy with what, in mission time."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta

from m2pem.api.runs import StampedRecord
from m2pem.diagram.style import cut, width_of
from m2pem.diagram.svg import Drawing, Group
from m2pem.fleet.fleet import Fleet
from m2pem.rehearsal.timeline import Mark, Outcome, Span, Timeline, read_timeline

WIDTH, LEFT, RIGHT, MARGIN = 1200.0, 150.0, 1170.0, 16.0
TOP, LANE, EMPTY_ROW, MARK_LANE, PADDING = 66.0, 34.0, 26.0, 18.0, 5.0
NARROWEST = 3.0
"""Width of the bar of what took no time."""

TEXT, FAINT, RULE, STRIPE = "#1f2933", "#5f6b77", "#d9dee3", "#f4f6f8"
SIZE, SMALL = 11.0, 10.0
"""Of texts."""

BARS = {
    Outcome.SUCCEEDED: ("#cfe8d5", "#3b8a55"),
    Outcome.ANSWERED: ("#cfe0f5", "#2f6cb3"),
    Outcome.INTERRUPTED: ("#fbe3b5", "#b7791f"),
    Outcome.FAILED: ("#f7c9c5", "#b3322a"),
    Outcome.OPEN: ("#e4e7eb", "#7b8794"),
}
MARKS = {"signal": "#5b4bb5", "message": "#2f6cb3", "escalation": "#a5660f", "error": "#b3322a"}
SYMBOLS = {
    "signal": ((0, -6), (6, 5), (-6, 5)),
    "message": ((-6, -4), (6, -4), (6, 5), (-6, 5)),
    "escalation": ((0, -6), (5, 6), (0, 1), (-5, 6)),
    "error": ((-6, 6), (-2, -5), (2, 1), (6, -6), (2, 6), (-2, 0)),
}
"""BPMN's own: triangle, envelope, arrow head, lightning."""

STEPS_S = (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 21600, 43200)
MOST_TICKS = 14


def gantt_svg(records: Iterable[StampedRecord], fleet: Fleet | None) -> str:
    """An SVG document with a row for every vehicle and payload of the fleet.

    Bars are behaviors, coloured by how they ended; further rows show what was thrown, the prompts
    and the services. `records` are all those of one run, in their order.
    """
    return _Chart(read_timeline(records), fleet).draw()


@dataclass(slots=True)
class _Row:
    label: str
    spans: Sequence[Span]
    manned: bool = False
    lanes: list[int] = field(default_factory=list)
    free: list[tuple[float, float]] = field(default_factory=list)
    """Beside each bar, to its left and right."""
    labelled: dict[int, float] = field(default_factory=dict)
    """By lane: how far the last label reaches."""

    @property
    def height(self) -> float:
        return (max(self.lanes) + 1) * LANE + 2 * PADDING if self.spans else EMPTY_ROW


class _Chart:
    def __init__(self, line: Timeline, fleet: Fleet | None) -> None:
        self._line = line
        self._per_s = (RIGHT - LEFT) / (line.end_s or 1.0)
        self._rows = [
            *([_Row("prompts", line.prompts)] if line.prompts else []),
            *([_Row("waiting", line.waits)] if line.waits else []),
            *([_Row("services", line.services)] if line.services else []),
            *_resources(line, fleet),
        ]
        for row in self._rows:
            bars = [(self._x(span.start_s), self._bar_end(span)) for span in row.spans]
            row.lanes = _lanes(bars)
            row.free = _free(bars, row.lanes)

    def draw(self) -> str:
        canvas = Drawing()
        marks, top = self._placed_marks()
        tops = [top]
        for row in self._rows:
            tops.append(tops[-1] + row.height)
        bottom = tops[-1]
        self._title(canvas)
        for place, row in enumerate(self._rows):
            if place % 2 == 0:
                canvas.rectangle(0, tops[place], WIDTH, tops[place + 1] - tops[place], fill=STRIPE)
            self._label(canvas, row, tops[place])
        self._axis(canvas, top, bottom)
        for mark, y in marks:
            self._mark(canvas, mark, y, bottom)
        for row, y in zip(self._rows, tops, strict=False):
            for place in range(len(row.spans)):
                self._bar(canvas, row, place, y + PADDING)
        self._legend(canvas, bottom + 44)
        return canvas.document(WIDTH, bottom + 60)

    # --- parts ----------------------------------------------------------------------------------

    def _title(self, canvas: Group) -> None:
        line = self._line
        began = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=line.started_us)
        ended = f"{line.outcome} after {_time(line.ended_s)}" if line.ended_s is not None else ""
        canvas.text_line(line.process or "no run", MARGIN, 28, 18, fill=TEXT, font_weight="600")
        about = f"{ended or 'not ended'}, started {began:%Y-%m-%d %H:%M:%S} UTC"
        if line.detail:
            about = f"{about}: {line.detail}"
        canvas.text_line(_fit(about, WIDTH - 2 * MARGIN, 12), MARGIN, 48, 12, fill=FAINT)

    def _label(self, canvas: Group, row: _Row, top: float) -> None:
        y = top + min(PADDING + LANE / 2, row.height / 2) + 4
        indent = MARGIN + (14 if "/" in row.label else 0)
        label = row.label.partition("/")[2] or row.label
        room = LEFT - indent - 12 - (50 if row.manned else 0)
        weight = "400" if "/" in row.label else "600"
        canvas.text_line(_fit(label, room, 12), indent, y, 12, fill=TEXT, font_weight=weight)
        if row.manned:
            canvas.text_line("manned", LEFT - 12, y, SIZE, fill=FAINT, text_anchor="end")

    def _axis(self, canvas: Group, top: float, bottom: float) -> None:
        for t_s in _ticks(self._line.end_s):
            x = self._x(t_s)
            canvas.line((x, top), (x, bottom), stroke=RULE)
            canvas.text_line(_time(t_s), x, bottom + 16, SIZE, fill=FAINT, text_anchor="middle")
        canvas.line((LEFT, bottom), (RIGHT, bottom), stroke=FAINT)
        if self._line.ended_s is not None:
            x = self._x(self._line.ended_s)
            canvas.line((x, top), (x, bottom), stroke=TEXT)

    def _bar(self, canvas: Group, row: _Row, place: int, top: float) -> None:
        span, lane = row.spans[place], row.lanes[place]
        x, end = self._x(span.start_s), self._bar_end(span)
        y = top + lane * LANE
        group = canvas.group(title=_about(span))
        fill, edge = BARS[span.outcome]
        group.rectangle(x, y + 2, end - x, LANE - 4, fill=fill, stroke=edge, rx=3)
        main, below = span.what or span.element, span.element if span.what else ""
        why = f"{main}: {span.note}"
        if span.outcome is Outcome.FAILED and width_of(why, SIZE) + 8 <= end - x:
            main = why
        needed = max(width_of(main, SIZE), width_of(below, SMALL)) + 8
        inside, (left, right) = end - x, row.free[place]
        left = min(left, x - row.labelled.get(lane, LEFT))
        anchor = "start"
        if needed <= inside or inside >= max(right, left):
            at, room = x + 5, inside
        elif needed <= right or right >= left:
            at, room = end + 4, right
            row.labelled[lane] = end + min(needed, right)
        else:
            at, room, anchor = x - 4, left, "end"
        for text, dy, size, fill in ((main, 15, SIZE, TEXT), (below, 27, SMALL, FAINT)):
            shown = _fit(text, room - 8, size)
            group.text_line(shown, at, y + dy, size, fill=fill, text_anchor=anchor)

    def _placed_marks(self) -> tuple[list[tuple[Mark, float]], float]:
        """The marks with their heights, and where the rows begin."""
        marks = self._line.marks
        if not marks:
            return [], TOP
        lanes = _lanes((x - 10, x + 14 + width_of(mark.label, SIZE)) for mark, x in self._at(marks))
        placed = [
            (mark, TOP + PADDING + (lane + 0.5) * MARK_LANE)
            for mark, lane in zip(marks, lanes, strict=True)
        ]
        return placed, TOP + (max(lanes) + 1) * MARK_LANE + 2 * PADDING

    def _at(self, marks: Sequence[Mark]) -> Iterator[tuple[Mark, float]]:
        return ((mark, self._x(mark.t_s)) for mark in marks)

    def _mark(self, canvas: Group, mark: Mark, y: float, bottom: float) -> None:
        x, colour = self._x(mark.t_s), MARKS[mark.kind]
        note = f": {mark.note}" if mark.note else ""
        group = canvas.group(title=f"{mark.kind} {mark.label} at {_time(mark.t_s)}{note}")
        group.line((x, y + 6), (x, bottom), stroke=colour, stroke_dasharray="2 3")
        group.polygon([(x + dx, y + dy) for dx, dy in SYMBOLS[mark.kind]], fill=colour)
        if x + 10 + width_of(mark.label, SIZE) > WIDTH:
            group.text_line(mark.label, x - 10, y + 4, SIZE, fill=colour, text_anchor="end")
        else:
            group.text_line(mark.label, x + 10, y + 4, SIZE, fill=colour)

    def _legend(self, canvas: Group, y: float) -> None:
        outcomes = {span.outcome for row in self._rows for span in row.spans}
        kinds = {mark.kind for mark in self._line.marks}
        x = LEFT
        for outcome, (fill, edge) in BARS.items():
            if outcome in outcomes:
                canvas.rectangle(x, y - 9, 14, 11, fill=fill, stroke=edge, rx=3)
                canvas.text_line(outcome.value, x + 20, y, SIZE, fill=FAINT)
                x += 40 + width_of(outcome.value, SIZE)
        for kind, colour in MARKS.items():
            if kind in kinds:
                corners = [(x + 7 + dx, y - 4 + dy) for dx, dy in SYMBOLS[kind]]
                canvas.polygon(corners, fill=colour)
                canvas.text_line(kind, x + 20, y, SIZE, fill=FAINT)
                x += 40 + width_of(kind, SIZE)

    # --- places ---------------------------------------------------------------------------------

    def _x(self, t_s: float) -> float:
        return LEFT + t_s * self._per_s

    def _bar_end(self, span: Span) -> float:
        return max(self._x(span.end_s), self._x(span.start_s) + NARROWEST)


def _fit(text: str, width: float, size: float) -> str:
    """Cut a text to a width; "" where not even a letter fits."""
    shown = cut(text, width, size)
    return "" if shown == "\u2026" else shown


def _resources(line: Timeline, fleet: Fleet | None) -> Iterator[_Row]:
    """Every vehicle with its payloads, and what else was commanded."""
    shown: set[str] = set()
    for vehicle in fleet.vehicles.values() if fleet is not None else ():
        yield _Row(vehicle.id, line.resources.get(vehicle.id, ()), vehicle.manned)
        for payload in vehicle.payloads:
            yield _Row(payload, line.resources.get(payload, ()))
        shown.update((vehicle.id, *vehicle.payloads))
    for resource, spans in line.resources.items():
        if resource not in shown:
            yield _Row(resource, spans)


def _lanes(extents: Iterable[tuple[float, float]]) -> list[int]:
    """A lane for each extent, the first in which it touches no other. They come in order."""
    ends: list[float] = []
    lanes: list[int] = []
    for start, end in extents:
        lane = next((n for n, taken in enumerate(ends) if taken <= start + 0.01), len(ends))
        ends[lane : lane + 1] = [end]
        lanes.append(lane)
    return lanes


def _free(bars: Sequence[tuple[float, float]], lanes: Sequence[int]) -> list[tuple[float, float]]:
    """Return the distance from each bar to its neighbours in its lane."""
    free: list[tuple[float, float]] = []
    before: dict[int, int] = {}
    for place, ((start, end), lane) in enumerate(zip(bars, lanes, strict=True)):
        left = LEFT
        if lane in before:
            neighbour = before[lane]
            left = bars[neighbour][1]
            free[neighbour] = (free[neighbour][0], start - left)
        free.append((start - left, WIDTH - end))
        before[lane] = place
    return free


def _ticks(end_s: float) -> list[float]:
    step = next((step for step in STEPS_S if end_s / step <= MOST_TICKS), 0.0)
    if not step:
        step = 86_400.0 * (1 + int(end_s / 86_400 / MOST_TICKS))
    return [number * step for number in range(int(end_s / step) + 1)]


def _time(t_s: float) -> str:
    """Mission time as people say it: 12.5 s, 2:05, 1:02:05."""
    if t_s < 120:
        return f"{round(t_s, 1):g} s"
    minutes, seconds = divmod(round(t_s), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes}:{seconds:02}"


def _about(span: Span) -> str:
    what = f"{span.element}: {span.what}" if span.what else span.element
    note = f", {span.note}" if span.note else ""
    lasted = f"{_time(span.start_s)} to {_time(span.end_s)}"
    return f"{what} ({lasted}, {span.outcome.value}{note})"
