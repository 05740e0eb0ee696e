"""A vehicle's state for the fleet, made of what its sensors and its driver say. Pure."""

import math

from m2pem.api import LinkState, ResourceId, VehicleState
from m2pem_plugin_ros.drivers.driver import Health
from m2pem_plugin_ros.instruments import Senses

DEGRADED_SHARE = 0.5
"""Of `lost_after_s`: a vehicle that is silent for longer has a bad link."""


def link_state(silent_s: float, lost_after_s: float) -> LinkState:
    """How well a vehicle is heard that was heard so many seconds ago."""
    if silent_s >= lost_after_s:
        return LinkState.LOST
    if silent_s >= DEGRADED_SHARE * lost_after_s:
        return LinkState.DEGRADED
    return LinkState.CONNECTED


def vehicle_state(
    resource: ResourceId,
    time_us: int,
    senses: Senses,
    health: Health,
    link: LinkState,
    behavior: str,
) -> VehicleState:
    """What the fleet is told. A part that reports an error makes the vehicle not ready."""
    pose, errors = senses.localization.pose, senses.errors
    battery = health.battery_fraction
    return VehicleState(
        resource,
        time_us,
        senses.localization.position,
        velocity_enu_m_s=_velocity(senses),
        yaw_rad=pose.yaw_rad if pose is not None else None,
        battery_fraction=senses.battery_fraction if battery is None else battery,
        mode=health.mode,
        ready=False if errors else health.ready,
        not_ready_reasons=(*health.not_ready_reasons, *errors, *senses.troubles),
        link=link,
        behavior=behavior,
    )


def _velocity(senses: Senses) -> tuple[float, float, float] | None:
    pose, twist = senses.localization.pose, senses.localization.twist
    if pose is None or twist is None:
        return None
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return (
        twist.forward_m_s * cos - twist.left_m_s * sin,
        twist.forward_m_s * sin + twist.left_m_s * cos,
        0.0,
    )
