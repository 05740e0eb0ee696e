"""The behavior `follow`: keep a position relative to another vehicle."""

import math
from dataclasses import replace

from m2pem.api import BEHIND_RAD, OFFSET_M, BehaviorState
from m2pem_plugin_ros.behaviors.goto import TARGET_SILENT_S
from m2pem_plugin_ros.behaviors.motion import Motion
from m2pem_plugin_ros.behaviors.motion_state import (
    STANDSTILL,
    DesiredMotion,
    Ending,
    MotionState,
    Place,
    RefusedError,
    angle_between,
    direction_to,
    point_beyond,
    position_of,
)
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.behaviors.path_following import Approach
from m2pem_plugin_ros.behaviors.steering import Steering, braking_speed, lookahead
from m2pem_plugin_ros.settings import Bounds

STATION_M = 1.0
LEFT_POSITION_M = 2.0
"""While the target stands, the base stops within the first distance of its position, and starts
again beyond the second."""

STANDING_M_S = 0.2
CLEARANCE_M = 2.0
"""The base never comes nearer to its target than this, whatever `offset` is."""

GAIN_1_S = 0.5


class Follow(Motion):
    """Keep a position at another vehicle: `offset` metres from it, at `bearing` from its
    heading."""

    name = "follow"

    def __init__(self, parameters: LocalParameters, bounds: Bounds) -> None:
        super().__init__(parameters, bounds)
        self.target = parameters.other_vehicle()
        if not self.target:
            raise RefusedError("parameter 'target': another vehicle is expected")
        self._offset_m = OFFSET_M
        self._bearing_rad = BEHIND_RAD
        self._set_position(parameters)
        self._steering = Steering()
        self._approach: Approach | None = None
        self._in_position = False

    def step(self, state: MotionState) -> DesiredMotion | Ending:
        """Drive towards the position, at a speed that follows from the target's speed and the
        gap."""
        target = state.target
        if target is None or not target.age_s <= TARGET_SILENT_S:
            reason = f"{self.target} has sent no position for {TARGET_SILENT_S:g} s"
            return Ending(BehaviorState.FAILED, "", reason)
        place = target.place
        speed = math.hypot(target.east_m_s, target.north_m_s)
        station = point_beyond(place, target.pose.yaw_rad - self._bearing_rad, self._offset_m)
        if speed < STANDING_M_S:
            desired = self._to_rest(state, station)
        else:
            self._in_position = False
            self._approach = None
            course_rad = math.atan2(target.north_m_s, target.east_m_s)
            desired = self._keep_up(state, station, course_rad, speed)
        return self._clear(state, desired, place, speed)

    def _clear(
        self, state: MotionState, desired: DesiredMotion, place: Place, speed: float
    ) -> DesiredMotion:
        """Limit the speed so that the base can brake before it reaches the target."""
        here = position_of(state.pose)
        ahead = angle_between(state.pose.yaw_rad, direction_to(here, place))
        if abs(ahead) > math.pi / 2:
            return desired
        room = math.dist(here, place) - CLEARANCE_M
        allowed = braking_speed(self.bounds, room, speed if room > 0 else 0.0)
        return replace(desired, speed_m_s=min(desired.speed_m_s, allowed))

    def adjust(self, parameters: LocalParameters) -> None:
        """Change speed, `offset` and `bearing`."""
        super().adjust(parameters)
        self._set_position(parameters)

    def _set_position(self, parameters: LocalParameters) -> None:
        offset, bearing = parameters.offset_m, parameters.bearing_rad
        self._offset_m = self._offset_m if offset is None else offset
        self._bearing_rad = self._bearing_rad if bearing is None else bearing

    def _to_rest(self, state: MotionState, station: Place) -> DesiredMotion:
        """Drive to the position of a target that stands, and stop there."""
        away = math.dist(position_of(state.pose), station)
        self._in_position = away <= (LEFT_POSITION_M if self._in_position else STATION_M)
        if self._in_position:
            self._approach = None
            return STANDSTILL
        if self._approach is None:
            self._approach = Approach(STATION_M, moves=True)
        desired = self._approach.step(state, station, self.speed_m_s)
        return desired if isinstance(desired, DesiredMotion) else STANDSTILL

    def _keep_up(
        self, state: MotionState, station: Place, course_rad: float, speed: float
    ) -> DesiredMotion:
        """Near the position of a moving target, steer along the target's course, not to the
        point."""
        here = position_of(state.pose)
        gap = math.dist(here, station)
        ahead_m = lookahead(self.bounds, state.speed_m_s)
        along = gap * math.cos(direction_to(here, station) - course_rad)
        if gap > 2 * ahead_m:
            wanted = speed + min(GAIN_1_S * gap, braking_speed(self.bounds, gap))
            return self._steering.towards(state, station, min(wanted, self.speed_m_s))
        wanted = max(0.0, min(self.speed_m_s, speed + GAIN_1_S * along))
        if wanted < STANDING_M_S and along < 0:
            return STANDSTILL  # the base is ahead of its position: wait
        point = point_beyond(station, course_rad, ahead_m)
        return self._steering.towards(state, point, wanted)
