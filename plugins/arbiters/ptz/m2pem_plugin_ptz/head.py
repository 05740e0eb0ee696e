"""Where a camera looks, and where it can.

Pan is clockwise from where pan 0 points: the vehicle's bow, unless `Mounting` says otherwise. Tilt
is up from the vehicle's deck, or from the horizon, for a camera that keeps that level. A vehicle
that turns or rolls takes both along. Zoom 1 is the widest view.
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Look:
    """In radians; `zoom` is a factor, 1 or more."""

    pan_rad: float
    tilt_rad: float
    zoom: float = 1.0


@dataclass(frozen=True, slots=True)
class Reach:
    """Where a camera can look: (lowest, highest). With `endless` it pans all round, and the ends of
    `pan_rad` are one. `rate_rad_s`: the quickest that it pans and tilts. `view_rad`: the width and
    the height of what it sees at zoom 1."""

    pan_rad: tuple[float, float] = (-math.pi, math.pi)
    tilt_rad: tuple[float, float] = (-math.pi / 2, math.pi / 2)
    zoom_max: float = 1.0
    rate_rad_s: float = 1.0
    view_rad: tuple[float, float] = (math.radians(60.0), math.radians(34.0))
    endless: bool = False


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture as the camera gave it. `content` None: the camera keeps it, under `reference`.

    `taken_us`: microseconds since the Unix epoch. `suffix`: of its file, such as ".jpg".
    """

    taken_us: int
    content: bytes | None = None
    suffix: str = ".jpg"
    reference: str = ""
