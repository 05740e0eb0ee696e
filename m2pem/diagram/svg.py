"""Writes SVG with nothing but the standard library. Lengths are pixels, y goes down."""

import re
from collections.abc import Iterable, Sequence
from typing import TypeAlias
from xml.etree import ElementTree as ET

from m2pem.diagram.picture import Point
from m2pem.diagram.style import BACKGROUND, FONT, LINE_HEIGHT

_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")

Attributes: TypeAlias = dict[str, str | float]
"""Attributes of SVG, `_` for `-`."""


class Group:
    """A group of a drawing. Attributes are given as keywords, `_` for `-`."""

    def __init__(self, element: ET.Element) -> None:
        self.element = element

    def group(self, at: Point | None = None, title: str = "", **attributes: str | float) -> "Group":
        """A group within, moved to `at`; `title` is its tooltip."""
        inner = self._add("g", attributes)
        if at is not None:
            inner.set("transform", f"translate({number(at[0])} {number(at[1])})")
        if title:
            ET.SubElement(inner, "title").text = clean(title)
        return Group(inner)

    def rectangle(
        self, x: float, y: float, width: float, height: float, **attributes: str | float
    ) -> None:
        """Draw a rectangle; `rx` rounds its corners."""
        self._add("rect", {"x": x, "y": y, "width": width, "height": height, **attributes})

    def circle(self, x: float, y: float, radius: float, **attributes: str | float) -> None:
        """Draw a circle around a point."""
        self._add("circle", {"cx": x, "cy": y, "r": radius, **attributes})

    def line(self, start: Point, end: Point, **attributes: str | float) -> None:
        """Draw a straight line."""
        (x1, y1), (x2, y2) = start, end
        self._add("line", {"x1": x1, "y1": y1, "x2": x2, "y2": y2, **attributes})

    def path(self, data: str, **attributes: str | float) -> None:
        """Draw a path, given in the syntax of SVG."""
        self._add("path", {"d": data, **attributes})

    def polygon(self, corners: Iterable[Point], **attributes: str | float) -> None:
        """Draw a closed shape."""
        data = "M" + "L".join(f"{number(x)} {number(y)}" for x, y in corners) + "Z"
        self.path(data, **attributes)

    def text(
        self, lines: Sequence[str], x: float, top: float, size: float, **attributes: str | float
    ) -> None:
        """Write lines one below the other from `top` on; centred on `x` by default."""
        text = self._add(
            "text", {"font_size": size, "text_anchor": "middle", "stroke": "none", **attributes}
        )
        for row, line in enumerate(lines):
            span = ET.SubElement(text, "tspan", x=number(x))
            span.set("y", number(top + size * (0.95 + row * LINE_HEIGHT)))
            span.text = clean(line)

    def text_line(
        self, text: str, x: float, baseline: float, size: float, **attributes: str | float
    ) -> None:
        """Write one line, beginning at `x` by default."""
        found = self._add("text", {"x": x, "y": baseline, "font_size": size, **attributes})
        found.text = clean(text)

    def _add(self, tag: str, attributes: Attributes) -> ET.Element:
        written = {
            name.replace("_", "-"): value if isinstance(value, str) else number(value)
            for name, value in attributes.items()
        }
        return ET.SubElement(self.element, tag, written)


class Drawing(Group):
    """A whole drawing; `about` is kept in its metadata."""

    def __init__(self, about: str = "") -> None:
        attributes = {"xmlns": "http://www.w3.org/2000/svg", "font-family": FONT}
        super().__init__(ET.Element("svg", attributes))
        if about:
            ET.SubElement(self.element, "metadata").text = about
        self._background = ET.SubElement(self.element, "rect")

    def document(self, width: float, height: float) -> str:
        """Return the text of an SVG file of that size."""
        for element in (self._background, self.element):
            element.set("width", number(width))
            element.set("height", number(height))
        self._background.set("fill", BACKGROUND)
        self.element.set("viewBox", f"0 0 {number(width)} {number(height)}")
        ET.indent(self.element, " ")
        return ET.tostring(self.element, encoding="unicode") + "\n"


def number(value: float) -> str:
    """Return a short decimal number, never in the form 1e-05."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def clean(text: str) -> str:
    """Return the text without what XML cannot hold."""
    return _NOT_XML.sub("\ufffd", text)
