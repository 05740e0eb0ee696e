"""Writes SVG with nothing but the standard library."""

import re
from collections.abc import Iterable, Sequence
from typing import TypeAlias
from xml.etree import ElementTree as ET

from m2pem.diagram.picture import Point
from m2pem.diagram.text import LINE_HEIGHT

_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


Style: TypeAlias = dict[str, str | float]
"""Attributes of SVG, `_` for `-`."""


class Group:
    """A group of a drawing. Attributes are given as keywords, `_` for `-`."""

    def __init__(self, element: ET.Element) -> None:
        self.element = element

    def group(self, at: Point | None = None, title: str = "", **style: str | float) -> "Group":
        """A group within, moved to `at`; `title` is its tooltip."""
        inner = self._add("g", style)
        if at is not None:
            inner.set("transform", f"translate({number(at[0])} {number(at[1])})")
        if title:
            ET.SubElement(inner, "title").text = clean(title)
        return Group(inner)

    def rectangle(
        self, x: float, y: float, width: float, height: float, **style: str | float
    ) -> None:
        """A box; `rx` rounds its corners."""
        self._add("rect", {"x": x, "y": y, "width": width, "height": height, **style})

    def circle(self, x: float, y: float, radius: float, **style: str | float) -> None:
        """A circle around a point."""
        self._add("circle", {"cx": x, "cy": y, "r": radius, **style})

    def path(self, data: str, **style: str | float) -> None:
        """A path in the words of SVG."""
        self._add("path", {"d": data, **style})

    def polygon(self, corners: Iterable[Point], **style: str | float) -> None:
        """A closed shape."""
        self.path("M" + "L".join(f"{number(x)} {number(y)}" for x, y in corners) + "Z", **style)

    def text(
        self, lines: Sequence[str], x: float, top: float, size: float, **style: str | float
    ) -> None:
        """Lines one below the other, the first beginning at `top`; centred on `x` by default."""
        attributes: dict[str, str | float] = {
            "font_size": size, "text_anchor": "middle", "stroke": "none", **style
        }  # fmt: skip
        text = self._add("text", attributes)
        for row, line in enumerate(lines):
            span = ET.SubElement(text, "tspan", x=number(x))
            span.set("y", number(top + size * (0.95 + row * LINE_HEIGHT)))
            span.text = clean(line)

    def _add(self, tag: str, attributes: dict[str, str | float]) -> ET.Element:
        written = {
            name.replace("_", "-"): value if isinstance(value, str) else number(value)
            for name, value in attributes.items()
        }
        return ET.SubElement(self.element, tag, written)


def number(value: float) -> str:
    """Short, and never in the form 1e-05."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def clean(text: str) -> str:
    """Without what XML cannot hold."""
    return _NOT_XML.sub("\ufffd", text)
