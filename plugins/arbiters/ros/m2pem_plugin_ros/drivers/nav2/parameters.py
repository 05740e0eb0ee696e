"""An order's parameters, in the fleet's local frame."""

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

from m2pem.api import (
    ArbiterContext,
    BehaviorParameters,
    GeoPosition,
    LinkState,
    Point,
    ResolvedValue,
    ResourceId,
    VehicleState,
)
from m2pem_plugin_ros.drivers.nav2.errors import NavigationError
from m2pem_plugin_ros.frames import to_local
from m2pem_plugin_ros.pose import Pose, known_yaw_rad

STALE_S = 3.0
"""Where a vehicle was so long ago, it need not be any more."""

SAME_PLACE_M = 0.1


class LocalParameters(BehaviorParameters):
    """What was requested, in the fleet's local frame; it may change on the way."""

    def __init__(self, values: Mapping[str, ResolvedValue], context: ArbiterContext) -> None:
        super().__init__(values)
        self.context = context

    def target_pose(self) -> Pose:
        """Where `target` is now, and where it points if it is a vehicle.

        Raises:
            NavigationError: it is a vehicle that is not heard.
        """
        value = self.target
        if isinstance(value, Point):
            return self._at(value.position[0], value.position[1])
        if self.target_vehicle is None:
            raise NavigationError("it has no target")
        vehicle = ResourceId(self.target_vehicle)
        state = self.context.bus.latest(vehicle)
        now_us = self.context.clock.now_us()
        if (
            not isinstance(state, VehicleState)
            or state.position is None
            or state.link is LinkState.LOST
            or now_us - state.time_us > STALE_S * 1e6
        ):
            raise NavigationError(f"{vehicle} has not been heard for {STALE_S:g} s")
        position = state.position
        place = self._at(position.latitude_deg, position.longitude_deg)
        return replace(place, yaw_rad=known_yaw_rad(state))

    def route_poses(self) -> list[Pose]:
        """`route`, each pose in the direction of the next."""
        if self.route is None:
            raise NavigationError("it has no route")
        return along([self._at(each[0], each[1]) for each in self.route.waypoints])

    def _at(self, latitude_deg: float, longitude_deg: float) -> Pose:
        position = GeoPosition(latitude_deg, longitude_deg, self.context.origin[2])
        east_m, north_m, _ = to_local(position, self.context.origin)
        return Pose(east_m, north_m, 0.0)


def along(places: list[Pose]) -> list[Pose]:
    """The same places, each in the direction of the next; the last as the one before it."""
    turned: list[Pose] = []
    yaw_rad = 0.0
    for place, following in pairwise([*places, None]):
        if place is not None:
            if following is not None and apart_m(place, following) > SAME_PLACE_M:
                yaw_rad = towards_rad(place, following)
            turned.append(replace(place, yaw_rad=yaw_rad))
    return turned


def apart_m(a: Pose, b: Pose) -> float:
    """The distance on the ground."""
    return math.hypot(a.east_m - b.east_m, a.north_m - b.north_m)


def towards_rad(a: Pose, b: Pose) -> float:
    """The yaw from one place to the other."""
    return math.atan2(b.north_m - a.north_m, b.east_m - a.east_m)
