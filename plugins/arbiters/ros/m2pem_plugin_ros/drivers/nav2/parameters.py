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
    known_yaw_rad,
)
from m2pem_plugin_ros.drivers.nav2.errors import NavigationError
from m2pem_plugin_ros.frames import to_local
from m2pem_plugin_ros.pose import Pose

STALE_S = 3.0
"""Seconds after which the position of a vehicle is too old."""

SAME_PLACE_M = 0.1


class LocalParameters(BehaviorParameters):
    """The requested parameters in the fleet's local frame; they may change during the behavior."""

    def __init__(self, values: Mapping[str, ResolvedValue], context: ArbiterContext) -> None:
        super().__init__(values)
        self.context = context

    def target_pose(self) -> Pose:
        """Return the present position of `target`, and its heading if it is a vehicle.

        Raises:
            NavigationError: it is a vehicle without a recent position.
        """
        value = self.target
        if isinstance(value, Point):
            return self._at(value.position[0], value.position[1])
        if self.target_vehicle is None:
            raise NavigationError("the behavior has no target")
        vehicle = ResourceId(self.target_vehicle)
        state = self.context.bus.latest(vehicle)
        now_us = self.context.clock.now_us()
        if (
            not isinstance(state, VehicleState)
            or state.position is None
            or state.link is LinkState.LOST
            or now_us - state.time_us > STALE_S * 1e6
        ):
            raise NavigationError(f"{vehicle} has sent no position for {STALE_S:g} s")
        position = state.position
        place = self._at(position.latitude_deg, position.longitude_deg)
        return replace(place, yaw_rad=known_yaw_rad(state))

    def route_poses(self) -> list[Pose]:
        """Return the poses of `route`, each in the direction of the next."""
        if self.route is None:
            raise NavigationError("the behavior has no route")
        return along([self._at(each[0], each[1]) for each in self.route.waypoints])

    def _at(self, latitude_deg: float, longitude_deg: float) -> Pose:
        position = GeoPosition(latitude_deg, longitude_deg, self.context.origin[2])
        east_m, north_m, _ = to_local(position, self.context.origin)
        return Pose(east_m, north_m, 0.0)


def along(places: list[Pose]) -> list[Pose]:
    """Return poses at places, each in the direction of the next; the last as the one before it."""
    turned: list[Pose] = []
    yaw_rad = 0.0
    for place, following in pairwise([*places, None]):
        if place is not None:
            if following is not None and apart_m(place, following) > SAME_PLACE_M:
                yaw_rad = towards_rad(place, following)
            turned.append(replace(place, yaw_rad=yaw_rad))
    return turned


def apart_m(a: Pose, b: Pose) -> float:
    """Return the horizontal distance."""
    return math.hypot(a.east_m - b.east_m, a.north_m - b.north_m)


def towards_rad(a: Pose, b: Pose) -> float:
    """Return the yaw from one place to another."""
    return math.atan2(b.north_m - a.north_m, b.east_m - a.east_m)
