"""The behavior `goto`: drive to a position, or to another vehicle."""

import math

from m2pem.api import BehaviorState
from m2pem_plugin_ros.behaviors.motion import Motion
from m2pem_plugin_ros.behaviors.motion_state import (
    DesiredMotion,
    Ending,
    MotionState,
    Place,
    RefusedError,
    angle_between,
    point_beyond,
    position_of,
)
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.behaviors.path import Path
from m2pem_plugin_ros.behaviors.path_following import Approach, PathFollower
from m2pem_plugin_ros.behaviors.steering import turn
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import Bounds

TOLERANCE_M = 0.5
CLEARANCE_M = 3.0
"""Default tolerances: to a position, and to another vehicle."""

TURNED_RAD = math.radians(3.0)
TURNED_ENOUGH_RAD = math.radians(10.0)
RUN_UP_RADII = 6.0
RUN_UPS = 3
"""A base with a turning radius approaches from this distance behind the position, to arrive with
its heading. If it misses the position, it tries again. After `RUN_UPS` tries it drives there
directly."""

TARGET_SILENT_S = 3.0
"""A target vehicle that was not received for this time is given up."""


class Goto(Motion):
    """Drive straight to the target; then turn to `heading`, if the base can turn on the spot."""

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
        self._run_up: PathFollower | None = None
        self._run_ups = 0
        if self.target and self._yaw_rad is not None and bounds.turn_radius_m > 0:
            raise RefusedError(
                "parameter 'heading': a base that cannot turn on the spot has no free heading "
                f"at {self.target}, which may move; leave it out"
            )

    def step(self, state: MotionState) -> DesiredMotion | Ending:
        place = self._place(state)
        if place is None:
            reason = f"{self.target} has sent no position for {TARGET_SILENT_S:g} s"
            return Ending(BehaviorState.FAILED, "", reason)
        if self._arrived:
            return self._turn(state)
        if self._aims():
            desired = self._from_behind(state, place)
            if desired is not None:
                return desired
        done = self._approach.step(state, place, self.speed_m_s)
        if isinstance(done, DesiredMotion) or done.state is not BehaviorState.SUCCEEDED:
            return done
        self._arrived = True
        return self._turn(state)

    def found_at(self, place: Place, moved_m: float) -> None:
        """Drive on to the same target. The base must turn again if it had turned."""
        self._arrived = False
        if self._run_up is not None:
            self._run_up.found_at(place, moved_m, self.bounds)

    def adjust(self, parameters: LocalParameters) -> None:
        """Change speed and tolerance."""
        super().adjust(parameters)
        tolerance = parameters.tolerance_m
        if tolerance is not None and not self._arrived:
            self._approach = Approach(tolerance, moves=bool(self.target))

    def ends_at(self, pose: Pose) -> bool:
        """Whether the pose is within the tolerance of a fixed target, and has the heading if the
        base can turn to it."""
        if not self.places or math.dist(position_of(pose), self.places[0]) > self.tolerance_m:
            return False
        if self._yaw_rad is None or self.bounds.turn_radius_m > 0:
            return True
        return abs(angle_between(pose.yaw_rad, self._yaw_rad)) <= TURNED_ENOUGH_RAD

    @property
    def tolerance_m(self) -> float:
        """The distance to the target at which the base has arrived."""
        return self._approach.tolerance_m

    def _place(self, state: MotionState) -> Place | None:
        if self.places:
            return self.places[0]
        target = state.target
        return target.place if target is not None and target.age_s <= TARGET_SILENT_S else None

    def _aims(self) -> bool:
        return self._yaw_rad is not None and self.bounds.turn_radius_m > 0

    def _from_behind(self, state: MotionState, place: Place) -> DesiredMotion | None:
        """Drive to the position along a line in the direction of the heading. Return None at its
        end."""
        if self._run_up is not None:
            desired = self._run_up.step(state, self.speed_m_s)
            if desired is not None:
                return desired
            self._run_up = None
        if math.dist(position_of(state.pose), place) <= self.tolerance_m:
            self._approach.stop_here()
        elif self._run_ups < RUN_UPS:
            self._run_ups += 1
            run_up_m = RUN_UP_RADII * self.bounds.turn_radius_m
            before = point_beyond(place, self._yaw_rad or 0.0, -run_up_m)
            self._run_up = PathFollower(Path((position_of(state.pose), before, place)), self.bounds)
            return self._run_up.step(state, self.speed_m_s)
        return None

    def _turn(self, state: MotionState) -> DesiredMotion | Ending:
        if self._yaw_rad is None or self.bounds.turn_radius_m > 0:
            return Ending()
        aside = angle_between(state.pose.yaw_rad, self._yaw_rad)
        if abs(aside) > TURNED_RAD:
            return turn(self.bounds, aside)
        return Ending() if state.stands else DesiredMotion()
