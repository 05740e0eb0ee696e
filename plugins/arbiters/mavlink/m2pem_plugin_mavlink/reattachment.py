"""Detects after a restart that a vehicle has not begun an accepted behavior.

That is so if it is at the same place a short time later, in the same state or in the state into
which m2pem brings it before the start: in the behavior's mode and armed. Another mode, disarmed
motors or another place may be a person's intention; then an operator is asked.
"""

from m2pem_plugin_mavlink.behaviors.arrival import accepts_mode, distance_to_m, is_still
from m2pem_plugin_mavlink.behaviors.behavior import Behavior
from m2pem_plugin_mavlink.checkpoint import VehicleSnapshot
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

SOON_S = 60.0
"""Later, a person near the vehicle does not expect it to move by itself."""

SAME_PLACE_M = 3.0
"""The reported position of a stopped vehicle drifts by up to this distance within that time."""


def take_snapshot(vehicle: Vehicle, now_s: float) -> VehicleSnapshot | None:
    """Return the present snapshot; None if the vehicle has not reported all of it yet."""
    state = vehicle.state
    position, height_m = state.position, state.altitude_above_home_m
    if state.armed is None or state.landed is None or state.custom_mode is None:
        return None
    if position is None or height_m is None:
        return None
    reported = state.armed, state.landed, state.custom_mode
    return VehicleSnapshot(now_s, *reported, *position.latlon, height_m)


def shows_not_begun(behavior: Behavior, was: VehicleSnapshot | None, now_s: float) -> bool:
    """Return whether the vehicle shows that it has not begun the behavior. A behavior that moves
    nothing, such as `deploy`, shows nothing."""
    vehicle = behavior.vehicle
    now = take_snapshot(vehicle, now_s)
    if was is None or now is None or not behavior.moves_vehicle:
        return False
    as_it_was = (now.armed, now.custom_mode) == (was.armed, was.custom_mode)
    is_ready = now.armed >= was.armed and accepts_mode(behavior, vehicle.state.mode)
    return (
        0.0 <= now_s - was.at_s <= SOON_S
        and (as_it_was or is_ready)
        and now.landed == was.landed
        and is_still(vehicle)
        and distance_to_m(vehicle, (was.latitude_deg, was.longitude_deg)) <= SAME_PLACE_M
        and abs(now.altitude_m - was.altitude_m) <= SAME_PLACE_M
    )
