"""Paints pictures: one plane below the other, what is marked on them, and a legend."""

from collections.abc import Callable, Sequence
from xml.etree import ElementTree as ET

from m2pem.diagram import nodes, surfaces
from m2pem.diagram.badges import Badges
from m2pem.diagram.ink import INK, PAPER, PLAIN, Ink
from m2pem.diagram.labels import draw_label, draw_line_label, has_label
from m2pem.diagram.lines import docked, draw_line
from m2pem.diagram.marks import Marks, ids_of
from m2pem.diagram.picture import Bounds, Line, Picture, Point, Shape, Trait
from m2pem.diagram.svg import Group, number
from m2pem.diagram.text import FONT, LINE_HEIGHT, width_of, wrapped

_MARGIN = 24.0
_LABEL_ROOM = 36.0
_TITLE, _HEADING, _SMALL = 16.0, 13.0, 11.0
_LEAST_WIDTH = 420.0

_SURFACES: dict[str, Callable[[Group, Shape, Ink], None]] = {
    "participant": surfaces.draw_pool,
    "lane": surfaces.draw_lane,
    "dataObjectReference": surfaces.draw_data,
    "dataInput": surfaces.draw_data,
    "dataOutput": surfaces.draw_data,
    "dataStoreReference": surfaces.draw_store,
    "textAnnotation": surfaces.draw_annotation,
    "group": surfaces.draw_group,
}


def paint(
    pictures: Sequence[Picture], marks: Marks, *, title: str = "", note: str = "", about: str = ""
) -> str:
    """A file's text. `title` stands above, `note` below it; `about` is kept in the metadata."""
    root = ET.Element("svg", {"xmlns": "http://www.w3.org/2000/svg", "font-family": FONT})
    if about:
        ET.SubElement(root, "metadata").text = about
    paper = Group(root)
    boxes = [each.box() for each in pictures]
    width = max([_LEAST_WIDTH, *(box.width + 2 * _MARGIN for box in boxes)])
    drawing = paper.group()
    y = _above(drawing, title, note, width)
    for picture, box in zip(pictures, boxes, strict=True):
        if len(pictures) > 1 and picture.title:
            drawing.text([picture.title], _MARGIN, y, _HEADING, text_anchor="start", fill=INK,
                         font_weight="bold")  # fmt: skip
            y += _HEADING + 8
        plane = drawing.group((_MARGIN - box.x, y - box.y))
        _Painter(plane, picture, marks).paint()
        y += box.height + _LABEL_ROOM
    y = _legend(drawing, marks, width, y)
    root.insert(1 if about else 0, ET.Element("rect", {
        "width": number(width), "height": number(y), "fill": PAPER,
    }))  # fmt: skip
    root.set("width", number(width))
    root.set("height", number(y))
    root.set("viewBox", f"0 0 {number(width)} {number(y)}")
    ET.indent(root, " ")
    return ET.tostring(root, encoding="unicode") + "\n"


def _above(to: Group, title: str, note: str, width: float) -> float:
    y = _MARGIN
    if not title and not note:
        return y
    for text, size, weight in ((title, _TITLE, "bold"), (note, _SMALL + 1, "normal")):
        lines = wrapped(text, width - 2 * _MARGIN, size)
        to.text(lines, _MARGIN, y, size, text_anchor="start", fill=INK, font_weight=weight)
        y += len(lines) * size * LINE_HEIGHT + 4
    return y + 14


def _legend(to: Group, marks: Marks, width: float, y: float) -> float:
    shown = marks.legend()
    if not shown:
        return y
    x = _MARGIN
    to.path(f"M{_MARGIN:g} {number(y)}H{number(width - _MARGIN)}", stroke="#dcdfe4")
    y += 12
    for ink, words in shown:
        wide = 34 + width_of(words, _SMALL) + 18
        if x + wide > width - _MARGIN and x > _MARGIN:
            x, y = _MARGIN, y + 22
        to.rectangle(x, y, 26, 14, rx=4, stroke=ink.stroke, fill=ink.fill, stroke_width=1.6)
        to.text([words], x + 34, y, _SMALL, text_anchor="start", fill=INK)
        x += wide
    return y + 28


class _Painter:
    """Paints one picture."""

    def __init__(self, to: Group, picture: Picture, marks: Marks) -> None:
        self.to = to
        self.picture = picture
        self.shapes = {shape.id: shape for shape in picture.shapes}
        self.marks = marks.on(ids_of(picture), picture.parents)
        self.inks = self.marks.inks()
        self.points: dict[str, tuple[Point, ...]] = {
            line.id: docked(line, self.shapes) for line in picture.lines
        }

    def paint(self) -> None:
        """Surfaces, then lines, then symbols, then names, then numbers."""
        below = [each for each in self.picture.shapes if _is_below(each)]
        for shape in below:
            self._shape(shape)
        for line in sorted(self.picture.lines, key=lambda each: each.id in self.inks):
            self._line(line)
        for shape in self.picture.shapes:
            if not _is_below(shape):
                self._shape(shape)
        names: list[Bounds] = []
        for shape in self.picture.shapes:
            if has_label(shape):
                names.append(draw_label(self.to, shape, self._text_ink(shape.id)))
        for line in self.picture.lines:
            if line.name:
                points = self.points[line.id]
                names.append(draw_line_label(self.to, line, points, self._text_ink(line.id)))
        Badges(self.to, names).paint(self.marks, self.shapes, self.points)

    def _text_ink(self, name: str) -> Ink:
        return self.inks.get(name, PLAIN)

    def _shape(self, shape: Shape) -> None:
        bounds = shape.bounds
        reason = self.marks.stuck.get(shape.id) or self.marks.waiting.get(shape.id, "")
        group = self.to.group((bounds.x, bounds.y), reason, data_element_id=shape.id)
        ink = self.inks.get(shape.id, PLAIN)
        if Trait.EXPANDED in shape.traits and shape.id in self.inks:
            ink = Ink(ink.stroke, PAPER, ink.text, ink.weight)  # its inside has colours of its own
        _drawer(shape)(group, shape, ink)

    def _line(self, line: Line) -> None:
        reason = self.marks.stuck.get(line.id) or self.marks.waiting.get(line.id, "")
        group = self.to.group(None, reason, data_element_id=line.id)
        dashes = "7 4" if line.id in self.marks.missing else ""
        draw_line(group, line, self.points[line.id], self.inks.get(line.id, PLAIN), dashes)


def _is_below(shape: Shape) -> bool:
    return Trait.EXPANDED in shape.traits or shape.kind in ("participant", "lane")


def _drawer(shape: Shape) -> Callable[[Group, Shape, Ink], None]:
    if shape.kind in _SURFACES:
        return _SURFACES[shape.kind]
    if shape.kind.endswith("Event"):
        return nodes.draw_event
    if shape.kind.endswith("Gateway"):
        return nodes.draw_gateway
    return nodes.draw_activity
