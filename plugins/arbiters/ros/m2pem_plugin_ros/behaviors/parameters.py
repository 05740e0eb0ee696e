"""The parameters of a request in the local frame."""

import math
from collections.abc import Callable, Mapping

from m2pem.api import BehaviorParameters, Point, ResolvedValue, VehiclePosition
from m2pem_plugin_ros.behaviors.motion_state import Place, RefusedError

Level = Callable[[float, float], Place]
"""Converts latitude and longitude in degrees to a local place."""


class LocalParameters(BehaviorParameters):
    """Parameters that were checked against the catalogue, in the local frame."""

    def __init__(self, values: Mapping[str, ResolvedValue], level: Level, own_name: str) -> None:
        super().__init__(values)
        self._level = level
        self._own_name = own_name

    def route_places(self) -> tuple[Place, ...]:
        """Return the places of `route`.

        Raises:
            RefusedError: the route is empty.
        """
        route = self.route
        if route is None or not route.waypoints:
            raise RefusedError("parameter 'route': the route has no waypoints")
        return tuple(self._place("route", each[0], each[1]) for each in route.waypoints)

    def other_vehicle(self) -> str:
        """Return the vehicle that `target` names, or "".

        Raises:
            RefusedError: it is the commanded vehicle.
        """
        target = self.target
        if not isinstance(target, VehiclePosition):
            return ""
        if target.vehicle == self._own_name:
            raise RefusedError("parameter 'target': another vehicle is expected")
        return target.vehicle

    def target_place(self) -> Place:
        """Return the point of `target`.

        Raises:
            RefusedError: there is none.
        """
        target = self.target
        if not isinstance(target, Point):
            raise RefusedError("parameter 'target': it is missing")
        return self._place("target", target.position[0], target.position[1])

    def _place(self, parameter: str, latitude_deg: float, longitude_deg: float) -> Place:
        if math.isfinite(latitude_deg + longitude_deg):
            place = self._level(latitude_deg, longitude_deg)
            if math.isfinite(place[0] + place[1]):
                return place
        raise RefusedError(
            f"parameter '{parameter}': [{latitude_deg}, {longitude_deg}] is not a position"
        )
