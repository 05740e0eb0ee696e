"""The behavior `orbit`."""

import math
from collections.abc import Sequence

from m2pem.api import ORBIT_RADIUS_M, BehaviorState, LocalFrame
from m2pem_plugin_mavlink.behaviors.arrival import (
    arrival_radius_m,
    circle_tolerance_m,
    distance_to_m,
    position_of,
    takeoff_required,
)
from m2pem_plugin_mavlink.behaviors.behavior import (
    BehaviorContext,
    BehaviorFailedError,
    CheckpointState,
)
from m2pem_plugin_mavlink.behaviors.mission import MissionFlight
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.vehicle.driver import FlightMode, TargetPosition

MOST_ITEMS = 400
"""Most waypoints of a mission with all laps; longer ones repeat a mission of one lap."""

LOOK_EVERY_S = 0.2


class Orbit(MissionFlight):
    """Circle a place clockwise, for a number of turns or a time: by the autopilot's command if it
    has one, else by waypoints on the circle. A target vehicle is circled where it is at the
    beginning."""

    name = "orbit"
    modes = frozenset({FlightMode.MISSION, FlightMode.ORBIT})
    plane_modes = frozenset({FlightMode.GUIDED})  # a plane is sent to a place with a radius

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._center: TargetPosition | None = None
        self._radius_m = self.parameters.radius_m or ORBIT_RADIUS_M
        self._seconds = self.parameters.duration_s
        self._turns = self.parameters.turns
        if self._turns is None and self._seconds is None and self.ends:
            self._turns = 1.0
        self._by_command = False
        self._turned_rad = 0.0
        self._bearing_rad: float | None = None
        self._done = False

    ends = True
    """Whether it ends after one turn by default."""

    # --- where ----------------------------------------------------------------------------------

    def circle(self) -> tuple[TargetPosition, float]:
        """Return the centre, and the radius in metres."""
        return self.parameters.target_position(), self._radius_m

    @property
    def center(self) -> TargetPosition:
        """The centre, with a known height."""
        if self._center is None:
            place, self._radius_m = self.circle()
            height = self.parameters.altitude_to_fly(place.altitude_m, place.altitude_frame)
            self._center = TargetPosition(*place.latlon, *height)
        return self._center

    def way(self) -> Sequence[MissionItem]:
        """Return a polygon on the circle: all turns, or one turn that is repeated."""
        center = self.center
        frame = LocalFrame(center.latlon)
        sides = self._sides()
        laps = 1.0 if self._turns is None else self._turns
        self.loop = self._turns is None or laps * sides > MOST_ITEMS
        sweep = math.tau if self.loop else math.tau * laps
        count = max(1, math.ceil(sides * sweep / math.tau - 1e-9))
        began = self._begins_at(frame)
        angles = [began - sweep * index / count for index in range(count + 1)]
        if self.loop:
            angles.pop()  # the lap's end is its beginning
        height = (center.altitude_m or 0.0, center.altitude_frame)
        around = [(self._radius_m * math.cos(a), self._radius_m * math.sin(a)) for a in angles]
        return [self.waypoint(frame.to_latlon(level), *height) for level in around]

    def _sides(self) -> int:
        """Return the number of sides of the polygon: its edges are at most about a metre inside the
        circle."""
        return max(8, min(36, math.ceil(math.tau * self._radius_m / 12.0)))

    def _begins_at(self, frame: LocalFrame) -> float:
        here = position_of(self.vehicle)
        if here is None:
            return math.pi / 2
        east, north = frame.to_local(here)
        return math.atan2(north, east)

    def named(self, index: int) -> str:
        return "a point of the circle"

    # --- how ------------------------------------------------------------------------------------

    def refusal(self) -> str:
        if self._turns == 0 or self._seconds == 0:
            return takeoff_required(self.vehicle)
        reason, fence = super().refusal(), self.context.fence
        if reason or fence is None or (self._turns or 1.0) < 1.0:
            return reason
        # The autopilot's own circle passes outside of the polygon's edges.
        frame, angles = LocalFrame(self.center.latlon), (math.radians(each) for each in range(361))
        circle = [(self._radius_m * math.cos(a), self._radius_m * math.sin(a)) for a in angles]
        return fence.breach([frame.to_latlon(level) for level in circle], None, self.named)

    async def begin(self) -> None:
        """Start by the autopilot's command, else by a mission."""
        self._done = self._turns == 0 or self._seconds == 0
        if self._done:
            return
        self._bearing_rad = None
        speed = self.parameters.speed_m_s
        self._by_command = await self.vehicle.driver.orbit(self.center, self._radius_m, speed)
        if not self._by_command:
            await super().begin()

    async def resume(self) -> None:
        """Continue; completed turns count."""
        if self._by_command or self._done:
            await self.begin()
        else:
            await super().resume()

    async def run_in_background(self) -> None:
        """Repeat the turn where needed, and stop at the end."""
        if self._done:
            return
        if self._by_command or self.loop:
            await self._circle()
            await self.vehicle.driver.stop()
            self._done = True

    async def _circle(self) -> None:
        left_s: float | None = None
        while True:
            await self.vehicle.sleep(LOOK_EVERY_S)
            on_it = self._look()
            if on_it and left_s is None and self._seconds is not None:
                left_s = self.context.now_s() + self._seconds
            if left_s is not None and self.context.now_s() >= left_s:
                return
            if self._turns is not None and self._turned_rad >= math.tau * self._turns:
                return
            if not self._by_command and self.at_the_end():
                self._stillness.forget()
                await self.vehicle.driver.start_mission(0)

    def _look(self) -> bool:
        """Add the angle since the last call; return whether the vehicle is on the circle."""
        center = self.center.latlon
        here = position_of(self.vehicle)
        near_m, away = circle_tolerance_m(self._radius_m), distance_to_m(self.vehicle, center)
        # A plane that cannot turn as tightly as commanded flies a larger circle.
        wide_m = max(self._radius_m, self.vehicle.state.loiter_radius_m or 0.0)
        farthest_m = max(self._radius_m + near_m, arrival_radius_m(self.vehicle, 0.0, wide_m))
        if here is None or not self._radius_m - near_m <= away <= farthest_m:
            self._bearing_rad = None
            return False
        east, north = LocalFrame(center).to_local(here)
        bearing = math.atan2(north, east)
        if self._bearing_rad is not None:
            self._turned_rad += abs(math.remainder(bearing - self._bearing_rad, math.tau))
        self._bearing_rad = bearing
        return True

    def finished(self) -> bool:
        """Return whether the turns or the time are complete."""
        if self._by_command or self.loop or self._done:
            return self._done
        return self.at_the_end()

    # --- after a restart ------------------------------------------------------------------------

    async def reattach(self) -> BehaviorState:
        """Judge by the mode and the distance from the centre, or by the stored mission."""
        plane = self.vehicle.state.loiter_radius_m is not None
        by_place = plane and self.vehicle.state.mode is FlightMode.GUIDED
        if by_place or self.vehicle.state.mode is FlightMode.ORBIT:
            self._by_command = True
            near = self._look() or self._bearing_rad is not None
            return BehaviorState.RUNNING if near else BehaviorState.UNKNOWN
        return await super().reattach()

    def checkpoint(self) -> CheckpointState:
        """Return what `MissionFlight` needs, and the circle."""
        center = self.center
        return {
            **super().checkpoint(),
            "center": [*center.latlon, center.altitude_m or 0.0],
            "frame": center.altitude_frame,
            "radius": self._radius_m,
            "loop": float(self.loop),
        }

    def restore(self, checkpoint: CheckpointState) -> None:
        super().restore(checkpoint)
        center, radius = checkpoint.get("center"), checkpoint.get("radius")
        if not isinstance(center, list) or not isinstance(radius, int | float):
            raise BehaviorFailedError("the centre of the circle is no longer known")
        self._center = TargetPosition(center[0], center[1], center[2], str(checkpoint.get("frame")))
        self._radius_m = float(radius)
        self.loop = bool(checkpoint.get("loop"))
