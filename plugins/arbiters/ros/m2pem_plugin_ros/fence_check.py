"""Checks whether a behavior would leave the fence of the fleet."""

import math
from collections.abc import Callable

from m2pem.api import (
    Area,
    BehaviorParameters,
    BehaviorRequest,
    Fence,
    FleetBus,
    GeoPosition,
    LatLon,
    Point,
    ResourceId,
    VehicleState,
)
from m2pem_plugin_ros.catalogue import BEHIND_RAD, OFFSET_M
from m2pem_plugin_ros.frames import to_geodetic
from m2pem_plugin_ros.pose import known_yaw_rad


class FenceCheck:
    """The fence of one vehicle. Of targets that move, only the current position is known."""

    def __init__(self, area: Area, bus: FleetBus) -> None:
        self._fence = Fence(area)
        self._bus = bus

    def refusal(
        self, request: BehaviorRequest, position: GeoPosition | None, yaw_rad: float | None
    ) -> str:
        """Return where the way would leave the fence; "" if it does not. `position` and `yaw_rad`
        are those of the vehicle. Without them, the way from the vehicle is not checked."""
        start = None if position is None else position.latlon
        parameters = BehaviorParameters(request.parameters)
        match request.behavior:
            case "single_vehicle_routing":
                return self._of_route(parameters, start)
            case "goto":
                return self._of_place(self._target(parameters), start, "the target")
            case "follow":
                return self._of_place(self._station(parameters), start, "its station at the target")
            case "reverse" if position is not None and yaw_rad is not None:
                behind = _beside(position, yaw_rad, -parameters.distance_m)
                return self._of_place(behind, start, "the place behind it")
        return ""

    def _of_place(self, place: GeoPosition | None, start: LatLon | None, name: str) -> str:
        if place is None:
            return ""
        return self._fence.breach([place.latlon], start, lambda _: name)

    def _of_route(self, parameters: BehaviorParameters, start: LatLon | None) -> str:
        route = parameters.route
        if route is None or not route.waypoints:
            return ""
        way = [waypoint[:2] for waypoint in route.waypoints]
        reason = self._fence.breach(way, start, _waypoint(0))
        if not reason and parameters.loop:
            last = len(way) - 1
            names = (_waypoint(last)(0), _waypoint(0)(0))
            reason = self._fence.breach([way[-1], way[0]], None, lambda index: names[index])
        return reason

    def _target(self, parameters: BehaviorParameters) -> GeoPosition | None:
        target = parameters.target
        if isinstance(target, Point):
            return GeoPosition(*target.position[:2], 0.0)
        state = self._vehicle(parameters)
        return None if state is None else state.position

    def _station(self, parameters: BehaviorParameters) -> GeoPosition | None:
        state = self._vehicle(parameters)
        if state is None or state.position is None:
            return None
        bearing_rad, offset_m = parameters.bearing_rad, parameters.offset_m
        yaw_rad = known_yaw_rad(state) - (BEHIND_RAD if bearing_rad is None else bearing_rad)
        return _beside(state.position, yaw_rad, OFFSET_M if offset_m is None else offset_m)

    def _vehicle(self, parameters: BehaviorParameters) -> VehicleState | None:
        state = self._bus.latest(ResourceId(parameters.target_vehicle or ""))
        return state if isinstance(state, VehicleState) else None


def _waypoint(first: int) -> Callable[[int], str]:
    return lambda index: f"waypoint {first + index + 1} of the route"


def _beside(position: GeoPosition, yaw_rad: float, distance_m: float) -> GeoPosition:
    east_m, north_m = distance_m * math.cos(yaw_rad), distance_m * math.sin(yaw_rad)
    return to_geodetic(east_m, north_m, 0.0, (*position.latlon, 0.0))
