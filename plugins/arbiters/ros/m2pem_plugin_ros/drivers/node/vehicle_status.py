"""What an m2pem node says of its vehicle, as `vehicle_status` carries it."""

import math
from dataclasses import dataclass
from typing import Any

from m2pem_plugin_ros.drivers.driver import Health
from m2pem_plugin_ros.statuses import LONGEST_REASON

_READY = {1: False, 2: True}
MOST_REASONS = 20


@dataclass(frozen=True, slots=True)
class VehicleStatus:
    """One message. `behavior`: the id of what it does, or ""."""

    vehicle: str
    behavior: str
    held: bool
    health: Health


def read_vehicle_status(message: Any) -> VehicleStatus:
    """What a message says; a charge that cannot be is not known."""
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
