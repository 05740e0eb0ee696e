"""Draws what tokens do not visit: pools, lanes, data, annotations, groups."""

from m2pem.diagram import glyphs
from m2pem.diagram.ink import Ink
from m2pem.diagram.picture import Shape, Trait
from m2pem.diagram.svg import Group, Style
from m2pem.diagram.text import LINE_HEIGHT, cut, wrapped

_SIZE = 12
_HEADER = 30


def draw_pool(to: Group, shape: Shape, ink: Ink) -> None:
    """A pool with its name beside it, or in the middle when its inside is not shown."""
    width, height = shape.bounds.width, shape.bounds.height
    to.rectangle(0, 0, width, height, stroke=ink.stroke, fill=ink.fill, stroke_width=1.5)
    if Trait.EXPANDED not in shape.traits:
        lines = wrapped(shape.name, width - 20, _SIZE)
        tall = len(lines) * _SIZE * LINE_HEIGHT
        to.text(lines, width / 2, (height - tall) / 2, _SIZE, fill=ink.text)
    elif Trait.VERTICAL in shape.traits:
        to.path(f"M0 {_HEADER}H{width:g}", stroke=ink.stroke, stroke_width=1.5)
        _header(to, shape, ink)
    else:
        to.path(f"M{_HEADER} 0V{height:g}", stroke=ink.stroke, stroke_width=1.5)
        _header(to, shape, ink)
    if Trait.PARALLEL_INSTANCES in shape.traits:
        glyphs.upright_bars(to, width / 2, height - 11, ink.stroke, ink.fill)


def draw_lane(to: Group, shape: Shape, ink: Ink) -> None:
    """A part of a pool."""
    width, height = shape.bounds.width, shape.bounds.height
    to.rectangle(0, 0, width, height, stroke=ink.stroke, fill="none", stroke_width=1.2)
    _header(to, shape, ink)


def _header(to: Group, shape: Shape, ink: Ink) -> None:
    width, height = shape.bounds.width, shape.bounds.height
    middle = (_HEADER - _SIZE) / 2 - 1
    if Trait.VERTICAL in shape.traits:
        to.text([cut(shape.name, width - 10, _SIZE)], width / 2, middle, _SIZE, fill=ink.text)
        return
    turned = to.group()
    turned.element.set("transform", f"translate(0 {height:g}) rotate(-90)")
    lines = wrapped(shape.name, height - 10, _SIZE, 2)
    top = (_HEADER - len(lines) * _SIZE * LINE_HEIGHT) / 2
    turned.text(lines, height / 2, top, _SIZE, fill=ink.text)


def draw_data(to: Group, shape: Shape, ink: Ink) -> None:
    """A sheet with a folded corner."""
    width, height = shape.bounds.width, shape.bounds.height
    fold = min(width, height) * 0.28
    style: Style = {"stroke": ink.stroke, "stroke_width": 1.6, "stroke_linejoin": "round"}
    corners = [(0.0, 0.0), (width - fold, 0.0), (width, fold), (width, height), (0.0, height)]
    to.polygon(corners, fill=ink.fill, **style)
    to.path(f"M{width - fold:g} 0V{fold:g}H{width:g}", fill="none", **style)
    if Trait.COLLECTION in shape.traits:
        to.path(
            "".join(f"M{width / 2 + dx:g} {height - 11:g}v8" for dx in (-4, 0, 4)),
            stroke=ink.stroke,
            stroke_width=2,
        )
    if Trait.INPUT in shape.traits or Trait.OUTPUT in shape.traits:
        sign = to.group((2, 3))
        sign.element.set("transform", "translate(11 12) scale(0.8)")
        fill = ink.stroke if Trait.OUTPUT in shape.traits else ink.fill
        glyphs.arrow_right(sign, 0, 0, ink.stroke, fill)


def draw_store(to: Group, shape: Shape, ink: Ink) -> None:
    """A cylinder."""
    width, height = shape.bounds.width, shape.bounds.height
    curve = height * 0.14
    style: Style = {"stroke": ink.stroke, "stroke_width": 1.6}
    half = f"{width / 2:g} {curve:g}"
    to.path(
        f"M0 {curve:g}A{half} 0 0 1 {width:g} {curve:g}V{height - curve:g}"
        f"A{half} 0 0 1 0 {height - curve:g}Z",
        fill=ink.fill,
        **style,
    )
    for k in (1, 1.8, 2.6):
        to.path(f"M0 {curve * k:g}A{half} 0 0 0 {width:g} {curve * k:g}", fill="none", **style)


def draw_annotation(to: Group, shape: Shape, ink: Ink) -> None:
    """A text behind a bracket."""
    width, height = shape.bounds.width, shape.bounds.height
    to.path(f"M10 0H0V{height:g}H10", stroke=ink.stroke, fill="none", stroke_width=1.5)
    most = max(int((height - 6) // (_SIZE * LINE_HEIGHT)), 1)
    lines = wrapped(shape.name, width - 10, _SIZE, most)
    to.text(lines, 6, 5, _SIZE, fill=ink.text, text_anchor="start")


def draw_group(to: Group, shape: Shape, ink: Ink) -> None:
    """A dashed frame."""
    width, height = shape.bounds.width, shape.bounds.height
    to.rectangle(
        0, 0, width, height, rx=10, stroke=ink.stroke, fill="none", stroke_width=1.5,
        stroke_dasharray="10 6 1 6",
    )  # fmt: skip
