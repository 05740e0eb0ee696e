"""Whether a behavior of a vehicle would leave the fence of the fleet, before it begins."""

import math
from collections.abc import Callable

from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.api.bus import FleetBus
from m2pem.api.telemetry import VehicleState
from m2pem.geo.fence import Breach, Fence
from m2pem.geo.local_frame import LatLon, offset
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Point

OFFSET_M = 15.0
BEHIND_RAD = math.pi
"""The station of a following vehicle, if none is said: from its target, and clockwise from the
target's heading."""

COURSE_ABOVE_M_S = 0.3
"""A vehicle that is faster than this heads where it moves, if its yaw is not known."""

Stance = tuple[LatLon, float]
"""Where a vehicle is, and its yaw: from east, counter-clockwise, in rad."""


def find_breach(
    fence: Fence | None,
    behavior: str,
    parameters: BehaviorParameters,
    start: LatLon | None,
    yaw_rad: float | None,
    stance_of: Callable[[str], Stance | None],
) -> Breach | None:
    """Return where a behavior of a vehicle would leave a fence, if there is one; None: nowhere.

    `start` and `yaw_rad` are those of the vehicle. Without them, the way from the vehicle is not
    checked. `stance_of`: of a vehicle by its name, None if it is not known; of targets that move,
    only the current position is known.
    """
    if fence is None:
        return None
    stance = stance_of(parameters.target_vehicle or "")
    place, name = None, ""
    match behavior:
        case "single_vehicle_routing" if parameters.route is not None:
            way = [waypoint[:2] for waypoint in parameters.route.waypoints]
            return fence.find_breach(way, start, _waypoint, parameters.loop)
        case "goto":
            place, name = stance and stance[0], "the target"
            if isinstance(parameters.target, Point):
                place = parameters.target.position[:2]
        case "follow" if stance is not None:
            bearing_rad, offset_m = parameters.bearing_rad, parameters.offset_m
            yaw = stance[1] - (BEHIND_RAD if bearing_rad is None else bearing_rad)
            place = _beside(stance[0], yaw, OFFSET_M if offset_m is None else offset_m)
            name = "its station at the target"
        case "reverse" if start is not None and yaw_rad is not None:
            place = _beside(start, yaw_rad, -parameters.distance_m)
            name = "the place behind it"
    return None if place is None else fence.find_breach([place], start, lambda _: name)


def stance_on(bus: FleetBus) -> Callable[[str], Stance | None]:
    """Return what says where vehicles are by their telemetry."""

    def stance(vehicle: str) -> Stance | None:
        state = bus.latest(ResourceId(vehicle))
        if not isinstance(state, VehicleState) or state.position is None:
            return None
        return state.position.latlon, known_yaw_rad(state)

    return stance


def known_yaw_rad(state: VehicleState) -> float:
    """Return the yaw of a vehicle, from east, counter-clockwise; 0 if it is not known."""
    if state.yaw_rad is not None:
        return state.yaw_rad
    east_m_s, north_m_s, _ = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
    moves = math.hypot(east_m_s, north_m_s) > COURSE_ABOVE_M_S
    return math.atan2(north_m_s, east_m_s) if moves else 0.0


def _waypoint(index: int) -> str:
    return f"waypoint {index + 1} of the route"


def _beside(place: LatLon, yaw_rad: float, distance_m: float) -> LatLon:
    return offset(place, distance_m * math.cos(yaw_rad), distance_m * math.sin(yaw_rad))
