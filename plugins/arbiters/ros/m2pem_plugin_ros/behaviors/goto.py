"""To a place, or to where another vehicle is."""

import math

from m2pem.api import BehaviorState
from m2pem_plugin_ros.behaviors.motion import Motion
from m2pem_plugin_ros.behaviors.motion_state import (
    Ending,
    Place,
    RefusedError,
    Scene,
    Wish,
    beyond,
    place_of,
    turned,
)
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.behaviors.path import Path
from m2pem_plugin_ros.behaviors.path_following import Approach, Tour
from m2pem_plugin_ros.behaviors.steering import turn
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import Bounds

TOLERANCE_M = 0.5
CLEARANCE_M = 3.0
"""How near is there, if nobody says: to a place, and to another vehicle."""

TURNED_RAD = math.radians(3.0)
TURNED_ENOUGH_RAD = math.radians(10.0)
RUN_UP_RADII = 6.0
RUN_UPS = 3
"""What cannot turn on the spot comes from so far behind the place, to point as it should. If it
misses the place, it tries again; after so many times it goes there as it can."""

UNHEARD_S = 3.0
"""A vehicle that has not been heard for so long is no target any more."""


class Goto(Motion):
    """Straight there; then `heading`, by turning on the spot, or as well as it can be."""

    name = "goto"

    def __init__(self, parameters: LocalParameters, bounds: Bounds) -> None:
        super().__init__(parameters, bounds)
        self.target = parameters.other_vehicle()
        self.places = () if self.target else (parameters.target_place(),)
        heading = parameters.heading_rad
        self._yaw_rad = None if heading is None else math.pi / 2 - heading
        tolerance = parameters.tolerance_m
        if tolerance is None:
            tolerance = CLEARANCE_M if self.target else TOLERANCE_M
        self._approach = Approach(tolerance, moves=bool(self.target))
        self._arrived = False
        self._run_up: Tour | None = None
        self._run_ups = 0
        if self.target and self._yaw_rad is not None and bounds.turn_radius_m > 0:
            raise RefusedError(
                "parameter 'heading': what cannot turn on the spot cannot choose how it points "
                f"at {self.target}, which may move; leave it out"
            )

    def step(self, scene: Scene) -> Wish | Ending:
        """One step of it."""
        place = self._place(scene)
        if place is None:
            reason = f"{self.target} has not been heard for {UNHEARD_S:g} s"
            return Ending(BehaviorState.FAILED, "", reason)
        if self._arrived:
            return self._turn(scene)
        if self._aims():
            wish = self._from_behind(scene, place)
            if wish is not None:
                return wish
        done = self._approach.step(scene, place, self.speed_m_s)
        if isinstance(done, Wish) or done.state is not BehaviorState.SUCCEEDED:
            return done
        self._arrived = True
        return self._turn(scene)

    def found_at(self, place: Place, moved_m: float) -> None:
        """From there to the same place; it must turn again if it has."""
        self._arrived = False
        if self._run_up is not None:
            self._run_up.found_at(place, moved_m, self.bounds)

    def adjust(self, parameters: LocalParameters) -> None:
        """Speed and tolerance."""
        super().adjust(parameters)
        tolerance = parameters.tolerance_m
        if tolerance is not None and not self._arrived:
            self._approach = Approach(tolerance, moves=bool(self.target))

    def ends_at(self, pose: Pose) -> bool:
        """Within the tolerance of a place, and pointing as it should if it can."""
        if not self.places or math.dist(place_of(pose), self.places[0]) > self.tolerance_m:
            return False
        if self._yaw_rad is None or self.bounds.turn_radius_m > 0:
            return True
        return abs(turned(pose.yaw_rad, self._yaw_rad)) <= TURNED_ENOUGH_RAD

    @property
    def tolerance_m(self) -> float:
        """How near is there."""
        return self._approach.tolerance_m

    def _place(self, scene: Scene) -> Place | None:
        if self.places:
            return self.places[0]
        target = scene.target
        if target is None or not target.age_s <= UNHEARD_S:
            return None
        return (
            target.pose.east_m + target.east_m_s * target.age_s,
            target.pose.north_m + target.north_m_s * target.age_s,
        )

    def _aims(self) -> bool:
        return self._yaw_rad is not None and self.bounds.turn_radius_m > 0

    def _from_behind(self, scene: Scene, place: Place) -> Wish | None:
        """To the place on a line in the direction of the heading; None at its end."""
        if self._run_up is not None:
            wish = self._run_up.step(scene, self.speed_m_s)
            if wish is not None:
                return wish
            self._run_up = None
        if math.dist(place_of(scene.pose), place) <= self.tolerance_m:
            self._approach.stop_here()
        elif self._run_ups < RUN_UPS:
            self._run_ups += 1
            run_up_m = RUN_UP_RADII * self.bounds.turn_radius_m
            before = beyond(place, self._yaw_rad or 0.0, -run_up_m)
            self._run_up = Tour(Path((place_of(scene.pose), before, place)), self.bounds)
            return self._run_up.step(scene, self.speed_m_s)
        return None

    def _turn(self, scene: Scene) -> Wish | Ending:
        if self._yaw_rad is None or self.bounds.turn_radius_m > 0:
            return Ending()
        aside = turned(scene.pose.yaw_rad, self._yaw_rad)
        if abs(aside) > TURNED_RAD:
            return turn(self.bounds, aside)
        return Ending() if scene.stands else Wish()
