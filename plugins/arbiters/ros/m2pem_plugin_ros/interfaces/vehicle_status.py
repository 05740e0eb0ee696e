"""m2pem_interfaces/msg/VehicleStatus and PayloadStatus, read and written."""

import math
from dataclasses import dataclass
from typing import Any

from m2pem.api import LinkState, PayloadState
from m2pem_plugin_ros.drivers.driver import Health
from m2pem_plugin_ros.interfaces.behavior_status import LONGEST_REASON

READINESS = {None: 0, False: 1, True: 2}
"""By the constants of VehicleStatus.msg and FleetResource.msg."""

_READY = {number: ready for ready, number in READINESS.items()}
MOST_REASONS = 20


@dataclass(frozen=True, slots=True)
class VehicleStatus:
    """One message. `behavior` is the id of the current behavior, or ""."""

    vehicle: str
    behavior: str
    held: bool
    health: Health


def read_vehicle_status(message: Any) -> VehicleStatus:
    """Read a message. An invalid battery charge is dropped."""
    battery = float(message.battery)
    known = math.isfinite(battery) and 0.0 <= battery <= 1.0
    reasons = [reason[:LONGEST_REASON] for reason in message.not_ready_reasons[:MOST_REASONS]]
    health = Health(
        message.mode[:LONGEST_REASON],
        _READY.get(message.readiness),
        tuple(reasons),
        battery if known else None,
    )
    return VehicleStatus(message.vehicle, message.behavior, bool(message.held), health)


LINKS = {LinkState.CONNECTED: 1, LinkState.DEGRADED: 2, LinkState.LOST: 3}
"""By the constants of PayloadStatus.msg and FleetResource.msg."""


def write_payload_status(messages: Any, state: PayloadState, *, to_operators: bool = False) -> Any:
    """Return a message without a stamp. `messages` is m2pem_interfaces.msg. With `to_operators`, it
    has the link and the behavior, too."""
    message = messages.PayloadStatus(
        payload=state.resource,
        pan_rad=_nan_if_none(state.pan_rad),
        tilt_rad=_nan_if_none(state.tilt_rad),
        zoom=_nan_if_none(state.zoom),
        footprint=[
            messages.GeoPoint(
                latitude_deg=corner.latitude_deg,
                longitude_deg=corner.longitude_deg,
                altitude_m=corner.altitude_m,
            )
            for corner in state.footprint
        ],
    )
    if to_operators:
        message.behavior = state.behavior
        message.link = LINKS[state.link]
    return message


def _nan_if_none(value: float | None) -> float:
    return math.nan if value is None else float(value)
