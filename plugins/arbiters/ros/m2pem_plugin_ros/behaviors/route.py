"""Along a route."""

import math

from m2pem_plugin_ros.behaviors.motion import Motion
from m2pem_plugin_ros.behaviors.motion_state import (
    Ending,
    Place,
    RefusedError,
    Scene,
    Wish,
    place_of,
)
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.behaviors.path import SHORTEST_M, Path, next_waypoint
from m2pem_plugin_ros.behaviors.path_following import Approach, Tour
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import Bounds

TOLERANCE_M = 0.5
"""So near its end a route has been driven."""

JOIN_M = 2.0
"""Who stands so near the first waypoint does not drive back to it."""


class SingleVehicleRouting(Motion):
    """To the first waypoint, through all others, to the last; with `loop` back to the first, and
    round for ever."""

    name = "single_vehicle_routing"

    def __init__(self, parameters: LocalParameters, bounds: Bounds) -> None:
        super().__init__(parameters, bounds)
        self.places = parameters.route_places()
        self._loop = parameters.loop
        self._taken_up = False
        self._tour: Tour | None = None
        self._ends: Approach | None = None
        if self._loop and all(math.dist(p, self.places[0]) < SHORTEST_M for p in self.places):
            raise RefusedError("parameter 'loop': a route of one place cannot be repeated")

    @property
    def driven_m(self) -> float:
        """Along the way to the route, and the route. It never gets less."""
        return 0.0 if self._tour is None else self._tour.progress.driven_m

    def step(self, scene: Scene) -> Wish | Ending:
        """Along the path, then to its very end."""
        if self._ends is None:
            if self._tour is None:
                self._tour = Tour(self._path(scene.pose), self.bounds)
            wish = self._tour.step(scene, self.speed_m_s)
            if wish is not None:
                return wish
            self._ends = Approach(TOLERANCE_M)
            if math.dist(place_of(scene.pose), self.places[-1]) <= TOLERANCE_M:
                self._ends.stop_here()
        return self._ends.step(scene, self.places[-1], self.speed_m_s)

    def found_at(self, place: Place, moved_m: float) -> None:
        """Go on at the nearest point of the route that is about as far as it was."""
        if self._tour is not None and self._ends is None:
            self._tour.found_at(place, moved_m, self.bounds)

    def take_up(self) -> None:
        """Go on where the base stands on the route, if it comes by there once."""
        self._taken_up = True

    def ends_at(self, pose: Pose) -> bool:
        """At the end of a route, if it does not begin there too."""
        end = self.places[-1]
        return (
            not self._loop
            and math.dist(place_of(pose), end) <= TOLERANCE_M
            and all(math.dist(place, end) > TOLERANCE_M for place in self.places[:1])
        )

    def _path(self, pose: Pose) -> Path:
        here = place_of(pose)
        joins_m = JOIN_M + self.bounds.turn_radius_m
        if self._taken_up and (path := self._rest(here, joins_m)) is not None:
            return path
        near = math.dist(here, self.places[0]) <= joins_m
        if near and len(self.places) > 1:
            return Path(self.places, 0 if self._loop else None)
        return Path((here, *self.places), 1 if self._loop else None)

    def _rest(self, here: Place, within_m: float) -> Path | None:
        """What is left of the route; with `loop`, of the lap, and then whole laps."""
        lap = (*self.places, self.places[0]) if self._loop else self.places
        following = next_waypoint(lap, here, within_m)
        if following is None:
            return None
        if not self._loop:
            return Path((here, *self.places[following:]))
        rest = self.places[following:]
        return Path((here, *rest, *self.places), 1 + len(rest))
