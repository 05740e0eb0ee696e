"""Arrival checks and mode checks: has a vehicle arrived, stopped, or set out, by its telemetry?"""

import math

from m2pem.api import LatLon, LocalFrame, distance_m, takeoff_first
from m2pem_plugin_mavlink.behaviors.behavior import Behavior, BehaviorContext
from m2pem_plugin_mavlink.microservices.message_requests import RequestMessage
from m2pem_plugin_mavlink.protocol.messages import Message
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, RetryPolicy
from m2pem_plugin_mavlink.vehicle.driver import AMSL, RELATIVE, FlightMode, TargetPosition
from m2pem_plugin_mavlink.vehicle.state import AutopilotState
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

STANDS_BELOW_M_S = 0.3
"""The reported position of a stopped vehicle drifts; a gust moves one that hovers."""

HEIGHT_TOLERANCE_M = 1.0
CIRCLING_HEIGHT_TOLERANCE_M = 5.0
"""Tolerance of heights in metres for a circling vehicle, which gusts lift and lower."""

NEAR_THE_CIRCLE = 0.25
"""Tolerance of a circle as a fraction of its radius, and the least one in metres:"""

NEAR_THE_CIRCLE_M = 5.0

LOOKS_FOR_S = 4.0
"""Seconds after a restart in which a vehicle on its way has turned and moves."""

SAME_TARGET_M = 2.0

_SHORT = RetryPolicy(tries=2, answer_s=1.0)
_IGNORES_POSITION = 0b111
"""POSITION_TARGET_TYPEMASK."""

_TOWARDS = math.cos(math.radians(60.0))


class StillnessTimer:
    """Measures for how long a vehicle has not moved, from the first call of `seconds`."""

    def __init__(self, context: BehaviorContext) -> None:
        self._context = context
        self._since_s: float | None = None

    def seconds(self, circled: LatLon | None = None, radius_m: float | None = None) -> float:
        """Return the time since the vehicle has stopped; 0 while it moves. `circled`, `radius_m`:
        see `stays_at`."""
        now_s = self._context.now_s()
        if not stays_at(self._context.vehicle, circled, radius_m):
            self._since_s = None
            return 0.0
        if self._since_s is None:
            self._since_s = now_s
        return now_s - self._since_s

    def forget(self) -> None:
        """Restart at 0."""
        self._since_s = None


def is_still(vehicle: Vehicle) -> bool:
    """Return whether the vehicle hardly moves."""
    return vehicle.state.speed_m_s < STANDS_BELOW_M_S


def stays_at(vehicle: Vehicle, at: LatLon | None, radius_m: float | None = None) -> bool:
    """Return whether the vehicle hardly moves or, if it cannot stop in the air, is on or inside its
    circle around `at`. `radius_m`: of the circle; None: the radius that the autopilot is set to."""
    if is_still(vehicle):
        return True
    if at is None or not cannot_stop(vehicle):
        return False
    return distance_to_m(vehicle, at) <= arrival_radius_m(vehicle, 0.0, radius_m)


def cannot_stop(vehicle: Vehicle) -> bool:
    """Return whether the vehicle is in the air and cannot stop there."""
    return vehicle.state.loiter_radius_m is not None and vehicle.state.landed is not True


def circle_tolerance_m(radius_m: float) -> float:
    """Return how far from the circle a vehicle may be to count as on it."""
    return max(NEAR_THE_CIRCLE_M, NEAR_THE_CIRCLE * radius_m)


def arrival_radius_m(vehicle: Vehicle, tolerance_m: float, radius_m: float | None = None) -> float:
    """Return how near to a place the vehicle counts as arrived: the tolerance or, if it cannot
    stop, its circle."""
    radius = vehicle.state.loiter_radius_m if radius_m is None else radius_m
    if radius is None or not cannot_stop(vehicle):
        return tolerance_m
    return radius + max(tolerance_m, circle_tolerance_m(radius))


def height_tolerance_m(vehicle: Vehicle, tolerance_m: float) -> float:
    """Return the tolerance of heights; it is larger for a vehicle that circles."""
    return max(tolerance_m, CIRCLING_HEIGHT_TOLERANCE_M) if cannot_stop(vehicle) else tolerance_m


def position_of(vehicle: Vehicle) -> LatLon | None:
    """Return the latitude and longitude; None if unknown."""
    position = vehicle.state.position
    return position.latlon if position is not None else None


