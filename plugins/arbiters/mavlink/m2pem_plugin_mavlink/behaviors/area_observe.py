"""Watching an area or a place."""

import math
from itertools import pairwise

from m2pem.api import Area, BehaviorState, EastNorth, LatLon, LocalFrame
from m2pem_plugin_mavlink.behaviors.arrival import accepts_mode, is_still, position_of
from m2pem_plugin_mavlink.behaviors.behavior import (
    BehaviorContext,
    BehaviorFailedError,
    CheckpointState,
)
from m2pem_plugin_mavlink.behaviors.goto import Goto
from m2pem_plugin_mavlink.behaviors.orbit import Orbit
from m2pem_plugin_mavlink.vehicle.driver import FlightMode, Place

RADII_M = (15.0, 300.0)
"""A circle is no smaller and no larger than these."""

STANDOFF_M = 20.0


class ObserveFromAbove(Orbit):
    """Circle over the middle of an area, at the distance of its farthest corner; or a place."""

    name = "area_observe"
    ends = False

    def circle(self) -> tuple[Place, float]:
        """Over the middle of the area, or the target."""
        area = self.parameters.area
        if area is None:
            return super().circle()
        center, radius = middle(area)
        return Place(*center), max(RADII_M[0], min(RADII_M[1], radius))


class ObserveFromTheEdge(Goto):
    """Stand at the nearest point of an area's edge, or off a place, and look."""

    name = "area_observe"
    modes = frozenset({FlightMode.GUIDED, FlightMode.HOLD})
    max_still_s = None

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._seconds = self.parameters.duration_s
        self._stand: Place | None = None
        self._since_s: float | None = None

    def target(self) -> Place:
        """Where it stands and looks; chosen once."""
        if self._stand is None:
            self._stand = Place(*self._edge(), *self.parameters.altitude())
        return self._stand

    def _edge(self) -> LatLon:
        here = position_of(self.vehicle)
        if here is None:
            raise BehaviorFailedError("its position is not known yet")
        area = self.parameters.area
        if area is not None:
            frame = LocalFrame(area.rings[0][0][:2])
            ring = [frame.to_local(corner[:2]) for corner in area.rings[0]]
            return frame.to_latlon(_nearest(ring, frame.to_local(here)))
        target = self.parameters.target_place()
        frame = LocalFrame((target.latitude_deg, target.longitude_deg))
        east, north = frame.to_local(here)
        away = math.hypot(east, north)
        if away <= STANDOFF_M:
            return here
        return frame.to_latlon((east * STANDOFF_M / away, north * STANDOFF_M / away))

    async def begin(self) -> None:
        """Go there, or stay there."""
        if self._since_s is None:
            await super().begin()
        else:
            await self.vehicle.driver.stop()

    async def run_in_background(self) -> None:
        """It stands."""

    def finished(self) -> bool:
        """After the duration, counted from the arrival; without one never."""
        if self._since_s is None:
            if not super().finished():
                return False
            self._since_s = self.context.now_s()
        return self._seconds is not None and self.context.now_s() - self._since_s >= self._seconds

    def paused(self) -> None:
        """A pause does not count in the duration."""
        if self._since_s is not None and self._seconds is not None:
            self._seconds -= self.context.now_s() - self._since_s
            self._since_s = self.context.now_s()

    async def resume(self) -> None:
        """Go on there, for as long as is left."""
        if self._since_s is not None:
            self._since_s = self.context.now_s()
        await self.begin()

    async def reattach(self) -> BehaviorState:
        """By whether it goes there, or stands there."""
        if not accepts_mode(self, self.vehicle.state.mode) or not self.vehicle.state.armed:
            return BehaviorState.UNKNOWN
        state = await super().reattach()
        watches = state is BehaviorState.SUCCEEDED or self._since_s is not None
        return BehaviorState.RUNNING if watches and is_still(self.vehicle) else state

    def checkpoint(self) -> CheckpointState:
        """Where it stands."""
        place = self.target()
        return {"stand": [place.latitude_deg, place.longitude_deg]}

    def restore(self, checkpoint: CheckpointState) -> None:
        """The same."""
        stand = checkpoint.get("stand")
        if isinstance(stand, list):
            self._stand = Place(stand[0], stand[1], *self.parameters.altitude())


def middle(area: Area) -> tuple[LatLon, float]:
    """The middle of an area, and how far its farthest corner is from it."""
    frame = LocalFrame(area.rings[0][0][:2])
    corners = [frame.to_local(corner[:2]) for corner in area.rings[0][:-1]]
    center = (
        sum(east for east, _ in corners) / len(corners),
        sum(north for _, north in corners) / len(corners),
    )
    return frame.to_latlon(center), max(math.dist(center, corner) for corner in corners)


def _nearest(ring: list[EastNorth], here: EastNorth) -> EastNorth:
    candidates = []
    for (ae, an), (be, bn) in pairwise(ring):
        de, dn = be - ae, bn - an
        length2 = de * de + dn * dn
        part = ((here[0] - ae) * de + (here[1] - an) * dn) / length2 if length2 else 0.0
        part = max(0.0, min(1.0, part))
        candidates.append((ae + de * part, an + dn * part))
    return min(candidates, key=lambda point: math.dist(point, here))
