"""A simulated payload: where it looks as a function of time, and what it sees of the ground."""

import math
from collections.abc import Sequence

from m2pem.api.arbiter import Connection
from m2pem.api.telemetry import Detection, GeoPosition, LinkState, PayloadState
from m2pem.mission.catalogue import ResourceId
from m2pem.simulation.gimbals import MAST_M, Mount
from m2pem.simulation.segments import Look, Pose, Slew, Vector
from m2pem.simulation.settings import Gimbal, Settings
from m2pem.simulation.trajectory import Plan, Track
from m2pem.simulation.vehicles import carrier_of

RANGE_M = 5_000.0
"""Farther away nothing is said to be seen."""

CIRCLE_CORNERS = 24
_HALVINGS = 30


def seen(gimbal: Gimbal, look: Look, carrier: Pose, ground_up_m: float) -> Sequence[Vector]:
    """The corners of a picture, which is square; none if no ground is in view.

    Where the view goes beyond `RANGE_M` or the horizon, it ends there.
    """
    east, north, up = carrier.place
    height = up + MAST_M - ground_up_m
    if height <= 0:
        return ()
    half = math.tan(min(gimbal.view_rad / max(look.zoom, 1.0), math.radians(170)) / 2)
    top_left, bottom_left = _edge(look, carrier.yaw, height, -half, half)
    top_right, bottom_right = _edge(look, carrier.yaw, height, half, half)
    if top_left is None or bottom_left is None or top_right is None or bottom_right is None:
        return ()
    return [
        (east + x, north + y, ground_up_m)
        for x, y in (top_left, top_right, bottom_right, bottom_left)
    ]


def around(range_m: float, carrier: Pose, ground_up_m: float) -> Sequence[Vector]:
    """The circle in which a detector finds things."""
    east, north, _ = carrier.place
    angles = (-math.tau * index / CIRCLE_CORNERS for index in range(CIRCLE_CORNERS))
    return [
        (east + range_m * math.cos(angle), north + range_m * math.sin(angle), ground_up_m)
        for angle in angles
    ]


_Level = tuple[float, float]


def _edge(
    look: Look, yaw: float, height: float, aside: float, half: float
) -> tuple[_Level | None, _Level | None]:
    """Where the top and the bottom of a side of the picture meet the ground, from the payload."""
    bottom = _met(look, yaw, height, aside, -half)
    if bottom is None:
        return None, None
    top = _met(look, yaw, height, aside, half)
    low, high = -half, half
    if top is None:
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            if _met(look, yaw, height, aside, middle) is None:
                high = middle
            else:
                low = middle
        top = _met(look, yaw, height, aside, low)
    return top, bottom


def _met(look: Look, yaw: float, height: float, aside: float, above: float) -> _Level | None:
    """Where the ray through a point of the picture meets the ground; None: it is too far away."""
    bearing = yaw - look.pan
    cos_b, sin_b = math.cos(bearing), math.sin(bearing)
    cos_t, sin_t = math.cos(look.tilt), math.sin(look.tilt)
    level = cos_t - above * sin_t
    down = -(sin_t + above * cos_t)
    if down * RANGE_M <= height * math.hypot(level, aside):
        return None
    reach = height / down
    return reach * (level * cos_b + aside * sin_b), reach * (level * sin_b - aside * cos_b)


class SimPayload:
    """Looks straight ahead at first. `detector`: whether it finds planted targets.

    `behavior`: the id of what it is busy with, `doing` the name; "" when free. `held`: whether
    `hold` was called on it.
    """

    def __init__(self, connection: Connection, settings: Settings, now_us: int) -> None:
        self.id: ResourceId = connection.resource
        self.carrier = carrier_of(connection.resource)
        self.settings = settings
        self.detector = connection.detector or settings.kind == "gpr"
        self._turns = settings.kind in ("", "ptz")
        self.behavior = ""
        self.doing = ""
        self.held = False
        self.track: Track[Look] = Track(Plan([Slew(Look(), Look(), 0.0)]), now_us)

    def rest(self, now_us: int, then_us: int) -> None:
        """Look from `then_us` on where it does at `now_us`."""
        look = self.look(now_us)
        self.track = Track(Plan([Slew(look, look, 0.0)]), then_us)

    def mount(self, now_us: int, carrier: Pose | None, ground_up_m: float) -> Mount:
        look = self.look(now_us)
        return Mount(self.id, self.settings.gimbal, look, carrier, ground_up_m)

    def look(self, now_us: int) -> Look:
        """Where it looks; pan within half a turn."""
        look = self.track.at(now_us)
        return Look(math.remainder(look.pan, math.tau), look.tilt, look.zoom)

    def take(self, plan: Plan[Look], now_us: int) -> None:
        """Follow another plan, which must begin where it looks."""
        self.track = Track(plan, now_us)

    def stop(self, now_us: int) -> None:
        """Look on where it looks."""
        look = self.look(now_us)
        self.take(Plan([Slew(look, look, 0.0)]), now_us)

    def hold(self, now_us: int) -> None:
        """Stop at once, keeping the plan."""
        self.track.hold(now_us, 0.0)

    def go_on(self, now_us: int) -> None:
        """Take the plan up again."""
        self.track.go_on(now_us)

    def ground(self, now_us: int, carrier: Pose, ground_up_m: float) -> Sequence[Vector]:
        """What it sees of the ground, as corners; a detector sees all round."""
        if self.detector:
            return around(self.settings.detection_range_m, carrier, ground_up_m)
        return seen(self.settings.gimbal, self.look(now_us), carrier, ground_up_m)

    def state(
        self,
        now_us: int,
        detections: tuple[Detection, ...] = (),
        footprint: tuple[GeoPosition, ...] = (),
    ) -> PayloadState:
        look = self.look(now_us)
        return PayloadState(
            resource=self.id,
            time_us=now_us,
            pan_rad=look.pan if self._turns else None,
            tilt_rad=look.tilt if self._turns else None,
            zoom=look.zoom,
            detections=detections,
            link=LinkState.CONNECTED,
            behavior=self.doing,
            footprint=footprint,
        )
