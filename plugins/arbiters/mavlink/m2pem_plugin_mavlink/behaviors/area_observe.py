"""The behavior `area_observe`: aircraft circle over an area or a point, others stop at its edge."""

import math

from m2pem.api import Area, BehaviorState, LatLon, LocalFrame, Polyline, middle_of
from m2pem_plugin_mavlink.behaviors.arrival import accepts_mode, is_still, position_of
from m2pem_plugin_mavlink.behaviors.behavior import (
    BehaviorContext,
    BehaviorFailedError,
    CheckpointState,
)
from m2pem_plugin_mavlink.behaviors.goto import Goto
from m2pem_plugin_mavlink.behaviors.orbit import Orbit
from m2pem_plugin_mavlink.vehicle.driver import FlightMode, TargetPosition

RADII_M = (15.0, 300.0)
"""A circle is no smaller and no larger than these."""

STANDOFF_M = 20.0


class ObserveFromAbove(Orbit):
    """Circle over the centre of the area, as far out as its farthest corner; or circle over a
    point."""

    name = "area_observe"
    ends = False

    def circle(self) -> tuple[TargetPosition, float]:
        area = self.parameters.area
        if area is None:
            return super().circle()
        center, radius = middle(area)
        return TargetPosition(*center), max(RADII_M[0], min(RADII_M[1], radius))


class ObserveFromTheEdge(Goto):
    """Stop at the nearest point of the area's edge, or at a distance from a point, and observe."""

    name = "area_observe"
    modes = frozenset({FlightMode.GUIDED, FlightMode.HOLD})
    max_still_s = None

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._seconds = self.parameters.duration_s
        self._stand: TargetPosition | None = None
        self._since_s: float | None = None

    def target(self) -> TargetPosition:
        """Return where the vehicle stops; chosen once."""
        if self._stand is None:
            self._stand = TargetPosition(*self._edge(), *self.parameters.altitude())
        return self._stand

    def _edge(self) -> LatLon:
        here = position_of(self.vehicle)
        if here is None:
            raise BehaviorFailedError("its position is not known yet")
        area = self.parameters.area
        if area is not None:
            frame = LocalFrame(area.rings[0][0][:2])
            ring = [frame.to_local(corner[:2]) for corner in area.rings[0]]
            return frame.to_latlon(Polyline(ring).nearest(frame.to_local(here)))
        target = self.parameters.target_position()
        frame = LocalFrame(target.latlon)
        east, north = frame.to_local(here)
        away = math.hypot(east, north)
        if away <= STANDOFF_M:
            return here
        return frame.to_latlon((east * STANDOFF_M / away, north * STANDOFF_M / away))

    async def begin(self) -> None:
        """Drive to the place; a vehicle that has arrived stays there."""
        if self._since_s is None:
            await super().begin()
        else:
            await self.vehicle.driver.stop()

    async def run_in_background(self) -> None:
        """Do nothing: unlike the target of `goto`, the place does not move."""

    def finished(self) -> bool:
        """Return whether the duration since the arrival is over; without a duration always
        False."""
        if self._since_s is None:
            if not super().finished():
                return False
            self._since_s = self.context.now_s()
        return self._seconds is not None and self.context.now_s() - self._since_s >= self._seconds

    def paused(self) -> None:
        """Exclude the pause from the duration."""
        if self._since_s is not None and self._seconds is not None:
            self._seconds -= self.context.now_s() - self._since_s
            self._since_s = self.context.now_s()

    async def resume(self) -> None:
        """Continue for the rest of the duration."""
        if self._since_s is not None:
            self._since_s = self.context.now_s()
        await self.begin()

    async def reattach(self) -> BehaviorState:
        """Judge by whether the vehicle drives to the place, or has stopped there."""
        if not accepts_mode(self, self.vehicle.state.mode) or not self.vehicle.state.armed:
            return BehaviorState.UNKNOWN
        state = await super().reattach()
        watches = state is BehaviorState.SUCCEEDED or self._since_s is not None
        return BehaviorState.RUNNING if watches and is_still(self.vehicle) else state

    def checkpoint(self) -> CheckpointState:
        return {"stand": list(self.target().latlon)}

    def restore(self, checkpoint: CheckpointState) -> None:
        stand = checkpoint.get("stand")
        if isinstance(stand, list):
            self._stand = TargetPosition(stand[0], stand[1], *self.parameters.altitude())


def middle(area: Area) -> tuple[LatLon, float]:
    """Return the centre of an area, and the distance to its farthest corner in metres."""
    frame = LocalFrame(area.rings[0][0][:2])
    corners = [frame.to_local(corner[:2]) for corner in area.rings[0][:-1]]
    center = middle_of(corners)
    return frame.to_latlon(center), max(math.dist(center, corner) for corner in corners)