def distance_to_m(vehicle: Vehicle, place: LatLon) -> float:
    """Return the distance to a place over ground; infinite while the position is unknown."""
    here = position_of(vehicle)
    return distance_m(place, here) if here is not None else math.inf


def height_m(state: AutopilotState, frame: str) -> float | None:
    """Return the height above home, above mean sea level or above terrain, by `frame`; None if
    unknown."""
    if frame == RELATIVE:
        return state.altitude_above_home_m
    if frame == AMSL:
        return state.position.altitude_m if state.position is not None else None
    return state.altitude_above_terrain_m


def height_error_m(vehicle: Vehicle, place: TargetPosition) -> float:
    """Return the difference in height to a place; 0 if no height was requested or it is unknown."""
    if place.altitude_m is None:
        return 0.0
    height = height_m(vehicle.state, place.altitude_frame)
    return abs(height - place.altitude_m) if height is not None else 0.0


def on_the_ground(vehicle: Vehicle) -> bool:
    """Return whether the vehicle is an aircraft that has not taken off."""
    return vehicle.domain == "air" and vehicle.state.landed is True


def takeoff_required(vehicle: Vehicle) -> str:
    """Return why a motion cannot begin before a takeoff; "" if it can."""
    return takeoff_first(vehicle.resource) if on_the_ground(vehicle) else ""


def accepted_modes(behavior: Behavior) -> frozenset[FlightMode]:
    """Return the modes in which a behavior continues. PX4 goes to a place in the mode in which it
    holds."""
    modes = behavior.modes
    if FlightMode.GUIDED in modes and "px4" in behavior.vehicle.driver.name.lower():
        return modes | {FlightMode.HOLD}
    return modes


def accepts_mode(behavior: Behavior, mode: FlightMode) -> bool:
    """Return whether a vehicle in this mode may be executing the behavior."""
    return mode in accepted_modes(behavior)


async def moves_towards(vehicle: Vehicle, place: TargetPosition) -> bool:
    """Return whether the vehicle moves towards a place, or reports it as its target; wait up to
    `LOOKS_FOR_S` for the motion."""

    def towards() -> bool:
        return _towards(vehicle, place)

    return (
        towards() or await _has_target(vehicle, place) or await vehicle.until(towards, LOOKS_FOR_S)
    )


def _towards(vehicle: Vehicle, place: TargetPosition) -> bool:
    here, velocity = position_of(vehicle), vehicle.state.velocity_enu_m_s
    if here is None or velocity is None or vehicle.state.speed_m_s < STANDS_BELOW_M_S:
        return False
    east, north = LocalFrame(here).to_local(place.latlon)
    height = height_m(vehicle.state, place.altitude_frame)
    up = 0.0
    if place.altitude_m is not None and height is not None:
        up = place.altitude_m - height
    ahead = math.hypot(east, north, up)
    along = (east * velocity[0] + north * velocity[1] + up * velocity[2]) if ahead else 0.0
    return along > _TOWARDS * ahead * vehicle.state.speed_m_s


async def _has_target(vehicle: Vehicle, place: TargetPosition) -> bool:
    """Ask the autopilot for its target: a plane may fly away from its target until it has turned.
    Heights in the answer are above mean sea level."""
    try:
        target = await _position_target(vehicle)
    except ExchangeError:
        return False  # the autopilot has no target, or does not report it
    if distance_m(place.latlon, target[:2]) > SAME_TARGET_M:
        return False
    height, here = height_m(vehicle.state, place.altitude_frame), vehicle.state.position
    if place.altitude_m is None or height is None or here is None:
        return True
    return abs(target[2] - here.altitude_m - (place.altitude_m - height)) < HEIGHT_TOLERANCE_M


async def _position_target(vehicle: Vehicle) -> tuple[float, float, float]:
    """Return the autopilot's target: latitude and longitude in degrees, metres above mean sea level
    (POSITION_TARGET_GLOBAL_INT in MAV_FRAME_GLOBAL). An autopilot without a target does not
    answer."""

    def read(message: Message) -> tuple[float, float, float] | None:
        if message.type_mask & _IGNORES_POSITION:
            return None
        return message.lat_int / 1e7, message.lon_int / 1e7, message.alt

    name, address = "POSITION_TARGET_GLOBAL_INT", vehicle.link.address
    return await vehicle.link.perform(RequestMessage(address, name, read, retry_policy=_SHORT))
