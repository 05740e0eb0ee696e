"""What the vehicles pane says of a payload: where it looks, and what it does."""

import math
from collections.abc import Callable

from m2pem.api.telemetry import LinkState, PayloadState

ASIDE_DEG, ZOOMED = 0.5, 1.05
"""Nearer to straight ahead and to the widest view, nobody needs to be told."""


def payload_words(state: PayloadState, named: Callable[[str], str]) -> str:
    """Such as "ptz: 30°→ 10°↓ x4 ptz_track"; "" if there is nothing to say.

    `named` gives the name of a behavior by its id. Pan is from the vehicle's bow, "→" clockwise.
    """
    if state.link is LinkState.LOST:
        words = ["not heard"]
    else:
        words = _look(state)
        if state.behavior:
            words.append(named(state.behavior))
    return f"{state.resource.rpartition('/')[2]}: {' '.join(words)}" if words else ""


def _look(state: PayloadState) -> list[str]:
    pan_rad = state.pan_rad
    if pan_rad is not None and math.isfinite(pan_rad):
        pan_rad = math.remainder(pan_rad, math.tau)
    zoom = f"x{state.zoom:.2g}" if state.zoom is not None and state.zoom >= ZOOMED else ""
    return [each for each in (_turned(pan_rad, "→←"), _turned(state.tilt_rad, "↑↓"), zoom) if each]


def _turned(angle_rad: float | None, arrows: str) -> str:
    """`arrows`: for an angle above 0, and below."""
    if angle_rad is None or not math.isfinite(angle_rad):
        return ""
    angle_deg = math.degrees(angle_rad)
    if abs(angle_deg) < ASIDE_DEG:
        return ""
    return f"{abs(angle_deg):.0f}°{arrows[angle_deg < 0]}"
