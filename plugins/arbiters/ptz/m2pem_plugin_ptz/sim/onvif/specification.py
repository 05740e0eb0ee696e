"""What a simulated ONVIF camera is: what it can, whom it obeys, how quick it is."""

import math
from dataclasses import dataclass
from enum import StrEnum

from m2pem_plugin_ptz.sim.onvif.head import Axis, Head

ZOOM_S = 2.0
"""From the widest view to the narrowest."""


class Asks(StrEnum):
    """How the camera asks for user and password before it gives a picture."""

    DIGEST = "digest"
    BASIC = "basic"
    NOTHING = "nothing"


@dataclass(frozen=True, slots=True)
class Account:
    """Who may do everything."""

    user: str
    password: str


@dataclass(frozen=True, slots=True)
class CameraSpec:
    """One camera. Pan is clockwise and tilt is up, from the camera's own zero.

    `account` None: everybody may do everything. `skew_s`: how far its clock is ahead. `latency_s`:
    until it has answered. `degrees`: it has spaces in degrees, beside those from -1 to 1. `turns`,
    `drives`: it takes absolute moves, and velocities. `media`, `media2`: which media services it
    has. `endless`: it pans all round.
    """

    name: str = "m2pem simulated camera"
    pan_deg: tuple[float, float] = (-180.0, 180.0)
    tilt_deg: tuple[float, float] = (-90.0, 30.0)
    zoom_max: float = 20.0
    focal_mm: float = 4.3
    view_deg: tuple[float, float] = (60.0, 34.0)
    rate_deg_s: float = 100.0
    acceleration_deg_s2: float = 300.0
    endless: bool = False
    degrees: bool = True
    turns: bool = True
    drives: bool = True
    positions: bool = True
    media: bool = True
    media2: bool = True
    snapshots: bool = True
    asks: Asks = Asks.DIGEST
    recording: bool = True
    account: Account | None = None
    skew_s: float = 0.0
    latency_s: float = 0.05

    def head(self) -> Head:
        """Its motors, at rest at zero."""
        rate, acceleration = math.radians(self.rate_deg_s), math.radians(self.acceleration_deg_s2)
        pan = None if self.endless else _radians(self.pan_deg)
        tilt = _radians(self.tilt_deg)
        zoom_rate = (self.zoom_max - 1.0) / ZOOM_S
        return Head(
            Axis(pan, rate, acceleration),
            Axis(tilt, rate, acceleration, at=min(max(0.0, tilt[0]), tilt[1])),
            Axis((1.0, self.zoom_max), zoom_rate, zoom_rate * 10, at=1.0),
        )


def _radians(degrees: tuple[float, float]) -> tuple[float, float]:
    return math.radians(degrees[0]), math.radians(degrees[1])
