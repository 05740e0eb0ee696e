"""The states of other vehicles that behaviors on board need, received on `target`."""

import math
from collections.abc import AsyncIterator
from typing import Any

from m2pem.api import AsyncQueue, GeoPosition, PayloadState, ResourceId, VehicleState
from m2pem.api.remember import remember
from m2pem_plugin_ros.interfaces.key_values import WireError

MOST_TARGETS = 1000

State = VehicleState | PayloadState


class TargetBus:
    """Implements `m2pem.api.FleetBus` for drivers on board."""

    def __init__(self) -> None:
        self._latest: dict[ResourceId, State] = {}
        self._readers: list[AsyncQueue[State]] = []

    def latest(self, resource: ResourceId) -> State | None:
        """Return the newest state, or None before the first."""
        return self._latest.get(resource)

    def publish(self, state: State) -> None:
        """Publish a state to all readers."""
        remember(self._latest, state.resource, state, MOST_TARGETS)
        for reader in self._readers:
            reader.put(state)

    async def subscribe(self, size: int = 100) -> AsyncIterator[State]:
        """Yield states from now on, for one reader. At most `size` of them wait."""
        reader: AsyncQueue[State] = AsyncQueue(size)
        self._readers.append(reader)
        try:
            async for state in reader.read():
                yield state
        finally:
            self._readers.remove(reader)


def read_target(message: Any, now_us: int) -> VehicleState:
    """Read a TargetState. The altitude is NaN if it is not given.

    Raises:
        WireError: the target has no name, or its position is invalid.
    """
    latitude, longitude = message.position.latitude_deg, message.position.longitude_deg
    altitude = message.position.altitude_m
    if not message.vehicle:
        raise WireError("a target without a name")
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):  # nor is NaN
        raise WireError(f"the target {message.vehicle} is at {latitude}, {longitude}")
    velocity = (message.velocity.x, message.velocity.y, message.velocity.z)
    altitude = altitude if math.isfinite(altitude) else math.nan
    return VehicleState(
        ResourceId(message.vehicle),
        now_us,
        GeoPosition(latitude, longitude, altitude),
        velocity_enu_m_s=velocity if all(map(math.isfinite, velocity)) else None,
        yaw_rad=message.yaw_rad if math.isfinite(message.yaw_rad) else None,
    )
