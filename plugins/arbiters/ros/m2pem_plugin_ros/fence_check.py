"""Checks whether a behavior would leave the fence of the fleet."""

import math
from collections.abc import Callable

from m2pem.api import (
    Area,
    BehaviorRequest,
    Fence,
    FleetBus,
    GeoPosition,
    Point,
    ResourceId,
    Route,
    VehiclePosition,
    VehicleState,
)
from m2pem_plugin_ros.catalogue import BEHIND_RAD, OFFSET_M, REVERSE_M
from m2pem_plugin_ros.frames import to_geodetic
from m2pem_plugin_ros.pose import known_yaw_rad

_LatLon = tuple[float, float]


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
        start = None if position is None else _latlon(position)
        match request.behavior:
            case "single_vehicle_routing":
                return self._of_route(request, start)
            case "goto":
                return self._of_place(self._target(request), start, "the target")
            case "follow":
                return self._of_place(self._station(request), start, "its station at the target")
            case "reverse" if position is not None and yaw_rad is not None:
                back_m = -_number(request, "distance", REVERSE_M)
                behind = _beside(position, yaw_rad, back_m)
                return self._of_place(behind, start, "the place behind it")
        return ""

    def _of_place(self, place: GeoPosition | None, start: _LatLon | None, name: str) -> str:
        if place is None:
            return ""
        return self._fence.breach([_latlon(place)], start, lambda _: name)

    def _of_route(self, request: BehaviorRequest, start: _LatLon | None) -> str:
        route = request.parameters.get("route")
        if not isinstance(route, Route) or not route.waypoints:
            return ""
        way = [waypoint[:2] for waypoint in route.waypoints]
        reason = self._fence.breach(way, start, _waypoint(0))
        if not reason and request.parameters.get("loop") is True:
            last = len(way) - 1
            names = (_waypoint(last)(0), _waypoint(0)(0))
            reason = self._fence.breach([way[-1], way[0]], None, lambda index: names[index])
        return reason

    def _target(self, request: BehaviorRequest) -> GeoPosition | None:
        target = request.parameters.get("target")
        if isinstance(target, Point):
            return GeoPosition(*target.position[:2], 0.0)
        state = self._vehicle(request)
        return None if state is None else state.position

    def _station(self, request: BehaviorRequest) -> GeoPosition | None:
        state = self._vehicle(request)
        if state is None or state.position is None:
            return None
        yaw_rad = known_yaw_rad(state) - _number(request, "bearing", BEHIND_RAD)
        return _beside(state.position, yaw_rad, _number(request, "offset", OFFSET_M))

    def _vehicle(self, request: BehaviorRequest) -> VehicleState | None:
        target = request.parameters.get("target")
        if not isinstance(target, VehiclePosition):
            return None
        state = self._bus.latest(ResourceId(target.vehicle))
        return state if isinstance(state, VehicleState) else None


def _waypoint(first: int) -> Callable[[int], str]:
    return lambda index: f"waypoint {first + index + 1} of the route"


def _number(request: BehaviorRequest, name: str, usual: float) -> float:
    value = request.parameters.get(name)
    return float(value) if isinstance(value, int | float) else usual


def _latlon(position: GeoPosition) -> _LatLon:
    return position.latitude_deg, position.longitude_deg


def _beside(position: GeoPosition, yaw_rad: float, distance_m: float) -> GeoPosition:
    east_m, north_m = distance_m * math.cos(yaw_rad), distance_m * math.sin(yaw_rad)
    return to_geodetic(east_m, north_m, 0.0, (*_latlon(position), 0.0))
