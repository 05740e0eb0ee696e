"""Draws symbols: events, gateways, activities, pools, lanes, data and artifacts."""

import math
from collections.abc import Callable

from m2pem.diagram.layout.model import SUBPROCESSES
from m2pem.diagram.picture import Point, Shape, Trait
from m2pem.diagram.style import LINE_HEIGHT, Style, cut, wrapped
from m2pem.diagram.svg import Attributes, Group

Icon = Callable[[Group, float, float, str, str], None]
"""Draws at x, y with a stroke's and an area's colour."""


def star(x: float, y: float, radius: float, corners: int) -> list[Point]:
    """The corners of a regular polygon, the first one upwards."""
    return [
        (x + radius * math.sin(a), y - radius * math.cos(a))
        for a in (2 * math.pi * k / corners for k in range(corners))
    ]


def envelope(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Message; sending and receiving."""
    to.rectangle(x - 8, y - 5.5, 16, 11, stroke=stroke, fill=fill, stroke_width=1)
    flap = stroke if fill != stroke else "#ffffff"
    to.path(f"M{x - 8} {y - 5.5}L{x} {y + 1}L{x + 8} {y - 5.5}", stroke=flap, fill="none")


def clock(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Timer."""
    to.circle(x, y, 9.5, stroke=stroke, fill="#ffffff", stroke_width=1.4)
    for dx, dy in star(0, 0, 1, 12):
        to.path(
            f"M{x + dx * 7.3:.2f} {y + dy * 7.3:.2f}L{x + dx * 9:.2f} {y + dy * 9:.2f}",
            stroke=stroke,
            stroke_width=1,
        )
    to.path(f"M{x + 1.8} {y - 6}L{x} {y}L{x + 4.8} {y + 0.6}", stroke=stroke, fill="none")


def triangle(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Signal."""
    to.polygon([(x, y - 9), (x + 9, y + 6.5), (x - 9, y + 6.5)], stroke=stroke, fill=fill)


def lightning(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Error."""
    corners = [(-8, 9), (-3.5, -7.5), (2, 1.2), (8, -9), (3.6, 8), (-2, -0.8)]
    to.polygon([(x + dx, y + dy) for dx, dy in corners], stroke=stroke, fill=fill)


def arrow_up(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Escalation."""
    to.polygon(
        [(x, y - 10), (x + 7, y + 8), (x, y + 1.5), (x - 7, y + 8)], stroke=stroke, fill=fill
    )


def sheet(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Conditional."""
    to.rectangle(x - 6.5, y - 8.5, 13, 17, stroke=stroke, fill="#ffffff")
    for dy in (-5.2, -1.8, 1.8, 5.2):
        to.path(f"M{x - 4.2} {y + dy}H{x + 4.2}", stroke=stroke)


def arrow_right(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Link."""
    corners = [(-9, -3.5), (2, -3.5), (2, -8), (9.5, 0), (2, 8), (2, 3.5), (-9, 3.5)]
    to.polygon([(x + dx, y + dy) for dx, dy in corners], stroke=stroke, fill=fill)


def disc(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Terminate."""
    to.circle(x, y, 9.5, stroke=stroke, fill=stroke)


def _thick(to: Group, corners: list[Point], stroke: str, fill: str) -> None:
    to.polygon(corners, stroke=stroke, fill=fill, stroke_width=1.2)


def _plus(x: float, y: float, half: float, turn_rad: float = 0.0) -> list[Point]:
    quarter = [(half, -10), (half, -half), (10, -half)]
    points: list[Point] = []
    for k in range(4):
        a = turn_rad + k * math.pi / 2
        points += [
            (x + px * math.cos(a) - py * math.sin(a), y + px * math.sin(a) + py * math.cos(a))
            for px, py in quarter
        ]
    return points


def cross(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Cancel; exclusive gateways."""
    _thick(to, _plus(x, y, 1.9, math.pi / 4), stroke, fill)


def plus(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Parallel gateways; parallel multiple events."""
    _thick(to, _plus(x, y, 2), stroke, fill)


def asterisk(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Complex gateways."""
    for dx, dy in star(0, 0, 11, 8)[:4]:
        to.path(f"M{x - dx:.2f} {y - dy:.2f}L{x + dx:.2f} {y + dy:.2f}", stroke=stroke,
                stroke_width=3.6)  # fmt: skip


def ring(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Inclusive gateways."""
    to.circle(x, y, 10.5, stroke=stroke, fill="none", stroke_width=2.8)


def pentagon(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Multiple events; event-based gateways."""
    to.polygon(star(x, y, 9, 5), stroke=stroke, fill=fill)


def backwards(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Compensation."""
    for dx in (0, 8.5):
        left = x - 9 + dx
        to.polygon(
            [(left, y), (left + 8.5, y - 6.5), (left + 8.5, y + 6.5)], stroke=stroke, fill=fill
        )


EVENTS: dict[str, Icon] = {
    "message": envelope,
    "timer": clock,
    "signal": triangle,
    "error": lightning,
    "escalation": arrow_up,
    "conditional": sheet,
    "link": arrow_right,
    "terminate": disc,
    "cancel": cross,
    "compensate": backwards,
}
"""By event definition."""

GATEWAYS: dict[str, Icon] = {
    "exclusiveGateway": cross,
    "parallelGateway": plus,
    "inclusiveGateway": ring,
    "complexGateway": asterisk,
}


# --- kinds of tasks: in the upper left corner -----------------------------------------------------


def person(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """User task."""
    to.path(
        f"M{x - 7.5} {y + 8}V{y + 4.5}C{x - 7.5} {y + 0.5} {x - 4} {y - 0.2} {x} {y - 0.2}"
        f"S{x + 7.5} {y + 0.5} {x + 7.5} {y + 4.5}V{y + 8}Z",
        stroke=stroke,
        fill=fill,
    )
    to.circle(x, y - 4.2, 3.9, stroke=stroke, fill=fill)
    to.path(f"M{x - 3.9} {y - 4.2}A3.9 3.9 0 0 1 {x + 3.9} {y - 4.2}Z", stroke=stroke, fill=stroke)


def gear(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Service task."""
    corners: list[Point] = []
    for k in range(8):
        for offset, radius in ((-0.3, 6), (-0.2, 8.4), (0.2, 8.4), (0.3, 6)):
            a = 2 * math.pi * (k + offset) / 8
            corners.append((x + radius * math.sin(a), y - radius * math.cos(a)))
    to.polygon(corners, stroke=stroke, fill=fill)
    to.circle(x, y, 2.7, stroke=stroke, fill=fill)


def scroll(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Script task."""
    to.path(
        f"M{x - 3.5} {y - 8}H{x + 7.5}C{x + 2.5} {y - 3.5} {x + 9} {y + 2.5} {x + 3.5} {y + 8}"
        f"H{x - 7.5}C{x - 2} {y + 2.5} {x - 8.5} {y - 3.5} {x - 3.5} {y - 8}Z",
        stroke=stroke,
        fill=fill,
    )
    for dy, dx in ((-4.5, -0.6), (-1.5, -0.6), (1.5, 0.2), (4.5, 0)):
        to.path(f"M{x - 3.2 + dx} {y + dy}H{x + 2.8 + dx}", stroke=stroke)


def table(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Business rule task."""
    to.rectangle(x - 8.5, y - 6.5, 17, 13, stroke=stroke, fill=fill)
    to.rectangle(x - 8.5, y - 6.5, 17, 4, stroke=stroke, fill=stroke)
    to.path(f"M{x - 8.5} {y + 2}H{x + 8.5}M{x - 3} {y - 2.5}V{y + 6.5}", stroke=stroke)


def hand(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Manual task."""
    # The tip of each finger is a half circle, about.
    fingers = "".join(f"H{length}c1.6 0 1.6 2.4 0 2.4" for length in (7, 7.4, 6.8, 5.6))
    sign = to.group((x, y))
    sign.path(f"M-8 -1.5L-3 -6.5H1c1.6 0 1.6 2.5 0 2.5{fingers}H-8Z", stroke=stroke, fill=fill)
    for dy in (-1.6, 0.8, 3.2):
        sign.path(f"M1.5 {dy}H6.6", stroke=stroke)


def filled_envelope(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Send task."""
    envelope(to, x, y, stroke, stroke)


TASKS: dict[str, Icon] = {
    "userTask": person,
    "serviceTask": gear,
    "scriptTask": scroll,
    "sendTask": filled_envelope,
    "receiveTask": envelope,
    "manualTask": hand,
    "businessRuleTask": table,
}
"""By the element's tag."""


# --- markers at the lower edge of activities ------------------------------------------------------


def loop(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Repeats."""
    to.path(f"M{x - 2.5} {y + 5.6}A6 6 0 1 1 {x + 2.5} {y + 5.6}", stroke=stroke, fill="none",
            stroke_width=1.6)  # fmt: skip
    to.path(f"M{x - 7} {y + 6}H{x - 2.2}V{y + 1.2}", stroke=stroke, fill="none", stroke_width=1.4)


def upright_bars(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Instances at once."""
    to.path("".join(f"M{x + dx} {y - 6}V{y + 6}" for dx in (-4.5, 0, 4.5)), stroke=stroke,
            stroke_width=2.4)  # fmt: skip


def level_bars(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Instances one after the other."""
    to.path("".join(f"M{x - 6} {y + dy}H{x + 6}" for dy in (-4.5, 0, 4.5)), stroke=stroke,
            stroke_width=2.4)  # fmt: skip


def boxed_plus(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Has an inside that is not drawn here."""
    to.rectangle(x - 7, y - 7, 14, 14, stroke=stroke, fill=fill)
    to.path(f"M{x - 4.2} {y}H{x + 4.2}M{x} {y - 4.2}V{y + 4.2}", stroke=stroke, stroke_width=1.3)


def tilde(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Ad hoc."""
    to.path(f"M{x - 7} {y + 2}C{x - 4} {y - 5} {x - 1.5} {y - 2.5} {x} {y}S{x + 4} {y + 5} {x + 7}"
            f" {y - 2}", stroke=stroke, fill="none", stroke_width=2.2)  # fmt: skip


SIZE = 12
"""Of texts inside of symbols."""
_MARKER_ROW = 14
_ICON_BOX = 36.0  # glyphs of events are made for a circle of this size


def draw_event(to: Group, shape: Shape, style: Style) -> None:
    """A circle, two for what is between start and end, a thick one for an end."""
    width, height = shape.bounds.width, shape.bounds.height
    radius = min(width, height) / 2
    x, y = width / 2, height / 2
    dashes: Attributes = (
        {"stroke_dasharray": "5 3"} if Trait.NON_INTERRUPTING in shape.traits else {}
    )
    thick = 4 if shape.kind == "endEvent" else 1.5 if _is_double(shape) else 2
    outer: Attributes = {
        "stroke_width": thick + style.weight,
        "stroke": style.stroke,
        "fill": style.fill,
    }
    to.circle(x, y, radius, **outer, **dashes)
    if _is_double(shape):
        inner: Attributes = {
            "stroke_width": 1.5 + style.weight / 2,
            "stroke": style.stroke,
            "fill": "none",
        }
        to.circle(x, y, radius - 3.5, **inner, **dashes)
    icon = _icon_of(shape)
    if icon is not None:
        sign = to.group((x, y), stroke_linejoin="round")
        if abs(radius * 2 - _ICON_BOX) > 1:
            sign.element.set(
                "transform", f"translate({x:g} {y:g}) scale({2 * radius / _ICON_BOX:g})"
            )
        fill = style.stroke if Trait.THROWING in shape.traits else style.fill
        icon(sign, 0, 0, style.stroke, fill)


def _is_double(shape: Shape) -> bool:
    return shape.kind in ("boundaryEvent", "intermediateCatchEvent", "intermediateThrowEvent")


def _icon_of(shape: Shape) -> Icon | None:
    if not shape.definitions:
        return None
    if len(shape.definitions) > 1:
        return plus if Trait.PARALLEL_MULTIPLE in shape.traits else pentagon
    return EVENTS.get(shape.definitions[0])


def draw_gateway(to: Group, shape: Shape, style: Style) -> None:
    """A diamond with the sign of its kind."""
    width, height = shape.bounds.width, shape.bounds.height
    x, y = width / 2, height / 2
    to.polygon(
        [(x, 0), (width, y), (x, height), (0, y)],
        stroke=style.stroke,
        fill=style.fill,
        stroke_width=2 + style.weight,
        stroke_linejoin="round",
    )
    if shape.kind == "exclusiveGateway" and Trait.MARKED not in shape.traits:
        return
    icon = GATEWAYS.get(shape.kind)
    if icon is not None:
        icon(to, x, y, style.stroke, style.stroke)
    elif shape.kind == "eventBasedGateway":
        to.circle(x, y, 13, stroke=style.stroke, fill="none", stroke_width=1)
        if Trait.INSTANTIATING not in shape.traits:
            to.circle(x, y, 10.5, stroke=style.stroke, fill="none", stroke_width=1)
        inner = to.group((x, y))
        inner.element.set("transform", f"translate({x:g} {y:g}) scale(0.8)")
        sign = plus if Trait.PARALLEL in shape.traits else pentagon
        sign(inner, 0, 0, style.stroke, "none")


def draw_activity(to: Group, shape: Shape, style: Style) -> None:
    """A box with round corners; of an expanded subprocess, the one around its inside."""
    width, height = shape.bounds.width, shape.bounds.height
    expanded = Trait.EXPANDED in shape.traits
    stroke: Attributes = {"stroke": style.stroke, "rx": 10.0}
    around: Attributes = {
        "stroke_width": (5 if shape.kind == "callActivity" else 2) + style.weight,
        **stroke,
    }
    if Trait.EVENT_SUBPROCESS in shape.traits:
        around["stroke_dasharray"] = "1 4"
        around["stroke_linecap"] = "round"
    to.rectangle(0, 0, width, height, fill=style.fill, **around)
    if shape.kind == "transaction":
        inner: Attributes = {"stroke": style.stroke, "rx": 7.0, "stroke_width": 1.2}
        to.rectangle(3.5, 3.5, width - 7, height - 7, fill="none", **inner)
    icon = TASKS.get(shape.kind)
    if icon is not None:
        icon(to, 16, 15, style.stroke, style.fill)
    markers = _markers(shape)
    _name(to, shape, style, expanded=expanded, icon=icon is not None, markers=bool(markers))
    step = 19.0
    left = width / 2 - step * (len(markers) - 1) / 2
    for column, marker in enumerate(markers):
        marker(to, left + column * step, height - 11, style.stroke, style.fill)


def _name(
    to: Group, shape: Shape, style: Style, *, expanded: bool, icon: bool, markers: bool
) -> None:
    width, height = shape.bounds.width, shape.bounds.height
    if expanded:
        to.text([cut(shape.name, width - 24, SIZE)], width / 2, 7, SIZE, fill=style.text)
        return
    room = height - 8 - (_MARKER_ROW if markers else 0)
    most = max(int(room // (SIZE * LINE_HEIGHT)), 1)
    lines = wrapped(shape.name, width - 10, SIZE, most)
    tall = len(lines) * SIZE * LINE_HEIGHT
    top = (height - (_MARKER_ROW if markers else 0) - tall) / 2
    if icon:  # below the sign in the corner, as far as there is room
        top = min(max(top, 26), max(height - tall - 4 - (_MARKER_ROW if markers else 0), 2))
        top = top if top + tall <= height else (height - tall) / 2
    to.text(lines, width / 2, top, SIZE, fill=style.text)


def _markers(shape: Shape) -> list[Icon]:
    of_traits = {
        Trait.LOOP: loop,
        Trait.PARALLEL_INSTANCES: upright_bars,
        Trait.SEQUENTIAL_INSTANCES: level_bars,
        Trait.COMPENSATION: backwards,
    }
    found: list[Icon] = [icon for trait, icon in of_traits.items() if trait in shape.traits]
    closed = Trait.EXPANDED not in shape.traits
    if closed and (shape.kind == "callActivity" or shape.kind in SUBPROCESSES):
        found.append(boxed_plus)
    if shape.kind == "adHocSubProcess":
        found.append(tilde)
    return found


_HEADER = 30


def draw_pool(to: Group, shape: Shape, style: Style) -> None:
    """A pool with its name beside it, or in the middle when its inside is not shown."""
    width, height = shape.bounds.width, shape.bounds.height
    to.rectangle(0, 0, width, height, stroke=style.stroke, fill=style.fill, stroke_width=1.5)
    if Trait.EXPANDED not in shape.traits:
        lines = wrapped(shape.name, width - 20, SIZE)
        tall = len(lines) * SIZE * LINE_HEIGHT
        to.text(lines, width / 2, (height - tall) / 2, SIZE, fill=style.text)
    elif Trait.VERTICAL in shape.traits:
        to.path(f"M0 {_HEADER}H{width:g}", stroke=style.stroke, stroke_width=1.5)
        _header(to, shape, style)
    else:
        to.path(f"M{_HEADER} 0V{height:g}", stroke=style.stroke, stroke_width=1.5)
        _header(to, shape, style)
    if Trait.PARALLEL_INSTANCES in shape.traits:
        upright_bars(to, width / 2, height - 11, style.stroke, style.fill)


def draw_lane(to: Group, shape: Shape, style: Style) -> None:
    """A part of a pool."""
    width, height = shape.bounds.width, shape.bounds.height
    to.rectangle(0, 0, width, height, stroke=style.stroke, fill="none", stroke_width=1.2)
    _header(to, shape, style)


def _header(to: Group, shape: Shape, style: Style) -> None:
    width, height = shape.bounds.width, shape.bounds.height
    middle = (_HEADER - SIZE) / 2 - 1
    if Trait.VERTICAL in shape.traits:
        to.text([cut(shape.name, width - 10, SIZE)], width / 2, middle, SIZE, fill=style.text)
        return
    turned = to.group()
    turned.element.set("transform", f"translate(0 {height:g}) rotate(-90)")
    lines = wrapped(shape.name, height - 10, SIZE, 2)
    top = (_HEADER - len(lines) * SIZE * LINE_HEIGHT) / 2
    turned.text(lines, height / 2, top, SIZE, fill=style.text)


def draw_data(to: Group, shape: Shape, style: Style) -> None:
    """A sheet with a folded corner."""
    width, height = shape.bounds.width, shape.bounds.height
    fold = min(width, height) * 0.28
    attributes: Attributes = {
        "stroke": style.stroke,
        "stroke_width": 1.6,
        "stroke_linejoin": "round",
    }
    corners = [(0.0, 0.0), (width - fold, 0.0), (width, fold), (width, height), (0.0, height)]
    to.polygon(corners, fill=style.fill, **attributes)
    to.path(f"M{width - fold:g} 0V{fold:g}H{width:g}", fill="none", **attributes)
    if Trait.COLLECTION in shape.traits:
        to.path(
            "".join(f"M{width / 2 + dx:g} {height - 11:g}v8" for dx in (-4, 0, 4)),
            stroke=style.stroke,
            stroke_width=2,
        )
    if Trait.INPUT in shape.traits or Trait.OUTPUT in shape.traits:
        sign = to.group((2, 3))
        sign.element.set("transform", "translate(11 12) scale(0.8)")
        fill = style.stroke if Trait.OUTPUT in shape.traits else style.fill
        arrow_right(sign, 0, 0, style.stroke, fill)


def draw_store(to: Group, shape: Shape, style: Style) -> None:
    """A cylinder."""
    width, height = shape.bounds.width, shape.bounds.height
    curve = height * 0.14
    attributes: Attributes = {"stroke": style.stroke, "stroke_width": 1.6}
    half = f"{width / 2:g} {curve:g}"
    to.path(
        f"M0 {curve:g}A{half} 0 0 1 {width:g} {curve:g}V{height - curve:g}"
        f"A{half} 0 0 1 0 {height - curve:g}Z",
        fill=style.fill,
        **attributes,
    )
    for k in (1, 1.8, 2.6):
        to.path(f"M0 {curve * k:g}A{half} 0 0 0 {width:g} {curve * k:g}", fill="none", **attributes)


def draw_annotation(to: Group, shape: Shape, style: Style) -> None:
    """A text behind a bracket."""
    width, height = shape.bounds.width, shape.bounds.height
    to.path(f"M10 0H0V{height:g}H10", stroke=style.stroke, fill="none", stroke_width=1.5)
    most = max(int((height - 6) // (SIZE * LINE_HEIGHT)), 1)
    lines = wrapped(shape.name, width - 10, SIZE, most)
    to.text(lines, 6, 5, SIZE, fill=style.text, text_anchor="start")


def draw_group(to: Group, shape: Shape, style: Style) -> None:
    """A dashed frame."""
    width, height = shape.bounds.width, shape.bounds.height
    to.rectangle(
        0, 0, width, height, rx=10, stroke=style.stroke, fill="none", stroke_width=1.5,
        stroke_dasharray="10 6 1 6",
    )  # fmt: skip
