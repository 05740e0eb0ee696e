"""Paints pictures: one plane below the other, what is marked on them, and a legend."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from m2pem.diagram import symbols
from m2pem.diagram.edges import docked, draw_label, draw_line, has_label, label_of, label_of_line
from m2pem.diagram.overlays import Badges, Overlays, ids_of
from m2pem.diagram.picture import Bounds, Line, Picture, Point, Shape, Trait
from m2pem.diagram.style import (
    BACKGROUND,
    FOREGROUND,
    LINE_HEIGHT,
    PLAIN,
    Style,
    width_of,
    wrapped,
)
from m2pem.diagram.svg import Attributes, Drawing, Group, number

_MARGIN = 24.0
_LABEL_ROOM = 36.0
_TITLE, _HEADING, _SMALL = 16.0, 13.0, 11.0
_LEAST_WIDTH = 420.0

_SURFACES: dict[str, Callable[[Group, Shape, Style], None]] = {
    "participant": symbols.draw_pool,
    "lane": symbols.draw_lane,
    "dataObjectReference": symbols.draw_data,
    "dataInput": symbols.draw_data,
    "dataOutput": symbols.draw_data,
    "dataStoreReference": symbols.draw_store,
    "textAnnotation": symbols.draw_annotation,
    "group": symbols.draw_group,
}


def paint(
    pictures: Sequence[Picture],
    overlays: Overlays,
    *,
    title: str = "",
    note: str = "",
    about: str = "",
) -> str:
    """Return the text of an SVG file, with `title` and `note` above the pictures."""
    file = Drawing(about)
    boxes = [each.box() for each in pictures]
    width = max([_LEAST_WIDTH, *(box.width + 2 * _MARGIN for box in boxes)])
    drawing = file.group()
    y = _above(drawing, title, note, width)
    for picture, box in zip(pictures, boxes, strict=True):
        if len(pictures) > 1 and picture.title:
            attributes: Attributes = {"text_anchor": "start", "font_weight": "bold"}
            drawing.text([picture.title], _MARGIN, y, _HEADING, fill=FOREGROUND, **attributes)
            y += _HEADING + 8
        plane = drawing.group((_MARGIN - box.x, y - box.y))
        _Painter(plane, picture, overlays).paint()
        y += box.height + _LABEL_ROOM
    y = _legend(drawing, overlays, width, y)
    return file.document(width, y)


def _above(to: Group, title: str, note: str, width: float) -> float:
    y = _MARGIN
    if not title and not note:
        return y
    for text, size, weight in ((title, _TITLE, "bold"), (note, _SMALL + 1, "normal")):
        lines = wrapped(text, width - 2 * _MARGIN, size)
        to.text(lines, _MARGIN, y, size, text_anchor="start", fill=FOREGROUND, font_weight=weight)
        y += len(lines) * size * LINE_HEIGHT + 4
    return y + 14


def _legend(to: Group, overlays: Overlays, width: float, y: float) -> float:
    shown = overlays.legend()
    if not shown:
        return y
    x = _MARGIN
    to.path(f"M{_MARGIN:g} {number(y)}H{number(width - _MARGIN)}", stroke="#dcdfe4")
    y += 12
    for style, words in shown:
        wide = 34 + width_of(words, _SMALL) + 18
        if x + wide > width - _MARGIN and x > _MARGIN:
            x, y = _MARGIN, y + 22
        to.rectangle(x, y, 26, 14, rx=4, stroke=style.stroke, fill=style.fill, stroke_width=1.6)
        to.text([words], x + 34, y, _SMALL, text_anchor="start", fill=FOREGROUND)
        x += wide
    return y + 28


class _Painter:
    """Paints one picture."""

    def __init__(self, to: Group, picture: Picture, overlays: Overlays) -> None:
        self.to = to
        self.picture = picture
        self.shapes = {shape.id: shape for shape in picture.shapes}
        self.overlays = overlays.on(ids_of(picture), picture.parents)
        self.styles = self.overlays.styles()
        self.points: dict[str, tuple[Point, ...]] = {
            line.id: docked(line, self.shapes) for line in picture.lines
        }

    def paint(self) -> None:
        """Surfaces, then lines, then symbols, then names, then numbers."""
        below = [each for each in self.picture.shapes if _is_below(each)]
        for shape in below:
            self._shape(shape)
        for line in sorted(self.picture.lines, key=lambda each: each.id in self.styles):
            self._line(line)
        for shape in self.picture.shapes:
            if not _is_below(shape):
                self._shape(shape)
        names: list[Bounds] = []
        for shape in self.picture.shapes:
            if has_label(shape):
                names.append(draw_label(self.to, label_of(shape), self._text_style(shape.id)))
        for line in self.picture.lines:
            if line.name:
                label = label_of_line(line, self.points[line.id])
                names.append(draw_label(self.to, label, self._text_style(line.id)))
        Badges(self.to, names).paint(self.overlays, self.shapes, self.points)

    def _text_style(self, name: str) -> Style:
        return self.styles.get(name, PLAIN)

    def _shape(self, shape: Shape) -> None:
        bounds = shape.bounds
        reason = self.overlays.stuck.get(shape.id) or self.overlays.waiting.get(shape.id, "")
        group = self.to.group((bounds.x, bounds.y), reason, data_element_id=shape.id)
        style = self.styles.get(shape.id, PLAIN)
        if Trait.EXPANDED in shape.traits and shape.id in self.styles:
            style = replace(style, fill=BACKGROUND)  # its inside has colours of its own
        _drawer(shape)(group, shape, style)

    def _line(self, line: Line) -> None:
        reason = self.overlays.stuck.get(line.id) or self.overlays.waiting.get(line.id, "")
        group = self.to.group(None, reason, data_element_id=line.id)
        dashes = "7 4" if line.id in self.overlays.missing else ""
        draw_line(group, line, self.points[line.id], self.styles.get(line.id, PLAIN), dashes)


def _is_below(shape: Shape) -> bool:
    return Trait.EXPANDED in shape.traits or shape.kind in ("participant", "lane")


def _drawer(shape: Shape) -> Callable[[Group, Shape, Style], None]:
    if shape.kind in _SURFACES:
        return _SURFACES[shape.kind]
    if shape.kind.endswith("Event"):
        return symbols.draw_event
    if shape.kind.endswith("Gateway"):
        return symbols.draw_gateway
    return symbols.draw_activity
