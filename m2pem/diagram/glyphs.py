"""The small signs inside of events, gateways and activities. Each is drawn around a middle."""

import math
from collections.abc import Callable

from m2pem.diagram.picture import Point
from m2pem.diagram.svg import Group

Glyph = Callable[[Group, float, float, str, str], None]
"""Draws at x, y with a stroke's and an area's colour."""


def star(x: float, y: float, radius: float, corners: int, turn_rad: float = 0.0) -> list[Point]:
    """The corners of a regular polygon, the first one upwards."""
    return [
        (x + radius * math.sin(a), y - radius * math.cos(a))
        for a in (turn_rad + 2 * math.pi * k / corners for k in range(corners))
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


def _plus(x: float, y: float, arm: float, half: float, turn_rad: float = 0.0) -> list[Point]:
    quarter = [(half, -arm), (half, -half), (arm, -half)]
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
    _thick(to, _plus(x, y, 10, 1.9, math.pi / 4), stroke, fill)


def plus(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Parallel gateways; parallel multiple events."""
    _thick(to, _plus(x, y, 10, 2), stroke, fill)


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


EVENTS: dict[str, Glyph] = {
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

GATEWAYS: dict[str, Glyph] = {
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
    fingers = "".join(
        f"H{length}c1.6 0 1.6 2.4 0 2.4" for length in (7, 7.4, 6.8, 5.6)
    )  # the tip of each is a half circle, about
    sign = to.group((x, y))
    sign.path(f"M-8 -1.5L-3 -6.5H1c1.6 0 1.6 2.5 0 2.5{fingers}H-8Z", stroke=stroke, fill=fill)
    for dy in (-1.6, 0.8, 3.2):
        sign.path(f"M1.5 {dy}H6.6", stroke=stroke)


def filled_envelope(to: Group, x: float, y: float, stroke: str, fill: str) -> None:
    """Send task."""
    envelope(to, x, y, stroke, stroke)


TASKS: dict[str, Glyph] = {
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
