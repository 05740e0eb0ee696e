"""Draws flow nodes: events, gateways, activities. Each at 0, 0 of its own group."""

from m2pem.diagram import glyphs
from m2pem.diagram.glyphs import Glyph
from m2pem.diagram.ink import Ink
from m2pem.diagram.layout.model import SUBPROCESSES
from m2pem.diagram.picture import Shape, Trait
from m2pem.diagram.svg import Group, Style
from m2pem.diagram.text import LINE_HEIGHT, cut, wrapped

SIZE = 12
"""Of texts inside of symbols."""
_MARKER_ROW = 14
_GLYPH_BOX = 36.0  # glyphs of events are made for a circle of this size


def draw_event(to: Group, shape: Shape, ink: Ink) -> None:
    """A circle, two for what is between start and end, a thick one for an end."""
    width, height = shape.bounds.width, shape.bounds.height
    radius = min(width, height) / 2
    x, y = width / 2, height / 2
    dashes: Style = {"stroke_dasharray": "5 3"} if Trait.NON_INTERRUPTING in shape.traits else {}
    thick = 4 if shape.kind == "endEvent" else 1.5 if _is_double(shape) else 2
    outer: Style = {"stroke_width": thick + ink.weight, "stroke": ink.stroke, "fill": ink.fill}
    to.circle(x, y, radius, **outer, **dashes)
    if _is_double(shape):
        inner: Style = {"stroke_width": 1.5 + ink.weight / 2, "stroke": ink.stroke, "fill": "none"}
        to.circle(x, y, radius - 3.5, **inner, **dashes)
    glyph = _glyph_of(shape)
    if glyph is not None:
        sign = to.group((x, y), stroke_linejoin="round")
        if abs(radius * 2 - _GLYPH_BOX) > 1:
            sign.element.set(
                "transform", f"translate({x:g} {y:g}) scale({2 * radius / _GLYPH_BOX:g})"
            )
        fill = ink.stroke if Trait.THROWING in shape.traits else ink.fill
        glyph(sign, 0, 0, ink.stroke, fill)


def _is_double(shape: Shape) -> bool:
    return shape.kind in ("boundaryEvent", "intermediateCatchEvent", "intermediateThrowEvent")


def _glyph_of(shape: Shape) -> Glyph | None:
    if not shape.definitions:
        return None
    if len(shape.definitions) > 1:
        return glyphs.plus if Trait.PARALLEL_MULTIPLE in shape.traits else glyphs.pentagon
    return glyphs.EVENTS.get(shape.definitions[0])


def draw_gateway(to: Group, shape: Shape, ink: Ink) -> None:
    """A diamond with the sign of its kind."""
    width, height = shape.bounds.width, shape.bounds.height
    x, y = width / 2, height / 2
    to.polygon(
        [(x, 0), (width, y), (x, height), (0, y)],
        stroke=ink.stroke, fill=ink.fill, stroke_width=2 + ink.weight, stroke_linejoin="round",
    )  # fmt: skip
    if shape.kind == "exclusiveGateway" and Trait.MARKED not in shape.traits:
        return
    glyph = glyphs.GATEWAYS.get(shape.kind)
    if glyph is not None:
        glyph(to, x, y, ink.stroke, ink.stroke)
    elif shape.kind == "eventBasedGateway":
        to.circle(x, y, 13, stroke=ink.stroke, fill="none", stroke_width=1)
        if Trait.INSTANTIATING not in shape.traits:
            to.circle(x, y, 10.5, stroke=ink.stroke, fill="none", stroke_width=1)
        inner = to.group((x, y))
        inner.element.set("transform", f"translate({x:g} {y:g}) scale(0.8)")
        sign = glyphs.plus if Trait.PARALLEL in shape.traits else glyphs.pentagon
        sign(inner, 0, 0, ink.stroke, "none")


def draw_activity(to: Group, shape: Shape, ink: Ink) -> None:
    """A box with round corners; of an expanded subprocess, the one around its inside."""
    width, height = shape.bounds.width, shape.bounds.height
    expanded = Trait.EXPANDED in shape.traits
    stroke: Style = {"stroke": ink.stroke, "rx": 10.0}
    around: Style = {
        "stroke_width": (5 if shape.kind == "callActivity" else 2) + ink.weight,
        **stroke,
    }
    if Trait.EVENT_SUBPROCESS in shape.traits:
        around["stroke_dasharray"] = "1 4"
        around["stroke_linecap"] = "round"
    to.rectangle(0, 0, width, height, fill=ink.fill, **around)
    if shape.kind == "transaction":
        inner: Style = {"stroke": ink.stroke, "rx": 7.0, "stroke_width": 1.2}
        to.rectangle(3.5, 3.5, width - 7, height - 7, fill="none", **inner)
    glyph = glyphs.TASKS.get(shape.kind)
    if glyph is not None:
        glyph(to, 16, 15, ink.stroke, ink.fill)
    markers = _markers(shape)
    _name(to, shape, ink, expanded=expanded, icon=glyph is not None, markers=bool(markers))
    step = 19.0
    left = width / 2 - step * (len(markers) - 1) / 2
    for column, marker in enumerate(markers):
        marker(to, left + column * step, height - 11, ink.stroke, ink.fill)


def _name(to: Group, shape: Shape, ink: Ink, *, expanded: bool, icon: bool, markers: bool) -> None:
    width, height = shape.bounds.width, shape.bounds.height
    if expanded:
        to.text([cut(shape.name, width - 24, SIZE)], width / 2, 7, SIZE, fill=ink.text)
        return
    room = height - 8 - (_MARKER_ROW if markers else 0)
    most = max(int(room // (SIZE * LINE_HEIGHT)), 1)
    lines = wrapped(shape.name, width - 10, SIZE, most)
    tall = len(lines) * SIZE * LINE_HEIGHT
    top = (height - (_MARKER_ROW if markers else 0) - tall) / 2
    if icon:  # below the sign in the corner, as far as there is room
        top = min(max(top, 26), max(height - tall - 4 - (_MARKER_ROW if markers else 0), 2))
        top = top if top + tall <= height else (height - tall) / 2
    to.text(lines, width / 2, top, SIZE, fill=ink.text)


def _markers(shape: Shape) -> list[Glyph]:
    of_traits = {
        Trait.LOOP: glyphs.loop,
        Trait.PARALLEL_INSTANCES: glyphs.upright_bars,
        Trait.SEQUENTIAL_INSTANCES: glyphs.level_bars,
        Trait.COMPENSATION: glyphs.backwards,
    }
    found: list[Glyph] = [glyph for trait, glyph in of_traits.items() if trait in shape.traits]
    closed = Trait.EXPANDED not in shape.traits
    if closed and (shape.kind == "callActivity" or shape.kind in SUBPROCESSES):
        found.append(glyphs.boxed_plus)
    if shape.kind == "adHocSubProcess":
        found.append(glyphs.tilde)
    return found
