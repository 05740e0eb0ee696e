"""Draws SVG with nothing but the standard library. Lengths are pixels, y goes down."""

import re
from collections.abc import Sequence
from xml.etree import ElementTree as ET

FONT = "'Segoe UI', 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif"
SIZE = 11
"""Of text, unless said otherwise."""

_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_PIXELS_PER_LETTER = 0.58
"""Of the size; an average, on the safe side, of common sans-serif fonts."""


class Canvas:
    """A drawing, or with `parent` a group in one, whose tooltip is `title`."""

    def __init__(self, parent: "Canvas | None" = None, title: str = "") -> None:
        if parent is not None:
            self._element: ET.Element = ET.SubElement(parent._element, "g")
        else:
            attributes = {"xmlns": "http://www.w3.org/2000/svg", "font-family": FONT}
            self._element = ET.Element("svg", {**attributes, "font-size": str(SIZE)})
        if title:
            ET.SubElement(self._element, "title").text = _clean(title)

    def rectangle(
        self, x: float, y: float, width: float, height: float, fill: str, edge: str = ""
    ) -> None:
        """A filled box; with an edge, its corners are round."""
        box = {"x": x, "y": y, "width": width, "height": height}
        style = {"stroke": edge, "rx": "3"} if edge else {}
        self._add("rect", box, fill=fill, **style)

    def line(
        self, start: tuple[float, float], end: tuple[float, float], colour: str, dashes: str = ""
    ) -> None:
        """A thin line."""
        ends = {"x1": start[0], "y1": start[1], "x2": end[0], "y2": end[1]}
        style = {"stroke-dasharray": dashes} if dashes else {}
        self._add("line", ends, stroke=colour, **style)

    def shape(self, corners: Sequence[tuple[float, float]], fill: str) -> None:
        """A filled polygon."""
        points = " ".join(f"{_number(x)},{_number(y)}" for x, y in corners)
        self._add("polygon", {}, points=points, fill=fill)

    def text(
        self,
        x: float,
        y: float,
        text: str,
        fill: str,
        *,
        size: int = SIZE,
        bold: bool = False,
        anchor: str = "",
    ) -> None:
        """One line; `y` is its base line, `anchor` "middle" or "end" moves it left of `x`."""
        style = {"font-size": str(size)} if size != SIZE else {}
        style |= {"font-weight": "600"} if bold else {}
        style |= {"text-anchor": anchor} if anchor else {}
        self._add("text", {"x": x, "y": y}, fill=fill, **style).text = _clean(text)

    def document(self, width: float, height: float) -> str:
        """The whole drawing as a file's text."""
        self._element.set("width", _number(width))
        self._element.set("height", _number(height))
        self._element.set("viewBox", f"0 0 {_number(width)} {_number(height)}")
        ET.indent(self._element)
        return ET.tostring(self._element, encoding="unicode") + "\n"

    def _add(self, tag: str, lengths: dict[str, float], **style: str) -> ET.Element:
        attributes = {name: _number(length) for name, length in lengths.items()}
        return ET.SubElement(self._element, tag, {**attributes, **style})


def text_width(text: str, size: int = SIZE) -> float:
    """About how wide a text is."""
    return len(text) * size * _PIXELS_PER_LETTER


def cut(text: str, width: float, size: int = SIZE) -> str:
    """The text, or its beginning with an ellipsis if it is wider than `width`."""
    if text_width(text, size) <= width:
        return text
    letters = int(width / (size * _PIXELS_PER_LETTER)) - 1
    return f"{text[:letters].rstrip()}\u2026" if letters > 0 else ""


def _number(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _clean(text: str) -> str:
    """Without what XML cannot hold: a vehicle's error text may have anything in it."""
    return _NOT_XML.sub("\ufffd", text)
