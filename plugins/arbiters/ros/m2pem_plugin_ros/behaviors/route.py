"""The behavior `single_vehicle_routing`: drive along a route."""

import math

from m2pem_plugin_ros.behaviors.motion import Motion
from m2pem_plugin_ros.behaviors.motion_state import (
    DesiredMotion,
    Ending,
    MotionState,
    Place,
    RefusedError,
    position_of,
)
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.behaviors.path import SHORTEST_M, Path, next_waypoint
from m2pem_plugin_ros.behaviors.path_following import Approach, PathFollower
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import Bounds

TOLERANCE_M = 0.5
"""The route has been driven this near to its end."""

JOIN_M = 2.0
"""A base this near to the first waypoint does not drive back to it."""


class SingleVehicleRouting(Motion):
    """Drive to the first waypoint and through all others to the last. With `loop`, drive laps
    without an end."""

    name = "single_vehicle_routing"

    def __init__(self, parameters: LocalParameters, bounds: Bounds) -> None:
        super().__init__(parameters, bounds)
        self.places = parameters.route_places()
        self._loop = parameters.loop
        self._taken_up = False
        self._follower: PathFollower | None = None
        self._ends: Approach | None = None
        if self._loop and all(math.dist(p, self.places[0]) < SHORTEST_M for p in self.places):
            raise RefusedError("parameter 'loop': a route of one place cannot be repeated")

    @property
    def driven_m(self) -> float:
        """The distance driven, including the way to the first waypoint. It never decreases."""
        return 0.0 if self._follower is None else self._follower.progress.driven_m

    def step(self, state: MotionState) -> DesiredMotion | Ending:
        """Follow the path, then approach its end."""
        if self._ends is None:
            if self._follower is None:
                self._follower = PathFollower(self._path(state.pose), self.bounds)
            desired = self._follower.step(state, self.speed_m_s)
            if desired is not None:
                return desired
            self._ends = Approach(TOLERANCE_M)
            if math.dist(position_of(state.pose), self.places[-1]) <= TOLERANCE_M:
                self._ends.stop_here()
        return self._ends.step(state, self.places[-1], self.speed_m_s)

    def found_at(self, place: Place, moved_m: float) -> None:
        """Continue at the nearest point of the route within the distance of the jump."""
        if self._follower is not None and self._ends is None:
            self._follower.found_at(place, moved_m, self.bounds)

    def take_up(self) -> None:
        """Continue on the route from where the base stands, if it passes there once only."""
        self._taken_up = True

    def ends_at(self, pose: Pose) -> bool:
        """Whether the pose is at the end of a route that does not begin there, too."""
        end = self.places[-1]
        return (
            not self._loop
            and math.dist(position_of(pose), end) <= TOLERANCE_M
            and all(math.dist(place, end) > TOLERANCE_M for place in self.places[:1])
        )

    def _path(self, pose: Pose) -> Path:
        here = position_of(pose)
        joins_m = JOIN_M + self.bounds.turn_radius_m
        if self._taken_up and (path := self._rest(here, joins_m)) is not None:
            return path
        near = math.dist(here, self.places[0]) <= joins_m
        if near and len(self.places) > 1:
            return Path(self.places, 0 if self._loop else None)
        return Path((here, *self.places), 1 if self._loop else None)

    def _rest(self, here: Place, within_m: float) -> Path | None:
        """Return the rest of the route; with `loop`, the rest of the lap and then whole laps."""
        lap = (*self.places, self.places[0]) if self._loop else self.places
        following = next_waypoint(lap, here, within_m)
        if following is None:
            return None
        if not self._loop:
            return Path((here, *self.places[following:]))
        rest = self.places[following:]
        return Path((here, *rest, *self.places), 1 + len(rest))
