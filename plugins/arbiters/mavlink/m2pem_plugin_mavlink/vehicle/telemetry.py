"""A vehicle's state for the fleet, made of what was heard of it."""

from m2pem.api import LinkState, ResourceId, VehicleState
from m2pem_plugin_mavlink.vehicle.driver import Readiness
from m2pem_plugin_mavlink.vehicle.heard import Heard

DEGRADED_SHARE = 0.5
"""Of `lost_after_s`: a vehicle that is silent for longer has a bad link."""

DEGRADED_LOSS = 0.25
"""Of its frames: a link that loses more is a bad one."""


def link_state(silent_s: float | None, lost_after_s: float, loss: float = 0.0) -> LinkState:
    """How well a vehicle is heard that was heard so many seconds ago (None: never), and of whose
    frames the share `loss` goes missing."""
    if silent_s is None or silent_s >= lost_after_s:
        return LinkState.LOST
    if silent_s >= DEGRADED_SHARE * lost_after_s or loss > DEGRADED_LOSS:
        return LinkState.DEGRADED
    return LinkState.CONNECTED


def vehicle_state(
    resource: ResourceId,
    time_us: int,
    heard: Heard,
    mode: str,
    readiness: Readiness | None,
    link: LinkState,
) -> VehicleState:
    """What the fleet is told. `mode`: the autopilot's own name of it."""
    return VehicleState(
        resource,
        time_us,
        heard.position,
        heard.altitude_above_home_m,
        heard.velocity_enu_m_s,
        heard.roll_rad or 0.0,
        heard.pitch_rad or 0.0,
        heard.yaw_rad,
        heard.battery_fraction,
        mode,
        heard.armed,
        readiness.ready if readiness else None,
        readiness.reasons if readiness else (),
        link,
    )
