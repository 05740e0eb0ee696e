"""Staying with another vehicle."""

import math
from dataclasses import replace

from m2pem.api import BehaviorState
from m2pem_plugin_ros.behaviors.goto import UNHEARD_S
from m2pem_plugin_ros.behaviors.motion import Motion
from m2pem_plugin_ros.behaviors.motion_state import (
    STAND,
    Ending,
    Place,
    RefusedError,
    Scene,
    Target,
    Wish,
    beyond,
    place_of,
    turned,
    yaw_towards,
)
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.behaviors.path_following import Approach
from m2pem_plugin_ros.behaviors.steering import Steering, braking_speed, lookahead
from m2pem_plugin_ros.catalogue import BEHIND_RAD, OFFSET_M
from m2pem_plugin_ros.settings import Bounds

STATION_M = 1.0
LEFT_STATION_M = 2.0
"""At a target that stands, it stands within the first of its station, and goes again beyond the
second."""

STANDING_M_S = 0.2
CLEARANCE_M = 2.0
"""It stands rather than come nearer to its target than this, whatever `offset` says."""

GAIN_1_S = 0.5


class Follow(Motion):
    """Keep a station at another vehicle: `offset` from it, at `bearing` from its bow."""

    name = "follow"

    def __init__(self, parameters: LocalParameters, bounds: Bounds) -> None:
        super().__init__(parameters, bounds)
        self.target = parameters.other_vehicle()
        if not self.target:
            raise RefusedError("parameter 'target': another vehicle is expected")
        self._offset_m = OFFSET_M
        self._bearing_rad = BEHIND_RAD
        self._take_station(parameters)
        self._steering = Steering()
        self._approach: Approach | None = None
        self._at_station = False

    def step(self, scene: Scene) -> Wish | Ending:
        """Towards the station, as fast as the target and the gap want it."""
        target = scene.target
        if target is None or not target.age_s <= UNHEARD_S:
            reason = f"{self.target} has not been heard for {UNHEARD_S:g} s"
            return Ending(BehaviorState.FAILED, "", reason)
        place = _now_at(target)
        course_rad, speed = _motion(target)
        wish = self._towards(scene, target, place, course_rad, speed)
        return self._clear(scene, wish, place, speed)

    def _towards(
        self, scene: Scene, target: Target, place: Place, course_rad: float, speed: float
    ) -> Wish:
        station = beyond(place, target.pose.yaw_rad - self._bearing_rad, self._offset_m)
        if speed < STANDING_M_S:
            return self._to_rest(scene, station)
        self._at_station = False
        self._approach = None
        return self._keep_up(scene, station, course_rad, speed)

    def _clear(self, scene: Scene, wish: Wish, place: Place, speed: float) -> Wish:
        """The same, but not into the target: as fast as it moves, and as one can still brake."""
        here = place_of(scene.pose)
        ahead = turned(scene.pose.yaw_rad, yaw_towards(here, place))
        if abs(ahead) > math.pi / 2:
            return wish
        room = math.dist(here, place) - CLEARANCE_M
        allowed = braking_speed(self.bounds, room, speed if room > 0 else 0.0)
        return replace(wish, speed_m_s=min(wish.speed_m_s, allowed))

    def adjust(self, parameters: LocalParameters) -> None:
        """Speed and station."""
        super().adjust(parameters)
        self._take_station(parameters)

    def _take_station(self, parameters: LocalParameters) -> None:
        offset, bearing = parameters.offset_m, parameters.bearing_rad
        self._offset_m = self._offset_m if offset is None else offset
        self._bearing_rad = self._bearing_rad if bearing is None else bearing

    def _to_rest(self, scene: Scene, station: Place) -> Wish:
        """The target stands: go to the station, and stand there."""
        away = math.dist(place_of(scene.pose), station)
        self._at_station = away <= (LEFT_STATION_M if self._at_station else STATION_M)
        if self._at_station:
            self._approach = None
            return STAND
        if self._approach is None:
            self._approach = Approach(STATION_M, moves=True)
        wish = self._approach.step(scene, station, self.speed_m_s)
        return wish if isinstance(wish, Wish) else STAND

    def _keep_up(self, scene: Scene, station: Place, course_rad: float, speed: float) -> Wish:
        """The target moves: near its station, steer along its course rather than to the point."""
        here = place_of(scene.pose)
        gap = math.dist(here, station)
        ahead_m = lookahead(self.bounds, scene.speed_m_s)
        along = gap * math.cos(yaw_towards(here, station) - course_rad)
        if gap > 2 * ahead_m:
            wanted = speed + min(GAIN_1_S * gap, braking_speed(self.bounds, gap))
            return self._steering.towards(scene, station, min(wanted, self.speed_m_s))
        wanted = max(0.0, min(self.speed_m_s, speed + GAIN_1_S * along))
        if wanted < STANDING_M_S and along < 0:
            return STAND  # it is ahead of its station, which comes by itself
        point = beyond(station, course_rad, ahead_m)
        return self._steering.towards(scene, point, wanted)


def _now_at(target: Target) -> Place:
    return (
        target.pose.east_m + target.east_m_s * target.age_s,
        target.pose.north_m + target.north_m_s * target.age_s,
    )


def _motion(target: Target) -> tuple[float, float]:
    """Course and speed over ground."""
    speed = math.hypot(target.east_m_s, target.north_m_s)
    return math.atan2(target.north_m_s, target.east_m_s), speed
